// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/discover/campaign/search/campaign_finding.h"

namespace toftwin::discover {

/// The camera file (`text`; `declared` is its model) with what was found, and where zero lies.
std::string modelText(const std::string& text, const Declared& declared, const CampaignFinding& finding);

}  // namespace toftwin::discover
