// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "tools/cli/export/export.h"

namespace toftwin::cli {

/// Takes frames one after the other and makes one file, or one folder, of all.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual Result<> add(const Frame& frame) = 0;
  /// Also after an error: what was got stays.
  virtual Result<> finish() = 0;
  /// Frames that are there, or will be after finish(); and those that were given but could not be written.
  [[nodiscard]] virtual std::uint64_t frames() const = 0;
  [[nodiscard]] virtual std::uint64_t lost() const { return 0; }
  /// What a user should know of it.
  [[nodiscard]] virtual std::string note() const = 0;
};

struct SinkOptions {
  /// It has its name from the beginning and grows under it, as recordings do; else it gets its name when it is whole.
  bool in_place = false;
  bool overwrite = true;
};

using OpenSink = Result<std::unique_ptr<FrameSink>> (*)(const std::filesystem::path&, const ExportOptions&, const SinkOptions&);

// One for each format that holds many frames; toftwin's own recordings last.
Result<std::unique_ptr<FrameSink>> openHdf5(const std::filesystem::path& file, const ExportOptions& how, const SinkOptions& options);
Result<std::unique_ptr<FrameSink>> openRos2(const std::filesystem::path& file, const ExportOptions& how, const SinkOptions& options);
Result<std::unique_ptr<FrameSink>> openFoxglove(const std::filesystem::path& file, const ExportOptions& how, const SinkOptions& options);
Result<std::unique_ptr<FrameSink>> openRecording(const std::filesystem::path& file, const ExportOptions& how, const SinkOptions& options);

/// By `how.format`, or the extension. Error InvalidArgument where the format has a file for each frame.
Result<std::unique_ptr<FrameSink>> openSink(const std::filesystem::path& file, const ExportOptions& how, const SinkOptions& options);

/// A file that is made beside its place and gets its name when it is whole; without publish() nothing is left of it.
class Unpublished {
 public:
  /// `in_place`: it is made where it belongs, and stays whatever happens.
  Unpublished(std::filesystem::path file, bool in_place);
  Unpublished(Unpublished&& other) noexcept;
  Unpublished& operator=(Unpublished&&) = delete;
  ~Unpublished();
  [[nodiscard]] const std::filesystem::path& path() const { return beside_; }
  Result<> publish();

 private:
  std::filesystem::path file_, beside_;
  bool is_ours_ = true;
};

}  // namespace toftwin::cli
