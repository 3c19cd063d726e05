// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/frame_files.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "tools/cli/export/export.h"

namespace toftwin::cli {

FrameFiles::FrameFiles(const OutputOptions& output, bool several)
    : output_(output),
      is_hdf5_(std::filesystem::path{output.file}.extension() == ".h5"),
      is_one_(is_hdf5_ || !several) {}

Result<> FrameFiles::add(const Frame& frame, std::uint64_t number) {
  const ExportOptions& how = output_.how;
  if (is_hdf5_) {
    if (!hdf5_) {
      auto created = Hdf5File::create(output_.file, frame, {.planes = how.planes, .about = {}});
      if (!created) return created.error();
      hdf5_ = *std::move(created);
    }
    if (auto wrote = hdf5_->append(frame); !wrote) return wrote;
  } else {
    auto wrote = exportFrame(frame, numbered(output_.file, number, !is_one_), how);
    if (!wrote) return wrote.error();
    note_ = *std::move(wrote);
  }
  ++written_;
  return {};
}

Result<> FrameFiles::finish() {
  if (!hdf5_ || written_ == 0) return {};
  note_ = hdf5_->note();
  if (auto closed = hdf5_->close(); !closed) return closed;
  return hdf5_->publish();
}

std::string FrameFiles::summary() const {
  const std::string name =
      is_one_ ? output_.file : fmt::format("{} files like {}", written_, numbered(output_.file, 0, true));
  return fmt::format("{}: {}", name, note_);
}

}  // namespace toftwin::cli
