// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "calib/discover/shape_choice.h"

/// What light does (a delay, a gain) along the covariates of an error of the range.
namespace toftwin::discover {

/// A form of the range with the same of the light added, one for each that light does along all of its covariates:
/// what moves the range and dims the light is one effect, of which the range is half.
std::vector<FittedForm> withItsLight(const Context& context, const FittedForm& fitted);

/// Along one covariate a curve of the range competes with what light does along it. Along two, too many pairs to try
/// each likewise, what was chosen is compared with the same of the light: its place among `all`, to which these are
/// appended, if one says more by more than chance. Nothing: none does.
std::optional<std::size_t> lightShape(const Context& context, std::vector<Explanation>& all, std::size_t chosen);

/// What moves the range and dims the light along one covariate moves poses, which the light ties down, and looks, as
/// far as the range says, like a function of two. The place of what is told along that one, unless the chosen pair says
/// more than a curve along it with the same of the light, by more than the best of all explanations does by chance.
/// Nothing: it does, or neither half predicts by itself.
std::optional<std::size_t> alongOne(const Context& context, const std::vector<Explanation>& all, std::size_t chosen);

}  // namespace toftwin::discover
