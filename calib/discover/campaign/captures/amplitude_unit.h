// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/campaign/captures/campaign.h"

namespace toftwin::discover {

/// The amplitude's unit against the camera file's: what ln amplitude is larger by than declared, in percent, in the
/// middle capture's middle pixel. Gains are fitted beside it: numbers of single precision say a difference of 1 to a
/// millionth only, and in a thousand pixels that is no more nothing. 0 where no capture has an amplitude.
Result<double> unitOf(const Declared& declared, const std::vector<MeasuredCapture>& captures,
                      const std::vector<std::shared_ptr<const TracedCapture>>& traced);
void takeUnitOff(double unit_percent, std::vector<MeasuredCapture>& captures);

}  // namespace toftwin::discover
