// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "calib/intrinsics/target.h"

namespace toftwin::intrinsics {

/// How many terms of distortion a lens is given; each holds all before it. The last cannot be stored in a
/// camera file (CameraInfo has five terms) and serves to tell that five are too few.
enum class LensModel { Pinhole, K1, K1K2, Tangential, FiveTerms, Rational };
inline constexpr std::array kLensModels{LensModel::Pinhole,    LensModel::K1,        LensModel::K1K2,
                                        LensModel::Tangential, LensModel::FiveTerms, LensModel::Rational};
inline constexpr std::size_t kMostParameters = 12;

std::string_view nameOf(LensModel model);
/// Of the parameters below: the first so many are free, the others 0.
std::size_t parametersOf(LensModel model);

/// fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6, the last eight as in OpenCV:
///   x = X/Z, y = Y/Z, r² = x² + y², ρ = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)
///   u = fx (x ρ + 2 p1 x y + p2 (r² + 2x²)) + cx
///   v = fy (y ρ + p1 (r² + 2y²) + 2 p2 x y) + cy
using LensParameters = std::array<double, kMostParameters>;
inline constexpr std::array<std::string_view, kMostParameters> kParameterNames{
    "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};

/// Where the target's frame lies in the camera's.
struct BoardPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
};

/// A pixel and what it moves by.
struct Projection {
  Eigen::Vector2d at;
  Eigen::Matrix<double, 2, kMostParameters> by_lens;
  /// By a small turn of the target about the camera's axes at the target's origin (radians), and by a
  /// shift (mm).
  Eigen::Matrix<double, 2, 6> by_pose;
  Eigen::Vector2d by_height;  ///< by the point's z on the target (mm)
};

Eigen::Vector2d project(const LensParameters& lens, const Eigen::Vector3d& in_camera);
Projection projectWithSlopes(const LensParameters& lens, const BoardPose& pose,
                             const Eigen::Vector3d& on_target_mm);
BoardPose moved(const BoardPose& pose, const Eigen::Matrix<double, 6, 1>& step);

/// How a lens model and a surface do on views that it has not seen, beside how it does on those that it was fitted to.
struct ModelScore {
  LensModel model = LensModel::Pinhole;
  int degree = 0;  ///< of the board's surface
  double fitted_rms_px = 0.0;
  double held_out_rms_px = 0.0;
  LensParameters lens{};                   ///< fitted to all views
  std::vector<double> held_out_by_view{};  ///< mean square of each view, px²; its pose is fitted, the lens is not
};
/// Relative gain of `richer` over `simpler` on held-out views: mean over views of ln(rms / rms'), with its
/// standard error. Views of all sizes of error count alike.
struct Gain {
  double mean = 0.0, error = 0.0;
  [[nodiscard]] bool isReal() const { return mean > 2.5 * error; }
};
Gain gainOf(const ModelScore& simpler, const ModelScore& richer);

}  // namespace toftwin::intrinsics
