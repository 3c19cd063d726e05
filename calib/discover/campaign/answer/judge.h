// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include "calib/discover/campaign/answer/judgement.h"
#include "calib/discover/campaign/rows/refit.h"

namespace toftwin::discover {

/// `open`: the captures that the models were found on. Error: an exposure that a model cannot have.
Result<Judgement> judge(const JudgedCampaign& judged, const JudgedCampaign& open, const JudgedModels& models);

}  // namespace toftwin::discover
