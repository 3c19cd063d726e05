// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/bundle.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/linear/linear.h"

namespace toftwin::intrinsics {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kHuber = 2.5;  // standard deviations of a coordinate, for the length of a residual

/// Sums over one view, A by what all views share, B by pose, r = measured − predicted.
struct ViewSums {
  Eigen::MatrixXd aa, ab;
  Eigen::VectorXd ar;
  Matrix6 bb = Matrix6::Zero();
  Vector6 br = Vector6::Zero();
  double rr = 0.0;
};

/// `terms`: of the lens; none: A is left empty.
ViewSums sumsOf(const Surface& surface, const Observed& view, const LensParameters& lens,
                const BoardPose& pose, std::size_t terms) {
  const auto of_lens = static_cast<Eigen::Index>(terms);
  const Eigen::Index n = terms == 0 ? 0 : of_lens + surface.terms();
  ViewSums sums{.aa = Eigen::MatrixXd::Zero(n, n),
                .ab = Eigen::MatrixXd::Zero(n, 6),
                .ar = Eigen::VectorXd::Zero(n)};
  Eigen::Matrix<double, 2, Eigen::Dynamic> a(2, n);
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    const Corner& corner = view.corners[i];
    const Projection p = projectWithSlopes(lens, pose, surface.at(corner.index));
    const Eigen::Vector2d r{corner.at.u - p.at.x(), corner.at.v - p.at.y()};
    const double w = view.weights[i];
    sums.bb.noalias() += w * (p.by_pose.transpose() * p.by_pose);
    sums.br.noalias() += w * (p.by_pose.transpose() * r);
    sums.rr += w * r.squaredNorm();
    if (n == 0) continue;
    a.leftCols(of_lens) = p.by_lens.leftCols(of_lens);
    if (n > of_lens) a.rightCols(n - of_lens) = p.by_height * surface.slope(corner.index);
    sums.aa.noalias() += w * (a.transpose() * a);
    sums.ab.noalias() += w * (a.transpose() * p.by_pose);
    sums.ar.noalias() += w * (a.transpose() * r);
  }
  return sums;
}

/// Σ weight · r² of one view, px².
double weightedSquares(const Observed& view, const std::vector<Eigen::Vector2d>& left) {
  double sum = 0.0;
  for (std::size_t i = 0; i < left.size(); ++i) sum += view.weights[i] * left[i].squaredNorm();
  return sum;
}

double misfit(const std::vector<Observed>& views, const Bundle& bundle) {
  double sum = 0.0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    sum += weightedSquares(views[v], residuals(bundle, views[v], v));
  }
  return sum;
}

bool isInFront(const Surface& surface, const Observed& view, const BoardPose& pose) {
  return std::ranges::all_of(view.corners, [&](const Corner& corner) {
    return (pose.rotation * surface.at(corner.index) + pose.translation_mm).z() > 0.0;
  });
}

/// One damped step for all parameters; nothing if it leads nowhere.
std::optional<Bundle> stepped(const std::vector<Observed>& views, const std::vector<ViewSums>& sums,
                              const Bundle& bundle, double damping) {
  const Eigen::Index n = bundle.shared(), of_lens = n - bundle.surface.terms();
  Eigen::MatrixXd reduced = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  std::vector<Matrix6> damped_bb(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    damped_bb[v] = sums[v].bb;
    damped_bb[v].diagonal() *= 1.0 + damping;
    const linear::Ldlt solver{damped_bb[v]};
    reduced += sums[v].aa;
    reduced.diagonal() += damping * sums[v].aa.diagonal();
    reduced -= sums[v].ab * solver.solveEach(sums[v].ab.transpose());
    right += sums[v].ar - sums[v].ab * solver.solve(sums[v].br);
  }
  const Eigen::VectorXd step = linear::Ldlt{reduced}.solve(right);
  if (!step.allFinite()) return std::nullopt;
  Bundle next = bundle;
  for (Eigen::Index i = 0; i < of_lens; ++i) next.lens[static_cast<std::size_t>(i)] += step[i];
  next.surface.bendBy(step.tail(n - of_lens));
  if (!(next.lens[0] > 0.0 && next.lens[1] > 0.0)) return std::nullopt;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Vector6 pose_step =
        linear::Ldlt{damped_bb[v]}.solve(sums[v].br - sums[v].ab.transpose() * step);
    if (!pose_step.allFinite()) return std::nullopt;
    next.poses[v] = moved(bundle.poses[v], pose_step);
    if (!isInFront(next.surface, views[v], next.poses[v])) return std::nullopt;
  }
  return next;
}

/// Levenberg-Marquardt with the weights as they are.
bool minimise(const std::vector<Observed>& views, Bundle& bundle, int steps) {
  double now = misfit(views, bundle), damping = 1e-3;
  for (int step = 0; step < steps; ++step) {
    std::vector<ViewSums> sums;
    for (std::size_t v = 0; v < views.size(); ++v) {
      sums.push_back(
          sumsOf(bundle.surface, views[v], bundle.lens, bundle.poses[v], parametersOf(bundle.model)));
    }
    bool is_better = false;
    while (!is_better && damping < 1e10) {
      const auto next = stepped(views, sums, bundle, damping);
      const double then = next ? misfit(views, *next) : HUGE_VAL;
      if (then <= now) {
        const bool is_settled = now - then <= 1e-9 * now + 1e-20;
        bundle = *next;
        now = then;
        damping = std::max(1e-9, damping * 0.1);
        is_better = true;
        if (is_settled) return true;
      } else {
        damping *= 10.0;
      }
    }
    if (!is_better) return true;  // no step improves it: it is at the bottom
  }
  return false;
}

double medianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void updateWeights(std::vector<Observed>& views, const Bundle& bundle) {
  std::vector<std::vector<Eigen::Vector2d>> all;
  std::vector<double> lengths;
  for (std::size_t v = 0; v < views.size(); ++v) {
    all.push_back(residuals(bundle, views[v], v));
    for (const auto& r : all.back()) lengths.push_back(r.norm());
  }
  constexpr double kMedianLength = 1.177410;  // of a normal pair, in standard deviations of one
  const double sigma = std::max(medianOf(std::move(lengths)) / kMedianLength, 1e-9);
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (std::size_t i = 0; i < all[v].size(); ++i) {
      const double size = all[v][i].norm() / sigma;
      views[v].weights[i] = size <= kHuber ? 1.0 : kHuber / size;
    }
  }
}

}  // namespace

std::vector<Eigen::Vector2d> residuals(const Surface& surface, const Observed& view,
                                       const LensParameters& lens, const BoardPose& pose) {
  std::vector<Eigen::Vector2d> all;
  all.reserve(view.corners.size());
  for (const Corner& corner : view.corners) {
    const Eigen::Vector2d at =
        project(lens, pose.rotation * surface.at(corner.index) + pose.translation_mm);
    all.emplace_back(corner.at.u - at.x(), corner.at.v - at.y());
  }
  return all;
}

std::vector<Eigen::Vector2d> residuals(const Bundle& bundle, const Observed& view, std::size_t pose) {
  return residuals(bundle.surface, view, bundle.lens, bundle.poses[pose]);
}

double rmsOf(std::span<const Eigen::Vector2d> residuals) {
  double sum = 0.0;
  for (const auto& r : residuals) sum += r.squaredNorm();
  return residuals.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(residuals.size()));
}

bool refine(std::vector<Observed>& views, Bundle& bundle, const BundleOptions& options) {
  constexpr int kReweightings = 6;
  bool is_settled = minimise(views, bundle, options.steps);
  for (int i = 0; options.is_robust && i < kReweightings; ++i) {
    updateWeights(views, bundle);
    is_settled = minimise(views, bundle, options.steps);
  }
  return is_settled;
}

bool refinePose(const Surface& surface, const Observed& view, const LensParameters& lens,
                BoardPose& pose) {
  double now = HUGE_VAL, damping = 1e-4;
  for (int step = 0; step < 50; ++step) {
    const ViewSums sums = sumsOf(surface, view, lens, pose, 0);
    now = sums.rr;
    bool is_better = false;
    while (!is_better && damping < 1e10) {
      Matrix6 damped = sums.bb;
      damped.diagonal() *= 1.0 + damping;
      const Vector6 change = linear::Ldlt{damped}.solve(sums.br);
      const BoardPose next = change.allFinite() ? moved(pose, change) : pose;
      const bool is_possible = change.allFinite() && isInFront(surface, view, next);
      const double then = is_possible ? sumsOf(surface, view, lens, next, 0).rr : HUGE_VAL;
      if (then <= now) {
        pose = next;
        damping = std::max(1e-9, damping * 0.1);
        is_better = true;
        if (now - then <= 1e-10 * now + 1e-20) return true;
      } else {
        damping *= 10.0;
      }
    }
    if (!is_better) return true;
  }
  return false;
}

std::vector<SharedInformation> sharedInformation(const std::vector<Observed>& views,
                                                 const Bundle& bundle) {
  std::vector<SharedInformation> all;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const ViewSums sums =
        sumsOf(bundle.surface, views[v], bundle.lens, bundle.poses[v], parametersOf(bundle.model));
    const linear::Ldlt solver{sums.bb};
    all.push_back({.information = sums.aa - sums.ab * solver.solveEach(sums.ab.transpose()),
                   .gradient = sums.ar - sums.ab * solver.solve(sums.br)});
  }
  return all;
}

Observed observed(std::vector<Corner> corners) {
  const std::size_t count = corners.size();
  return {.corners = std::move(corners), .weights = std::vector<double>(count, 1.0)};
}

double coordinateError(const std::vector<Observed>& views, const Bundle& bundle) {
  double counted = 0.0;
  for (const Observed& view : views) {
    for (const double weight : view.weights) counted += 2.0 * weight;
  }
  const double free = static_cast<double>(bundle.shared()) + 6.0 * static_cast<double>(views.size());
  return counted > free ? std::sqrt(misfit(views, bundle) / (counted - free)) : HUGE_VAL;
}

}  // namespace toftwin::intrinsics
