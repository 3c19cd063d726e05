// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/campaign/search/campaign_finding.h"

/// Locked captures at which the camera stood off its pose by far more than at any open one. They are judged with the
/// others, and what the judgement is without them is told beside it: nothing is dropped unsaid, and a bump is no error
/// of the model.
namespace toftwin::discover {

/// By what the found model leaves of both; set aside are those of which the file alone says it as well. Error: an
/// exposure that a model cannot have.
Result<std::vector<StoodOff>> lockedOff(const JudgedCampaign& locked, const JudgedCampaign& open,
                                        const JudgedModels& models);

/// The judgement without them. Error: likewise.
Result<Judgement> judgeWithout(const std::vector<StoodOff>& off, const JudgedCampaign& locked,
                               const JudgedCampaign& open, const JudgedModels& models);

/// What a reader of the report should know of them.
std::string noteOf(const std::vector<StoodOff>& off, const Judgement& with, const Judgement* without);

}  // namespace toftwin::discover
