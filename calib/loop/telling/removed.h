// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/loop/explain.h"
#include "calib/loop/ladder.h"

namespace toftwin::loop {

/// What a model takes off the errors that are there beside a constant and the noise, as a share of their squares: 1 if all of them, less than
/// 0 if it adds some. With the interval that holds the true share of 95 in 100 tables.
struct Removed {
  double share = 0.0, low = 0.0, high = 0.0;
  bool is_known = false;  ///< false: beside the noise nothing is there that a share could be of
};

/// Of locked rows: e the error less a constant, m the model's error less a constant and N² the mean square of the noise,
///     share = Σ (e² − (e − m)²) / Σ (e² − N²),
/// whose numerator no noise biases. N² is what a model that is flexible along each column leaves of the open rows, for its freedom. The
/// interval is the ratio's by its influence function over blocks of `length` rows, with the error of N² [Cochran 1977, chapter 6].
Removed removedOf(const Evidence& open, const std::vector<Effect>& effects, const TableEvidence& locked, const Model& model, Eigen::Index length);

}  // namespace toftwin::loop
