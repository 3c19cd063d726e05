// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/uncertainty.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "calib/intrinsics/clusters.h"
#include "calib/linear/linear.h"

namespace toftwin::intrinsics {
namespace {

constexpr double kNormal95 = 1.959964;  // 97.5 % of a normal distribution lie below

/// Standard errors over resampled sets of views: one Gauss-Newton step from the best lens for each set.
Eigen::VectorXd resampled(const std::vector<SharedInformation>& views,
                          const std::vector<Eigen::VectorXd>& gradients, int resamples, std::uint64_t seed) {
  const Eigen::Index n = gradients.front().size();
  std::mt19937_64 random{seed};
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n), squares = sum;
  int counted = 0;
  for (int i = 0; i < resamples; ++i) {
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n);
    for (std::size_t k = 0; k < views.size(); ++k) {
      const std::size_t view = random() % views.size();
      information += views[view].information;
      gradient += gradients[view];
    }
    const Eigen::VectorXd step = linear::Ldlt{information}.solve(gradient);
    if (!step.allFinite()) continue;
    sum += step;
    squares += step.cwiseAbs2();
    ++counted;
  }
  const double count = std::max(counted, 2);
  return ((squares - sum.cwiseAbs2() / count) / (count - 1.0)).cwiseMax(0.0).cwiseSqrt();
}

}  // namespace

LensUncertainty uncertaintyOf(const std::vector<Observed>& views, const Bundle& bundle, int resamples,
                              std::uint64_t seed) {
  const auto information = sharedInformation(views, bundle);
  const auto n = static_cast<Eigen::Index>(parametersOf(bundle.model));
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(bundle.shared(), bundle.shared());
  for (const SharedInformation& view : information) total += view.information;

  LensUncertainty result;
  result.sigma_px = coordinateError(views, bundle);
  const Eigen::MatrixXd inverse = linear::inverse(total);
  const auto gradients = unbent(information, total);
  const Eigen::MatrixXd covariance = result.sigma_px * result.sigma_px * inverse.topLeftCorner(n, n);
  result.from_corners = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  result.from_views = clusteredErrors(information).standard.head(n);
  result.from_resampling = resampled(information, gradients, resamples, seed).head(n);
  const Eigen::VectorXd ratio = result.from_views.cwiseQuotient(result.from_corners);
  result.clustering = std::sqrt(ratio.cwiseAbs2().mean());

  const double degrees = std::max(1.0, static_cast<double>(views.size()) - 1.0);
  // Below, only in the mean over all: of few views each parameter's own disagreement is too noisy.
  const bool is_clustered = result.clustering > kClustered;
  const double pooled = std::max(1.0, result.clustering);
  const Eigen::VectorXd grown = is_clustered ? ratio : Eigen::VectorXd::Constant(n, pooled);
  result.covariance = grown.asDiagonal() * covariance * grown.asDiagonal();
  const double quantile = is_clustered ? studentQuantile(degrees) : kNormal95;
  result.half_width = quantile * result.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return result;
}

namespace {

/// How a pixel moves by the lens's parameters and by turning the camera, at the ray that it sees.
Projection slopesAt(const LensParameters& lens, double u, double v) {
  // The ray by fixed-point steps; near enough for an error that is known to a few per cent.
  double x = (u - lens[2]) / lens[0], y = (v - lens[3]) / lens[1];
  const double x0 = x, y0 = y;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector2d seen = project(lens, {x, y, 1.0});
    x += 0.7 * (x0 - (seen.x() - lens[2]) / lens[0]);
    y += 0.7 * (y0 - (seen.y() - lens[3]) / lens[1]);
    x = std::clamp(x, x0 - 1.0, x0 + 1.0);
    y = std::clamp(y, y0 - 1.0, y0 + 1.0);
  }
  return projectWithSlopes(lens, {}, {x, y, 1.0});
}

}  // namespace

MappingError::MappingError(const Bundle& bundle, const LensUncertainty& uncertainty, int width, int height)
    : lens_(bundle.lens), count_(static_cast<Eigen::Index>(parametersOf(bundle.model))) {
  const auto [values, vectors] = linear::eigenpairs(uncertainty.covariance);
  root_ = vectors * values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
  Eigen::Matrix3d turn_by_turn = Eigen::Matrix3d::Zero();
  Eigen::MatrixXd turn_by_lens = Eigen::MatrixXd::Zero(3, count_);
  constexpr int kAcross = 12;
  for (int i = 0; i <= kAcross; ++i) {
    for (int j = 0; j <= kAcross; ++j) {
      const Projection at = slopesAt(lens_, width * double(i) / kAcross, height * double(j) / kAcross);
      const Eigen::Matrix<double, 2, 3> by_turn = at.by_pose.leftCols<3>();
      turn_by_turn += by_turn.transpose() * by_turn;
      turn_by_lens += by_turn.transpose() * at.by_lens.leftCols(count_);
    }
  }
  turn_ = -linear::Ldlt{turn_by_turn}.solveEach(turn_by_lens);
}

double MappingError::at(double u, double v) const {
  const Projection slopes = slopesAt(lens_, u, v);
  const Eigen::MatrixXd moved =
      slopes.by_lens.leftCols(count_) + slopes.by_pose.leftCols<3>() * turn_;
  return (moved * root_).norm() / std::sqrt(2.0);
}

}  // namespace toftwin::intrinsics
