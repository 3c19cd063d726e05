// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include "calib/loop/discovery.h"

namespace toftwin::loop {

/// Whether an effect is where series begin in the file, or a gain of the measured value.
bool isSeries(const Effect& effect);
bool isGain(const Discovery& discovery, const Effect& effect);

/// Gives the discovery its model, the ladders, and whether the model is to be written: the file as it would be written, read again
/// and applied to rows. What is judged is what a user has.
Result<> writeModel(Discovery& discovery);

}  // namespace toftwin::loop
