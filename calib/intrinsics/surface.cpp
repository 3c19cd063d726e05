// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/surface.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace toftwin::intrinsics {
namespace {

/// Number `index` of `count` corners, as −1 … 1.
double scaled(std::size_t index, int count) {
  return 2.0 * static_cast<double>(index) / static_cast<double>(count - 1) - 1.0;
}

}  // namespace

Surface::Surface(const Target& target, int degree) {
  const auto corners = static_cast<Eigen::Index>(target.corners());
  grid_.resize(corners, 2);
  std::vector<Eigen::VectorXd> terms;
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
        const auto columns = static_cast<std::size_t>(target.columns);
        term[static_cast<Eigen::Index>(i)] =
            std::legendre(static_cast<unsigned>(in_x), scaled(i % columns, target.columns)) *
            std::legendre(static_cast<unsigned>(in_y), scaled(i / columns, target.rows));
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
