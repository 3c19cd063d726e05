// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/loop/grammar.h"
#include "calib/loop/held_out.h"
#include "calib/loop/left.h"

namespace toftwin::loop {

/// A shape that was fitted beside a model, and how it does on rows that it was not fitted to.
struct FittedShape {
  Shape shape{};
  HeldOut held{};
  HeldOut::Gain gain{};  ///< over the model without it
  double worth = 0.0;    ///< the gain less the price of what was looked through
};

/// Every family that applies to these covariates, at the inner numbers that leave least; of one covariate sums of some, too.
/// `known`: a shape over the same covariates that is to be among them.
/// `hints`: shapes that are in the model already.
std::vector<FittedShape> fitShapes(const Beside& beside, const std::vector<std::string>& covariates, std::span<const Hint> hints = {},
                                   const Shape* known = nullptr);

/// The one with the fewest numbers of those that are not worse than the best by more than one standard error; nothing if none is
/// worth its price. `shapes` must not be empty.
const FittedShape* simplest(const std::vector<FittedShape>& shapes);

/// The best step over a covariate, and beside how much of the rows' scatter; nothing if it has too few values.
std::optional<Shape> bestStep(const Beside& beside, const std::string& covariate);

/// The shape with its inner numbers fitted anew.
Shape refined(const Beside& beside, const Shape& start);

}  // namespace toftwin::loop
