// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "calib/discover/campaign/discover_campaign.h"

/// How right a search of a campaign was, as a line of comma-separated values, and such lines as a table.
namespace toftwin::discover::bench {

/// What was hidden in a campaign, and how it was searched.
struct Case {
  std::string hidden{};  ///< an effect of the catalogue, or "nothing: …"
  double wanted = 0.0, lambda = 0.0;
  std::uint64_t seed = 1;
  bool is_absent = false;  ///< the catalogue did not have the effect
};

struct Score {
  Case of{};
  double p = 1.0;
  bool is_detected = false;  ///< p ≤ 1 %
  bool is_right = false;     ///< named, alone or among what these data cannot tell apart
  bool is_alone = false;     ///< named first
  bool is_blamed = false;    ///< another effect of the catalogue, without saying that it may be none of it
  bool has_covariates = false;  ///< an undeclared effect that goes with what the hidden one goes with
  bool has_stage = false;
  int spurious = 0;  ///< effects too many, rests of others among them
  int rests = 0;     ///< what is called the rest of another effect
  double removed = 0.0, before_mm = 0.0, after_mm = 0.0, seconds = 0.0;
  std::string found{};
};

std::string inWords(const CampaignFinding& finding);
Score scoreOf(const Case& of, const sim::AnyEffect* hidden, const CampaignFinding& finding);

std::string header();
std::string lineOf(const Score& score);
/// A row for each λ, with and without the effect in the catalogue; then each miss. Lines that are no scores are
/// left out and counted.
std::string tableOf(const std::vector<std::filesystem::path>& files);

}  // namespace toftwin::discover::bench
