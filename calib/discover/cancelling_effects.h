// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/discover/found_effects.h"

namespace toftwin::discover {

/// Where two covariates are nearly one, as the range and the angle along a wall, curves along both may nearly cancel: each
/// is large, and what they say is what is between them. Once the effects' shapes are known, such two become one: a single
/// curve, along either, where the sum says no more of other captures (two standard errors); else their sum.
void joinCancelling(Found& found);

}  // namespace toftwin::discover
