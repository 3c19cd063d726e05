// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/export/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace toftwin::cli {
namespace {

/// 0, or the number of the error.
int writeAll(int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t wrote = ::write(fd, bytes.data(), bytes.size());
    if (wrote < 0 && errno != EINTR) return errno;
    if (wrote > 0) bytes = bytes.subspan(static_cast<std::size_t>(wrote));
  }
  return 0;
}

}  // namespace

Error cannotWrite(const std::filesystem::path& file, int number) {
  const bool is_full = number == ENOSPC || number == EDQUOT || number == EFBIG;
  const bool is_forbidden = number == EACCES || number == EPERM || number == EROFS;
  const char* what_to_do = is_full            ? "free space there"
                           : number == ENOENT ? "is there such a folder?"
                           : is_forbidden     ? "choose a folder that you may write to"
                                              : "choose another place";
  return {
      Error::Code::StorageFull,  // whatever keeps it from being written
      fmt::format("{}: cannot write: {}; {}", file.string(), std::strerror(number), what_to_do)};
}

Result<> writeWhole(const std::filesystem::path& file, std::span<const std::byte> bytes) {
  if (file == kPipe) {
    const int number = writeAll(STDOUT_FILENO, bytes);
    return number == 0 ? Result<>{} : Result<>{cannotWrite("standard output", number)};
  }
  std::error_code ignored;
  const auto status = std::filesystem::status(file, ignored);
  const bool in_place =
      std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
  const std::filesystem::path beside =
      in_place
          ? file
          : file.parent_path() / fmt::format(".{}.{}.part", file.filename().string(), ::getpid());
  const int flags = in_place ? O_WRONLY : O_WRONLY | O_CREAT | O_TRUNC;
  const int fd = ::open(beside.c_str(), flags | O_CLOEXEC, 0666);
  if (fd < 0) return cannotWrite(file, errno);
  int number = writeAll(fd, bytes);
  if (::close(fd) != 0 && number == 0) number = errno;
  if (!in_place && number == 0 && ::rename(beside.c_str(), file.c_str()) != 0) number = errno;
  if (number == 0) return {};
  if (!in_place) ::unlink(beside.c_str());
  return cannotWrite(file, number);
}

Result<> writeWhole(const std::filesystem::path& file, std::string_view text) {
  return writeWhole(file, std::as_bytes(std::span{text}));
}

}  // namespace toftwin::cli
