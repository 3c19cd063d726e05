// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

namespace toftwin::compare {

struct PoseComparison;

/// Points that both cameras see at a pose, in A's frame of reference. A page shows them so that one can turn
/// them; without script, or printed, as a still.
struct PointCloud {
  std::string caption{};
  std::vector<std::array<float, 3>> a{}, b{};  ///< metres, x right, y down, z ahead
};

/// Of the compared pixels, thinned evenly to some thousands; B's along A's rays.
PointCloud pointCloudOf(const std::string& name, const PoseComparison& comparison);

std::string html(const PointCloud& cloud);

/// What turns the clouds of a page: inline, needs no network.
std::string cloudScript();

}  // namespace toftwin::compare
