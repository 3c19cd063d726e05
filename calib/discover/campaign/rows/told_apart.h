// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "calib/discover/campaign/captures/effect_numbers.h"
#include "calib/discover/marginal.h"

/// Which of the numbers that are fitted the data tell.
namespace toftwin::discover {

/// Normal equations of the free numbers, everything else eliminated.
struct NormalEquations {
  Fit others;
  Eigen::MatrixXd gram;
  Eigen::VectorXd moment;
  Eigen::VectorXd own;             ///< squares of the free numbers' columns
  Eigen::MatrixXd others_by_free;  ///< by how much the others' coefficients fall with the free numbers'
  double deviance = 0.0, freedom = 1.0;
};
/// The last `free` columns are those of the free numbers.
NormalEquations normalEquationsOf(const Marginal& marginal, std::size_t free);

/// A number that is not told from others, and by how much those must change where it changes by 1: of a share of a charge
/// and a loss by it, the product is told.
struct Untold {
  FreeNumber number;
  Eigen::VectorXd change{};  ///< by free number
};

/// Those that are told by offset, gain and the numbers before them are not kept: of a reference temperature, an offset
/// says all. Nor those that `stays` says, which are as they are whatever tells them.
struct ToldApart {
  std::vector<FreeNumber> kept{};
  std::vector<Untold> untold{};
};
ToldApart toldApart(const std::vector<FreeNumber>& free, const NormalEquations& at,
                    const std::function<bool(const FreeNumber&)>& stays);

}  // namespace toftwin::discover
