// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <toftwin/frame.h>

#include "calib/discover/campaign/captures/campaign.h"

namespace toftwin::discover {

/// What the light of a simulated camera errs by, as its frames say (PlaneKind::LightSigma). Frames that see the same
/// light err alike, so that their mean is no better and their differences do not tell.
class LightNoise {
 public:
  void add(const Frame& frame);
  /// Into the capture's light variances. Nothing where frames do not say it, or where each has light of its own: then
  /// their noise has it already.
  void putInto(MeasuredCapture& capture) const;

 private:
  Plane sigma_;              ///< of the first frame
  double most_per_m_ = 0.0;  ///< 4πf/c of the highest frequency: phase for each metre of range
  std::size_t frames_ = 0;
  bool is_same_ = true;  ///< in all frames
  bool is_hidden_ = false;
};

/// Captures from one place see the same light, too. n of them, each of n times its variance, say together no more
/// than one. Afterwards the variances are as rows count them: means over neighbours, without edges.
void shareLightNoise(const std::vector<std::shared_ptr<const TracedCapture>>& traced,
                     std::vector<MeasuredCapture>& captures);

/// The captures with the noise of their light as each has it by itself: shareLightNoise counts what several have in
/// common several times, so that their sum is right, and then none of them errs as much as it states.
std::vector<MeasuredCapture> eachByItself(std::vector<MeasuredCapture> captures);

}  // namespace toftwin::discover
