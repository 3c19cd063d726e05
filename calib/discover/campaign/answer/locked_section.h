// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/compare/report.h"
#include "calib/discover/campaign/search/campaign_finding.h"
#include "calib/loop/page.h"

/// The page's part on locked captures.
namespace toftwin::discover {

std::string capitalised(std::string sentence);

/// Whether model.toml has a delay of the light that is no effect.
bool hasDelay(const CampaignFinding& finding);
/// It, and what of the locked captures' error it is; empty: nothing.
std::string delayInWords(const CampaignFinding& finding);

/// What is left of the range errors on the locked captures, step by step.
loop::Ladder ladderOf(const Judgement& judgement, bool has_delay);
/// The captures must have been judged.
compare::Section ladderSection(const CampaignFinding& finding);
compare::Section lockedSection(const CampaignFinding& finding);

}  // namespace toftwin::discover
