// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/frame_files.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "tools/cli/export/export.h"

namespace toftwin::cli {

FrameFiles::FrameFiles(const OutputOptions& output, bool several) : output_(output) {
  const auto format = formatOf(output.file, output.how.format);
  holds_many_ = format && holdsManyFrames(*format);
  is_one_ = holds_many_ || !several || output.file == kPipe;
}

Result<> FrameFiles::add(const Frame& frame, std::uint64_t number) {
  const ExportOptions& how = output_.how;
  if (holds_many_) {
    if (!sink_) {
      auto opened = openSink(output_.file, how, {});
      if (!opened) return opened.error();
      sink_ = *std::move(opened);
    }
    if (auto wrote = sink_->add(frame); !wrote) return wrote;
  } else {
    auto wrote = exportFrame(frame, numbered(output_.file, number, !is_one_), how);
    if (!wrote) return wrote.error();
    note_ = *std::move(wrote);
  }
  ++written_;
  return {};
}

Result<> FrameFiles::finish() {
  if (!sink_ || written_ == 0) return {};
  const auto finished = sink_->finish();
  note_ = sink_->note();
  return finished;
}

std::string FrameFiles::summary() const {
  const std::string name =
      is_one_ ? output_.file : fmt::format("{} files like {}", written_, numbered(output_.file, 0, true));
  return fmt::format("{}: {}", name, note_);
}

}  // namespace toftwin::cli
