// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "calib/intrinsics/target.h"

namespace toftwin::intrinsics {

/// Where a target's corners lie in its own frame, mm: on a grid, and above it where the board is bent.
///   z = Σ bend_k P_k(x, y)
/// P_k are products of Legendre polynomials of x and y, each scaled to −1 … 1 over the corners, of degree 2 to
/// `degree` in sum: a shift or a turn of the board is none of them, because that is its pose.
class Surface {
 public:
  Surface() = default;
  /// Flat for degree 0. The degree is lowered to what the corners can tell.
  Surface(const Target& target, int degree);

  [[nodiscard]] Eigen::Index terms() const { return bend_.size(); }
  [[nodiscard]] int degree() const { return degree_; }
  [[nodiscard]] Eigen::Vector3d at(std::size_t corner) const {
    const auto i = static_cast<Eigen::Index>(corner);
    return {grid_(i, 0), grid_(i, 1), terms() > 0 ? basis_.row(i).dot(bend_) : 0.0};
  }
  /// Of a corner's z, by the bend's terms.
  [[nodiscard]] auto slope(std::size_t corner) const { return basis_.row(static_cast<Eigen::Index>(corner)); }
  [[nodiscard]] const Eigen::VectorXd& bend() const { return bend_; }
  void bendBy(const Eigen::VectorXd& step) { bend_ += step; }
  /// Highest minus lowest corner.
  [[nodiscard]] double depth_mm() const;

 private:
  int degree_ = 0;
  Eigen::MatrixXd grid_;   ///< x and y of each corner
  Eigen::MatrixXd basis_;  ///< P_k at each corner
  Eigen::VectorXd bend_;   ///< mm
};

}  // namespace toftwin::intrinsics
