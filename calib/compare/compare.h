// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <toftwin/result.h>

#include "calib/compare/capture.h"
#include "calib/compare/progress.h"
#include "calib/compare/report.h"

namespace toftwin::compare {

/// The whole comparison of two cameras.
struct CompareJob {
  Feed* a = nullptr;
  Feed* b = nullptr;
  CaptureOptions capture;
  std::filesystem::path output;  ///< folder of the report
  std::string note;              ///< for the report's foot: a commit, a place
};

/// Runs it and leaves index.html, report.json, report.md and log.jsonl in the output folder; gives
/// what to say of it.
Result<WrittenReport> compareAndReport(const CompareJob& job, Progress& progress);

}  // namespace toftwin::compare
