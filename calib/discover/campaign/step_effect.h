// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/discover/campaign/discover_campaign.h"

namespace toftwin::discover {

/// Whole steps of the converter, as single frames show them (sample_steps.h): added to what was found, or as
/// another number of the declared effect. Only of cameras with one frequency, whose amplitude is that of one
/// phasor.
void addSteps(const CampaignJob& job, const sim::SensorModel& model,
              const std::vector<MeasuredCapture>& captures, CampaignFinding& finding);

}  // namespace toftwin::discover
