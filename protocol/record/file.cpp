// SPDX-License-Identifier: Apache-2.0
#include "protocol/record/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

namespace toftwin::record {
namespace {

/// What went wrong with a file, and what to do about it.
Error systemError(const std::filesystem::path& path, const char* doing, int number) {
  const std::string what =
      fmt::format("{}: cannot {}: {}", path.string(), doing, std::strerror(number));
  switch (number) {
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return {Error::Code::StorageFull, what + "; free space there or record somewhere else"};
    case ENOENT:
      return {Error::Code::NotFound, what + "; is the path right?"};
    case EACCES:
    case EPERM:
    case EROFS:
      return {Error::Code::PermissionDenied, what + "; choose a place that you may use"};
    case EEXIST:
      return {
          Error::Code::InvalidArgument,
          fmt::format("{}: there is such a file already; choose another name, or remove it first",
                      path.string())};
    default:
      return {Error::Code::Internal, what};
  }
}

}  // namespace

Result<OutputFile> OutputFile::create(const std::filesystem::path& path, bool overwrite) {
  const int flags = O_WRONLY | O_CREAT | O_CLOEXEC | (overwrite ? O_TRUNC : O_EXCL);
  const int fd = ::open(path.c_str(), flags, 0644);
  if (fd < 0) return systemError(path, "create this file", errno);
  return OutputFile{fd, path};
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      size_(other.size_),
      path_(std::move(other.path_)),
      is_in_folder_(other.is_in_folder_),
      syncing_(std::move(other.syncing_)) {}

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(size_, other.size_);
  std::swap(path_, other.path_);
  std::swap(is_in_folder_, other.is_in_folder_);
  std::swap(syncing_, other.syncing_);
  return *this;
}

OutputFile::~OutputFile() {
  if (syncing_.valid()) syncing_.wait();
  if (fd_ >= 0) ::close(fd_);
}

Result<> OutputFile::append(std::span<const std::byte> bytes) {
  std::uint64_t at = size_;
  while (!bytes.empty()) {
    const ssize_t wrote = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) {
      const int number = wrote < 0 ? errno : ENOSPC;
      // Readers stop at a torn end anyway; without it they need no guess.
      if (::ftruncate(fd_, static_cast<off_t>(size_)) != 0) { /* then the torn end stays */
      }
      return systemError(path_, "write", number);
    }
    at += static_cast<std::uint64_t>(wrote);
    bytes = bytes.subspan(static_cast<std::size_t>(wrote));
  }
  size_ = at;
  return {};
}

Result<std::uint64_t> OutputFile::freeBytes() const {
  struct statvfs disk {};
  if (::fstatvfs(fd_, &disk) != 0) return systemError(path_, "ask for the free space", errno);
  return std::uint64_t{disk.f_bavail} * disk.f_frsize;
}

namespace {

/// The file's bytes, and its name if that is not there for certain.
int bringToDisk(int fd, const std::filesystem::path& folder, bool is_in_folder) {
  // EINVAL: a pipe or a device such as /dev/null, which has nothing to wait for.
  if (::fdatasync(fd) != 0 && errno != EINVAL) return errno;
  if (is_in_folder) return 0;
  const int opened = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (opened < 0) return errno;
  const int number = ::fsync(opened) != 0 && errno != EINVAL ? errno : 0;
  ::close(opened);
  return number;
}

}  // namespace

Result<> OutputFile::sync() {
  if (syncing_.valid()) {
    if (syncing_.wait_for(std::chrono::seconds{0}) != std::future_status::ready) return {};
    if (const int number = syncing_.get(); number != 0) return systemError(path_, "write to the disk", number);
  }
  const auto folder = path_.has_parent_path() ? path_.parent_path() : std::filesystem::path{"."};
  syncing_ = std::async(std::launch::async, bringToDisk, fd_, folder, std::exchange(is_in_folder_, true));
  return {};
}

Result<> OutputFile::close() {
  if (syncing_.valid()) syncing_.wait();  // what it could not do, the next line cannot, either
  const int fd = std::exchange(fd_, -1);
  if (fd < 0) return {};
  // EINVAL: a pipe or a device such as /dev/null, which has nothing to wait for.
  const int number = ::fdatasync(fd) != 0 && errno != EINVAL ? errno : 0;
  if (::close(fd) != 0 && number == 0) return systemError(path_, "close", errno);
  if (number != 0) return systemError(path_, "write to the disk", number);
  return {};
}

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return systemError(path, "open this file", errno);
  struct stat about {};
  if (::fstat(fd, &about) != 0 || !S_ISREG(about.st_mode)) {
    ::close(fd);
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("{}: this is not a regular file, so it cannot be a recording", path.string())};
  }
  return InputFile{fd, static_cast<std::uint64_t>(about.st_size), path};
}

InputFile::InputFile(InputFile&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), size_(other.size_), path_(std::move(other.path_)) {}

InputFile& InputFile::operator=(InputFile&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(size_, other.size_);
  std::swap(path_, other.path_);
  return *this;
}

InputFile::~InputFile() {
  if (fd_ >= 0) ::close(fd_);
}

Result<> InputFile::readAt(std::uint64_t offset, std::span<std::byte> into) const {
  while (!into.empty()) {
    const ssize_t got = ::pread(fd_, into.data(), into.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return systemError(path_, "read", errno);
    if (got == 0) {
      return Error{Error::Code::Malformed,
                   fmt::format("{}: the file ends at byte {}, where more was expected",
                               path_.string(), offset)};
    }
    offset += static_cast<std::uint64_t>(got);
    into = into.subspan(static_cast<std::size_t>(got));
  }
  return {};
}

}  // namespace toftwin::record
