// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "tools/cli/export/frame_sink.h"
#include "tools/cli/options.h"

namespace toftwin::cli {

/// Where the frames of a command go: into one file each, numbered where there are several, or all into one
/// file of a format that holds many.
class FrameFiles {
 public:
  /// `output` must outlive it.
  FrameFiles(const OutputOptions& output, bool several);
  /// `number` is that in the file's name.
  Result<> add(const Frame& frame, std::uint64_t number);
  /// Also after an error: what was got stays.
  Result<> finish();
  [[nodiscard]] std::uint64_t written() const { return written_; }
  /// "40 files like a-0000.png: …", for people.
  [[nodiscard]] std::string summary() const;

 private:
  const OutputOptions& output_;
  bool holds_many_, is_one_;
  std::unique_ptr<FrameSink> sink_;
  std::uint64_t written_ = 0;
  std::string note_;
};

}  // namespace toftwin::cli
