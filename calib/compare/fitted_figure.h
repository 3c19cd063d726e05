// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "calib/compare/named_traits.h"
#include "calib/compare/residual.h"

namespace toftwin::compare {

/// What stands beside the axes of a figure.
struct FigureWords {
  std::string title{}, caption{}, x_label{}, y_label{};
  bool log_x = false, log_y = false;  ///< log_y: below are ratios
  bool compact = true;
  std::string rest_unit = "mm";  ///< of the rows, for what is left; empty: not said
};

/// The rows of a characteristic, of A and B beside each other, with the curves that were fitted to them, and
/// below B − A (B / A) of rows of the same condition, or of B's rows and A's curve. Nothing where there are
/// fewer than three rows.
std::optional<Figure> fittedFigure(const NamedTraits& traits, const std::string& what,
                                   const FigureWords& words);

}  // namespace toftwin::compare
