// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "calib/plan/run_index.h"
#include "protocol/record/recording.h"
#include "tools/cli/campaign/manifest.h"

namespace toftwin::cli {

/// The recordings of one capture while they are written, beside where they will lie. What a kill leaves of them has the
/// same name when the capture is taken again.
class CaptureFiles {
 public:
  CaptureFiles(std::filesystem::path folder, std::string name_a, std::string name_b)
      : folder_(std::move(folder)), names_{std::move(name_a), std::move(name_b)} {}
  ~CaptureFiles();
  CaptureFiles(const CaptureFiles&) = delete;
  CaptureFiles& operator=(const CaptureFiles&) = delete;

  /// `camera`: 0 for A, 1 for B.
  Result<> write(std::size_t camera, const Frame& frame);
  /// Closes both and gives them their names.
  Result<> finish();

 private:
  [[nodiscard]] std::filesystem::path part(std::size_t camera) const;
  std::filesystem::path folder_;
  std::array<std::string, 2> names_;
  std::array<std::optional<record::Writer>, 2> writers_{};
};

/// The folder of a run: locked while one program works in it, and after a kill at any moment as good as
/// before: a capture is in the index with both its files, or it is not there.
class RunFolder {
 public:
  /// Begins a run there or goes on with it. Errors: Busy, InvalidArgument where it is of another plan,
  /// cameras or options (says which), or a folder that something else is in.
  static Result<RunFolder> open(const std::filesystem::path& folder, const std::vector<Input>& inputs,
                                std::string_view plan_text);
  RunFolder(RunFolder&& other) noexcept;
  RunFolder& operator=(RunFolder&&) = delete;
  ~RunFolder();

  /// Captures that are there and whole: files and hashes were looked at.
  [[nodiscard]] const std::map<std::size_t, plan::CaptureRecord>& done() const { return done_; }
  /// Where the recordings of a capture go; locked ones lie apart.
  [[nodiscard]] CaptureFiles begin(const plan::PlannedCapture& planned) const;
  /// Puts a capture into the index, when its files are finished.
  Result<> finish(const plan::Plan& plan, const plan::PlannedCapture& planned, const plan::Taken& taken);

 private:
  RunFolder(std::filesystem::path folder, Manifest manifest)
      : folder_(std::move(folder)), manifest_(std::move(manifest)) {}
  Result<> readWhatIsThere();
  std::filesystem::path folder_;
  Manifest manifest_;
  std::map<std::size_t, plan::CaptureRecord> done_;
  int index_ = -1;
};

}  // namespace toftwin::cli
