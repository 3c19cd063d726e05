// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

/// fitInOrder() of rows of sessions that are known, each with an offset of its own beside the model, whose first parameter
/// is its constant: that is the mean of the sessions', and as uncertain as they differ, with Student's quantile of one less
/// than them. `session` has each row's. Of one, or empty, it is fitInOrder(), and in doubt where the order in which rows
/// stand, a step in it, or two heaps of what is left say that they may be of two.
std::optional<Fit> fitBesideSessions(const Model& model, Column y, std::vector<double> start, Column x, Column session);

}  // namespace toftwin::compare
