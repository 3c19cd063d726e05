// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/surface.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace toftwin::intrinsics {
namespace {

/// A place along an edge of that length, as −1 … 1.
double scaled(Length at, Length length) { return 2.0 * (at / length) - 1.0; }

}  // namespace

Surface::Surface(const Target& target, int degree) {
  const auto corners = static_cast<Eigen::Index>(target.corners());
  grid_.resize(corners, 2);
  std::vector<Eigen::VectorXd> terms;
  const std::size_t last = target.corners() - 1;
  for (std::size_t i = 0; i < target.corners(); ++i) {
    grid_.row(static_cast<Eigen::Index>(i)) << target.x(i).in(millimetre), target.y(i).in(millimetre);
  }
  for (int sum = 2; sum <= degree; ++sum) {
    for (int in_x = sum; in_x >= 0; --in_x) {
      const int in_y = sum - in_x;
      if (in_x >= target.columns || in_y >= target.rows) continue;  // so few corners cannot tell it
      degree_ = sum;
      Eigen::VectorXd term(corners);
      for (std::size_t i = 0; i < target.corners(); ++i) {
        term[static_cast<Eigen::Index>(i)] =
            std::legendre(static_cast<unsigned>(in_x), scaled(target.x(i), target.x(last))) *
            std::legendre(static_cast<unsigned>(in_y), scaled(target.y(i), target.y(last)));
      }
      terms.push_back(std::move(term));
    }
  }
  basis_.resize(corners, static_cast<Eigen::Index>(terms.size()));
  for (std::size_t k = 0; k < terms.size(); ++k) basis_.col(static_cast<Eigen::Index>(k)) = terms[k];
  bend_ = Eigen::VectorXd::Zero(basis_.cols());
}

double Surface::depth_mm() const {
  if (terms() == 0) return 0.0;
  const Eigen::VectorXd heights = basis_ * bend_;
  return heights.maxCoeff() - heights.minCoeff();
}

}  // namespace toftwin::intrinsics
