// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "calib/discover/campaign/answer/discover_campaign.h"
#include "tests/bench/campaign_truth.h"

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
  bool has_stage = false;       ///< the stage that is told first, of the effect that is the hidden one
  bool may_have_stage = false;  ///< that, or one that these data do not tell from it
  bool is_stage_alone = false;  ///< it has no name, and one stage is told
  int spurious = 0;  ///< effects too many, rests of others among them
  int rests = 0;     ///< what is called the rest of another effect
  /// Free of noise, on the locked captures: χ² of what the light's delay leaves of the hidden effect, and the
  /// share of it that the model found removes; NaN where nothing shows there, or nothing was hidden.
  double explainable = 0.0, removed = 0.0;
  /// The share that the report states, from noisy captures, and its 95 % interval.
  double stated = 0.0, stated_low = 0.0, stated_high = 0.0;
  int numbers = 0,
      numbers_in = 0;  ///< fitted numbers of the hidden effect, and those whose 95 % interval has the truth
  double before_mm = 0.0, after_mm = 0.0, seconds = 0.0;
  std::string found{};
};

std::string inWords(const CampaignFinding& finding);
/// `hidden`: as it was, with its numbers.
Score scoreOf(const Case& of, const sim::AnyEffect& hidden, const Removed& removed,
              const CampaignFinding& finding);
/// Nothing was hidden.
Score scoreOf(const Case& of, const CampaignFinding& finding);

std::string header();
std::string lineOf(const Score& score);
/// A row for each λ, with and without the effect in the catalogue; then each miss. Lines that are no scores are
/// left out and counted.
std::string tableOf(const std::vector<std::filesystem::path>& files);

}  // namespace toftwin::discover::bench
