// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/lens_model.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace toftwin::intrinsics {
namespace {

enum : std::size_t { FX, FY, CX, CY, K1, K2, P1, P2, K3, K4, K5, K6 };

struct Distorted {
  Eigen::Vector2d at;            ///< before fx, fy, cx, cy
  Eigen::Matrix2d by_xy;
  double r2, above, below;       ///< of the ratio ρ
};

Distorted distort(const LensParameters& d, double x, double y) {
  const double r2 = x * x + y * y;
  const double above = 1.0 + r2 * (d[K1] + r2 * (d[K2] + r2 * d[K3]));
  const double below = 1.0 + r2 * (d[K4] + r2 * (d[K5] + r2 * d[K6]));
  const double ratio = above / below;
  const double above_by_r2 = d[K1] + r2 * (2.0 * d[K2] + 3.0 * r2 * d[K3]);
  const double below_by_r2 = d[K4] + r2 * (2.0 * d[K5] + 3.0 * r2 * d[K6]);
  const double slope = 2.0 * (above_by_r2 - ratio * below_by_r2) / below;  // of ρ, per x or y times it
  Distorted result;
  result.r2 = r2;
  result.above = above;
  result.below = below;
  result.at = {x * ratio + 2.0 * d[P1] * x * y + d[P2] * (r2 + 2.0 * x * x),
               y * ratio + d[P1] * (r2 + 2.0 * y * y) + 2.0 * d[P2] * x * y};
  const double mixed = x * y * slope + 2.0 * d[P1] * x + 2.0 * d[P2] * y;
  result.by_xy << ratio + x * x * slope + 2.0 * d[P1] * y + 6.0 * d[P2] * x, mixed,  //
      mixed, ratio + y * y * slope + 6.0 * d[P1] * y + 2.0 * d[P2] * x;
  return result;
}

}  // namespace

std::string_view nameOf(LensModel model) {
  switch (model) {
    case LensModel::Pinhole: return "pinhole";
    case LensModel::K1: return "k1";
    case LensModel::K1K2: return "k1k2";
    case LensModel::Tangential: return "k1k2p1p2";
    case LensModel::FiveTerms: return "k1k2p1p2k3";
    case LensModel::Rational: return "rational";
  }
  return "unknown";
}

std::size_t parametersOf(LensModel model) {
  switch (model) {
    case LensModel::Pinhole: return 4;
    case LensModel::K1: return 5;
    case LensModel::K1K2: return 6;
    case LensModel::Tangential: return 8;
    case LensModel::FiveTerms: return 9;
    case LensModel::Rational: return 12;
  }
  return 4;
}

Eigen::Vector2d project(const LensParameters& lens, const Eigen::Vector3d& in_camera) {
  const Distorted d = distort(lens, in_camera.x() / in_camera.z(), in_camera.y() / in_camera.z());
  return {lens[FX] * d.at.x() + lens[CX], lens[FY] * d.at.y() + lens[CY]};
}

Projection projectWithSlopes(const LensParameters& lens, const BoardPose& pose,
                             const Eigen::Vector3d& on_target_mm) {
  const Eigen::Vector3d turned = pose.rotation * on_target_mm;
  const Eigen::Vector3d at = turned + pose.translation_mm;
  const double x = at.x() / at.z(), y = at.y() / at.z();
  const Distorted d = distort(lens, x, y);

  Projection result;
  result.at = {lens[FX] * d.at.x() + lens[CX], lens[FY] * d.at.y() + lens[CY]};
  const double fx = lens[FX], fy = lens[FY], r2 = d.r2, r4 = r2 * r2, r6 = r4 * r2;
  const double up = 1.0 / d.below, down = -d.above / (d.below * d.below);
  const double u = fx * x, v = fy * y;
  result.by_lens <<  //
      d.at.x(), 0, 1, 0, u * r2 * up, u * r4 * up, fx * 2 * x * y, fx * (r2 + 2 * x * x), u * r6 * up,
      u * r2 * down, u * r4 * down, u * r6 * down,  //
      0, d.at.y(), 0, 1, v * r2 * up, v * r4 * up, fy * (r2 + 2 * y * y), fy * 2 * x * y, v * r6 * up,
      v * r2 * down, v * r4 * down, v * r6 * down;

  Eigen::Matrix<double, 2, 3> by_point;  // of x and y
  by_point << 1 / at.z(), 0, -x / at.z(), 0, 1 / at.z(), -y / at.z();
  by_point = (Eigen::DiagonalMatrix<double, 2>{fx, fy} * d.by_xy * by_point).eval();
  Eigen::Matrix3d by_turn;  // of the point: ω × turned
  by_turn << 0, turned.z(), -turned.y(), -turned.z(), 0, turned.x(), turned.y(), -turned.x(), 0;
  result.by_pose << by_point * by_turn, by_point;
  result.by_height = by_point * pose.rotation.col(2);
  return result;
}

BoardPose moved(const BoardPose& pose, const Eigen::Matrix<double, 6, 1>& step) {
  const Eigen::Vector3d turn = step.head<3>();
  const double angle = turn.norm();
  BoardPose result = pose;
  if (angle > 0.0) result.rotation = Eigen::AngleAxisd{angle, turn / angle} * pose.rotation;
  result.translation_mm += step.tail<3>();
  return result;
}

Gain gainOf(const ModelScore& simpler, const ModelScore& richer) {
  const std::size_t n = simpler.held_out_by_view.size();
  double sum = 0.0, squares = 0.0;
  for (std::size_t v = 0; v < n; ++v) {
    const double one = 0.5 * std::log((simpler.held_out_by_view[v] + 1e-12) / (richer.held_out_by_view[v] + 1e-12));
    sum += one;
    squares += one * one;
  }
  const double count = static_cast<double>(n), mean = sum / count;
  const double variance = n > 1 ? std::max(0.0, squares - count * mean * mean) / (count - 1.0) : HUGE_VAL;
  return {mean, std::sqrt(variance / count)};
}

}  // namespace toftwin::intrinsics
