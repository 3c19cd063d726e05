// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/campaign/search/campaign_finding.h"

/// What would refuse a search at its end, or make its answer worthless, is known before anything is traced.
namespace toftwin::discover {

/// Error where no report could be written into `folder`. Tries, and leaves nothing behind.
Result<> checkCanWrite(const std::filesystem::path& folder);
/// Error where the frames state a modulation frequency that the model does not have, to a thousandth.
Result<> checkFrequencies(const Campaign& campaign, const sim::SensorModel& model);
/// Error where the run's locked captures were opened before, for the side that is searched, or cannot be
/// opened at the end.
Result<> checkStillClosed(const CampaignJob& job);
/// Error where a locked recording is not the one that was captured.
Result<> checkLockedFiles(const CampaignJob& job, const Campaign& campaign);
/// Notes how many captures of a simulated camera have noise that is drawn like that of earlier ones: a finder takes
/// what is alike in captures for the camera's.
void noteNoiseDrawnAlike(const std::vector<MeasuredCapture>& captures, std::vector<std::string>& notes);
/// Opens them: leaves the note of it.
Result<> openLockedOf(const CampaignJob& job, const Campaign& campaign);

}  // namespace toftwin::discover
