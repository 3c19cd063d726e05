// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/compare/json.h"
#include "calib/suit/suit.h"

namespace toftwin::suit {

/// All numbers of a suit, in the units that are shown.
compare::Json toJson(const Suit& suit);

}  // namespace toftwin::suit
