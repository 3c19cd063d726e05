// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/progress.h"
#include "calib/compare/report.h"
#include "tools/validate/judged.h"

/// The simulator against measurements that a dataset file describes (docs/validate.md). Nothing is fitted to the rows that
/// it is judged on, unless the report says so.
namespace toftwin::validate {

/// All judgements of a dataset, in its order. The steps are added to the progress, if there is one.
Result<std::vector<Judged>> judgeAll(const Dataset& set, double effort, compare::Progress* progress);

/// The report of all judgements. `note`: for its foot, such as a commit.
compare::Report reportOf(const Dataset& set, std::vector<Judged> all, const std::string& note);

/// Both, and leaves index.html, report.json and report.md in the folder; gives what to say of it.
Result<compare::WrittenReport> validateAndReport(const Dataset& set, double effort, const std::filesystem::path& output,
                                                 const std::string& note, compare::Progress& progress);

}  // namespace toftwin::validate
