// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "calib/discover/cross_validation.h"

/// What the frames of a capture say one after the other, without what drifts.
namespace toftwin::discover {

/// The median of the sizes, in standard deviations of Gaussian noise: a frame or two that are off do not make it large.
double spreadOf(std::vector<double> numbers);

/// Without their mean and their straight drift, the median of the slopes between all pairs (P. K. Sen, J. Am. Stat.
/// Assoc. 63 (1968) 1379): a frame that is off does not tilt it. Of more than 64, those half of them apart.
std::vector<double> withoutDrift(std::vector<double> numbers);

/// The mean of values with their weights, with its standard error as they scatter; two values or more.
Difference weightedMean(const std::vector<std::pair<double, double>>& each);

}  // namespace toftwin::discover
