// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <toftwin/result.h>

#include "calib/compare/progress.h"
#include "calib/compare/report.h"

namespace toftwin::plan {

/// What a run is judged by.
struct CompareRunJob {
  std::filesystem::path run;
  std::filesystem::path output;
  bool locked = false;  ///< judge on the locked captures, which can be done once
  std::string note;
  std::filesystem::path log{};  ///< a RunLog that the result is put into; empty: none
  std::function<bool()> interrupted{};
};

/// Compares the captures of a run and leaves index.html, report.json and report.md in the output folder;
/// gives what to say of it. A run that is not through is compared as far as it is, and the report says so.
Result<compare::WrittenReport> compareRun(const CompareRunJob& job, compare::Progress& progress);

}  // namespace toftwin::plan
