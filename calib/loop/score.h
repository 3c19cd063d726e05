// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "calib/loop/grammar.h"
#include "calib/loop/projection.h"

namespace toftwin::loop {

/// How far one family over some covariates stands out of what is left.
struct Score {
  const Family* family = nullptr;
  std::vector<std::string> covariates{};
  Inner inner{};           ///< of the grid, where it stands out most
  double deviate = 0.0;    ///< above its own mean without an effect, in its own standard deviations
};

/// All families that screen, the farthest first, and the chance to see the first without any effect.
struct Scores {
  std::vector<Score> all{};
  double p = 1.0;
};
/// How many covariates the families have that are looked at.
enum class Order { Alone, Together };

/// Efficient scores of the residual against everything the grammar can say. The distribution without an effect is that of the
/// residual with the signs of whole blocks drawn anew: it knows nothing of the noise but that a block errs up as often as down.
/// Each family is normalised by its own draws, so that one with many alternatives pays for them; p is the rank of the largest.
Scores screen(const Evidence& evidence, const Eigen::VectorXd& residual, const Eigen::VectorXd& weight,
              const Eigen::MatrixXd& model, Order order, std::span<const Hint> hints, int draws, std::uint64_t seed);

}  // namespace toftwin::loop
