// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/temporal_filter.h"

#include "sim/effects/neighbours.h"

namespace toftwin::sim {

RangeImage TemporalFilter::apply(RangeImage image, const Conditions& now, const Random&) const {
  const RangeImage* before = now.before.range;
  if (new_share == 1.0 || !before || before->range_m.width() != image.range_m.width() ||
      before->range_m.height() != image.range_m.height()) {
    return image;
  }
  const auto alpha = static_cast<float>(new_share), most = static_cast<float>(jump.in(metre));
  replaceRanges(image.range_m, [&](int x, int y) {
    const float fresh = image.range_m(x, y), old = before->range_m(x, y);
    // An old range that is NaN is not within the jump either.
    return std::abs(fresh - old) <= most ? old + alpha * (fresh - old) : fresh;
  });
  return image;
}

}  // namespace toftwin::sim
