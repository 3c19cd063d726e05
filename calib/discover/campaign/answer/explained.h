// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include "calib/discover/campaign/answer/judgement.h"
#include "calib/discover/campaign/rows/refit.h"

namespace toftwin::discover {

/// χ² per row of the models on the captures that they are judged on, and the shares of what can be explained
/// that they remove. `open`: the captures that the models were found on; they say how large noise is, and how
/// fine one can look before noise hides what was found. Error: an exposure that a model cannot have.
Result<> addExplained(const JudgedCampaign& judged, const JudgedCampaign& open, const JudgedModels& models,
                      Judgement& judgement);

}  // namespace toftwin::discover
