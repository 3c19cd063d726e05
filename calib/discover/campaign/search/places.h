// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <vector>

#include "calib/discover/campaign/rows/rows.h"
#include "calib/discover/marginal.h"

/// Where cameras stood, by what is left of their captures (residualEvidence; its columns are commonGroups).
namespace toftwin::discover {

/// How a camera stood off a capture's pose, in prior deviations; and of each way, the share of such a move that
/// would be seen beside the other ways, the light and the prior: 0 where the captures do not tell it.
struct Place {
  Stood off{}, seen{};
};

/// What each capture counts, for what is common to all: 1; less for those that err more than twice as much as
/// the middle one, by χ² per row, as if their noise were so much larger. A camera that was bumped far off must not
/// move the offset of all.
std::vector<double> temperOf(const Evidence& evidence, std::span<const double> scales);
Evidence weighed(Evidence evidence, const std::vector<double>& weights);

/// Offset and gain, as all captures of the evidence say. `scales`: of poses and light.
Eigen::VectorXd commonOf(const Evidence& evidence, std::span<const double> scales);
/// For each capture of the evidence, offset and gain being these.
std::vector<Place> placesAt(const Evidence& evidence, const Eigen::VectorXd& common);
/// For each capture of the evidence, offset and gain being what all of them say.
std::vector<Place> placesBy(const Evidence& evidence, std::span<const double> scales);

}  // namespace toftwin::discover
