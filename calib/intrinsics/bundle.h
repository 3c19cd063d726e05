// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "calib/intrinsics/clusters.h"
#include "calib/intrinsics/detect.h"
#include "calib/intrinsics/lens_model.h"
#include "calib/intrinsics/surface.h"

/// Least squares over one lens, the board's shape and its pose in each view. Poses are eliminated view by view, so
/// the cost is linear in the number of views.
namespace toftwin::intrinsics {

/// Corners of one view with how much each counts (1: fully).
struct Observed {
  std::vector<Corner> corners;
  std::vector<double> weights;
};
Observed observed(std::vector<Corner> corners);

struct Bundle {
  LensModel model = LensModel::Tangential;
  LensParameters lens{};
  Surface surface{};
  std::vector<BoardPose> poses{};

  /// Parameters that all views share.
  [[nodiscard]] Eigen::Index shared() const {
    return static_cast<Eigen::Index>(parametersOf(model)) + surface.terms();
  }
};

struct BundleOptions {
  bool is_robust = true;  ///< the weights are found as well (Huber's), else left as they are
  int steps = 60;
};

/// Improves the bundle in place; false if it did not settle.
bool refine(std::vector<Observed>& views, Bundle& bundle, const BundleOptions& options = {});
/// The pose of one view for a lens and a board that are known.
bool refinePose(const Surface& surface, const Observed& view, const LensParameters& lens, BoardPose& pose);

/// Measured minus predicted, one for each corner.
std::vector<Eigen::Vector2d> residuals(const Surface& surface, const Observed& view,
                                       const LensParameters& lens, const BoardPose& pose);
std::vector<Eigen::Vector2d> residuals(const Bundle& bundle, const Observed& view, std::size_t pose);
/// √(Σ (du² + dv²) / corners), as OpenCV defines the reprojection error; weights are not used.
double rmsOf(std::span<const Eigen::Vector2d> residuals);

/// What each view says of the lens and the bend (in this order) when its own pose is free, weighted, at the bundle as
/// it is: Σ Aᵀ A − Σ Aᵀ B (Bᵀ B)⁻¹ Bᵀ A and Σ Aᵀ r − Σ Aᵀ B (Bᵀ B)⁻¹ Bᵀ r.
std::vector<SharedInformation> sharedInformation(const std::vector<Observed>& views, const Bundle& bundle);
/// Standard deviation of a corner's coordinate: √(Σ w r² / (Σ 2w − free parameters)).
double coordinateError(const std::vector<Observed>& views, const Bundle& bundle);

}  // namespace toftwin::intrinsics
