// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/report.h"
#include "calib/loop/discovery.h"

namespace toftwin::loop {

/// The ladder first, then the error over the reference, then each effect with its curve over its own dots.
compare::Report reportOf(const Discovery& discovery);
/// All numbers, for programs: report.json.
compare::Json dataOf(const Discovery& discovery);
/// A ladder as a page shows it: first of all sections.
struct ShownLadder {
  std::string verdict{}, about{};
  std::string unit{};
  std::vector<Step> steps{};   ///< on what nothing was fitted to, where there is such
  std::vector<Step> fitted{};  ///< on what it was fitted to; may be empty
  double noise = 0.0;
  std::string noise_name{};
};
compare::Section ladderSection(const ShownLadder& shown);
compare::Json ladderJson(const Ladder& ladder);
/// The ladder as a few lines for a terminal.
std::string ladderText(const Ladder& ladder, const std::string& unit);

/// Writes index.html, report.json, report.md and, unless it is worse than none, model.toml; gives the page's path.
Result<std::filesystem::path> write(const Discovery& discovery, const std::filesystem::path& folder);

}  // namespace toftwin::loop
