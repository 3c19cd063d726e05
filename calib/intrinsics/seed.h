// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "calib/intrinsics/bundle.h"

namespace toftwin::intrinsics {

struct ImageSize {
  int width = 0, height = 0;
  bool operator==(const ImageSize&) const = default;
};

/// A lens and poses from which least squares reach the bottom: several focal lengths are tried, with each
/// of the two poses that a flat target may have. Nothing if no view has a pose.
std::optional<Bundle> seedBundle(const Surface& surface, const std::vector<Observed>& views, ImageSize size);

/// The pose of one view for a lens that is known: the better of the two that a flat target may have.
std::optional<BoardPose> poseOf(const Surface& surface, const Observed& view, const LensParameters& lens);

}  // namespace toftwin::intrinsics
