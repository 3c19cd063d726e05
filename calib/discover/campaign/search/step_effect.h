// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "calib/discover/campaign/search/campaign_finding.h"

namespace toftwin::discover {

/// Whole steps of the converter, as single frames show them (sample_steps.h), in the unit of the amplitude.
/// Only of cameras with one frequency, whose amplitude is that of one phasor.
std::optional<SampleSteps> stepsIn(const sim::SensorModel& model,
                                   const std::vector<MeasuredCapture>& captures);

/// Those steps in the camera file's electrons, added to what was found, or as another number of the declared
/// effect; in place of what means over frames said of it. `finding` has its zero already: an amplitude of
/// another unit than electrons is a gain, and its steps are as many of that unit as the file's are electrons.
void addSteps(const CampaignJob& job, const sim::SensorModel& model, const SampleSteps& steps,
              CampaignFinding& finding);

}  // namespace toftwin::discover
