// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "calib/intrinsics/bundle.h"

namespace toftwin::intrinsics {

/// How well the lens is known, for its parametersOf(model) parameters.
struct LensUncertainty {
  double sigma_px = 0.0;             ///< standard deviation of a corner's coordinate
  Eigen::MatrixXd covariance{};      ///< that is used: from_corners times clustering, or from_views if that is much
  Eigen::VectorXd from_corners{};    ///< standard errors if all corners err independently: σ² S⁻¹
  Eigen::VectorXd from_views{};      ///< standard errors from how much whole views disagree
  Eigen::VectorXd from_resampling{}; ///< the same by bootstrap, as a check: views drawn with replacement
  Eigen::VectorXd half_width{};      ///< of the 95 % intervals
  double clustering = 1.0;           ///< root mean square of from_views / from_corners
};

/// Views are resampled `resamples` times, by one Gauss-Newton step each (docs/calibrate.md).
LensUncertainty uncertaintyOf(const std::vector<Observed>& views,
                              const Bundle& bundle, int resamples = 1000, std::uint64_t seed = 1);

/// Standard error of where a ray of the lens meets the image, root mean square of u and v, pixels. Taken out is
/// what a turn of the whole camera does: that belongs to its pose, and no calibration knows it.
class MappingError {
 public:
  MappingError(const Bundle& bundle, const LensUncertainty& uncertainty, int width, int height);
  [[nodiscard]] double at(double u, double v) const;

 private:
  LensParameters lens_;
  Eigen::Index count_;
  Eigen::MatrixXd root_;        ///< of the covariance
  Eigen::MatrixXd turn_;        ///< the turn that belongs to each parameter
};

}  // namespace toftwin::intrinsics
