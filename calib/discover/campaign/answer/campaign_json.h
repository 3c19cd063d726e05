// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/compare/json.h"
#include "calib/discover/campaign/answer/discover_campaign.h"

/// What a search found, as report.json has it, and the words that the page has in common with it.
namespace toftwin::discover {

compare::Json jsonOf(const CampaignJob& job, const CampaignFinding& finding);

std::string stageInWords(const Effect& effect);
/// Of all its forms; where there are several of one kind, in their order.
std::vector<FittedNumber> numbersIn(const FoundEffect& one);
std::string adviceOf(const NextCapture& next);
/// Date and time, as a report states them.
std::string today();

}  // namespace toftwin::discover
