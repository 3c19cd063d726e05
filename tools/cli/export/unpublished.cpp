// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "tools/cli/export/atomic_file.h"
#include "tools/cli/export/frame_sink.h"

namespace toftwin::cli {

Unpublished::Unpublished(std::filesystem::path file, bool in_place)
    : file_(std::move(file)),
      beside_(in_place ? file_ : file_.parent_path() / fmt::format(".{}.{}.part", file_.filename().string(), ::getpid())),
      is_ours_(!in_place) {}

Unpublished::Unpublished(Unpublished&& other) noexcept
    : file_(std::move(other.file_)), beside_(std::move(other.beside_)), is_ours_(std::exchange(other.is_ours_, false)) {}

Unpublished::~Unpublished() {
  std::error_code ignored;
  if (is_ours_) std::filesystem::remove_all(beside_, ignored);
}

Result<> Unpublished::publish() {
  if (!is_ours_) return {};
  if (::rename(beside_.c_str(), file_.c_str()) != 0) return cannotWrite(file_, errno);
  is_ours_ = false;
  return {};
}

}  // namespace toftwin::cli
