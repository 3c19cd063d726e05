// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <toftwin/image.h>
#include <toftwin/result.h>

#include "calib/discover/campaign/captures/campaign.h"

namespace toftwin::discover {

/// `variance`, as each pixel's few frames say it, as that of pixels which are alike in `like`: means over bins of as
/// many pixels each, and between the bins' middles what lies between them. NaN where either is.
Image<float> pooledOver(const Image<float>& variance, const Image<float>& like);

/// Pools the captures' noise over pixels that are as bright as the declared camera says, times what it errs by about
/// them. How bright a pixel was measured must not choose its weight: noise that makes it brighter would make it count
/// more, and of noise σ in ln A, with variances that go with 1/A², the mean would be 2 σ² too bright.
/// Error: an exposure that the model cannot have.
Result<> poolNoise(const Declared& declared, const std::vector<std::shared_ptr<const TracedCapture>>& traced,
                   std::vector<MeasuredCapture>& captures);

}  // namespace toftwin::discover
