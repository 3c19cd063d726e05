// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include <toftwin/result.h>

#include "calib/compare/capture.h"
#include "calib/compare/progress.h"
#include "calib/compare/report.h"

namespace toftwin::compare {

/// The whole comparison: two cameras of daemons, the simulator against real measurements, or both.
struct CompareJob {
  Feed* a = nullptr;  ///< null: no live comparison
  Feed* b = nullptr;
  CaptureOptions capture;
  /// Folder of real measurements, as for findThesisData; nothing: don't look for it.
  std::optional<std::filesystem::path> data;
  double effort = 1.0;           ///< factor on the paths traced for the real measurements
  std::filesystem::path output;  ///< folder of the report
  std::string note;              ///< for the report's foot: a commit, a place
};

/// Runs it and leaves index.html, report.json, report.md and log.jsonl in the output folder; gives
/// what to say of it. That the measurements are not there is no error, but said in the report.
Result<WrittenReport> compareAndReport(const CompareJob& job, Progress& progress);

}  // namespace toftwin::compare
