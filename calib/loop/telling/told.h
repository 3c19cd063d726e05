// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "calib/loop/explain.h"

namespace toftwin::loop {

/// An effect as it can be told. Where covariates change together, as the columns along a corner do, two effects may be large, of opposite
/// sign, and small as a sum: then neither curve is known, only their sum is. Of such effects each is told as what the sum goes with beside
/// those before it (functional analysis of variance over the rows that there are [Hoeffding 1948; Stone 1994]):
///     T = Σ f,   g₁ = E(T | x₁),  g₂ = E(T − g₁ | x₂) …,  and what is left is theirs together.
/// An effect that no other cancels is told as it is.
struct Told {
  Eigen::VectorXd curve{};             ///< at each row, about its mean
  std::vector<std::size_t> with{};     ///< the effects that it shares its curve with, itself among them, in the order they are told; empty: none
  Eigen::VectorXd sum{};               ///< of all these, about its mean; empty where `with` is
  double joint = 0.0;                  ///< standard deviation of what only all of these together explain
};

/// Of each of the effects, in their order.
std::vector<Told> toldOf(const Evidence& evidence, const std::vector<Effect>& effects);

}  // namespace toftwin::loop
