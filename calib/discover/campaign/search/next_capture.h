// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/campaign/rows/rows.h"
#include "calib/discover/campaign/search/campaign_finding.h"

namespace toftwin::discover {

/// Of the campaign's captures, as they were taken or in another room or after another start of the camera, the
/// one in which two models, lists of effects without noise, differ most. The offset and gain by which they
/// differ over the campaign are taken out, poses and light are integrated out. Nothing where neither can be
/// simulated there, and where they differ by less than 9 in χ².
std::optional<NextCapture> nextCapture(const JudgedCampaign& judged, const std::vector<sim::AnyEffect>& one,
                                       const std::vector<sim::AnyEffect>& other);

/// The same for each effect that was found and the nearest of what it may be instead, where the simulator has
/// forms for both.
void addNextCaptures(const JudgedCampaign& judged, const CampaignRows& rows,
                     std::vector<FoundEffect>& effects);

}  // namespace toftwin::discover
