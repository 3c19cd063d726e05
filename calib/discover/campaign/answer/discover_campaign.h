// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/progress.h"
#include "calib/discover/campaign/search/campaign_finding.h"

namespace toftwin::discover {

/// Searches the open captures, fits what was found through the simulator, and judges the model
/// before and after on the locked captures, which it opens for that, once. Writes nothing but the
/// note that they were opened.
Result<CampaignFinding> searchCampaign(const CampaignJob& job, compare::Progress& progress);

/// What is told where a search was asked for; the page says all.
struct CampaignAnswer {
  std::filesystem::path page{};
  std::string verdict{};
  std::string ladder{};  ///< lines for a terminal; empty: nothing was judged
  std::vector<std::string> notes{};
};
/// The same, and leaves index.html, report.json, report.md and model.toml in the output folder.
Result<CampaignAnswer> discoverCampaign(const CampaignJob& job, compare::Progress& progress);

/// Groups of the first test by how much more they explain than noise would, the most first.
struct SeenGroup {
  std::string name{};
  double z = 0.0, statistic = 0.0;
  int rank = 0;
};
std::vector<SeenGroup> seenFirst(const CampaignFinding& finding, std::size_t most = 10);

/// In one sentence.
std::string verdictOf(const CampaignFinding& finding);
Result<std::filesystem::path> writeReport(const CampaignJob& job, const CampaignFinding& finding);

}  // namespace toftwin::discover
