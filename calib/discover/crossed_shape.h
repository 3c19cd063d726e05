// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "calib/discover/shape_choice.h"

/// An effect along one covariate whose strength goes with another: by temperature and the square of the radius.
namespace toftwin::discover {

/// Products of the chosen explanation, of one covariate, with each other one: its place among `all`, to which they are
/// appended, if one says more than chance and than the chosen one's shape may be wrong by. Nothing: none does.
std::optional<std::size_t> crossedShape(const Context& context, std::vector<Explanation>& all, std::size_t chosen);

}  // namespace toftwin::discover
