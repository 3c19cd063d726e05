// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/seed.h"

#include <opencv2/calib3d.hpp>

#include <algorithm>
#include <cmath>

namespace toftwin::intrinsics {
namespace {

/// Of one view, in OpenCV's types.
struct Points {
  std::vector<cv::Point3d> on_target;
  std::vector<cv::Point2d> seen;
};
Points pointsOf(const Surface& surface, const Observed& view) {
  Points points;
  for (const Corner& corner : view.corners) {
    const Eigen::Vector3d at = surface.at(corner.index);
    points.on_target.emplace_back(at.x(), at.y(), 0.0);  // flat, as the two poses are found
    points.seen.emplace_back(corner.at.u, corner.at.v);
  }
  return points;
}

BoardPose poseFrom(const cv::Mat& turn, const cv::Mat& shift) {
  cv::Mat rotation;
  cv::Rodrigues(turn, rotation);
  BoardPose pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) pose.rotation(row, column) = rotation.at<double>(row, column);
    pose.translation_mm[row] = shift.at<double>(row);
  }
  return pose;
}

std::vector<double> focalLengths(const Surface& surface, const std::vector<Observed>& views, ImageSize size) {
  const double side = std::max(size.width, size.height);
  std::vector<double> tried{0.5 * side, 0.8 * side, 1.2 * side, 2.0 * side};
  std::vector<std::vector<cv::Point3f>> on_target;
  std::vector<std::vector<cv::Point2f>> seen;
  for (const Observed& view : views) {
    const Points points = pointsOf(surface, view);
    on_target.emplace_back(points.on_target.begin(), points.on_target.end());
    seen.emplace_back(points.seen.begin(), points.seen.end());
  }
  try {
    const cv::Mat k = cv::initCameraMatrix2D(on_target, seen, {size.width, size.height}, 1.0);
    const double f = k.at<double>(0, 0);
    if (std::isfinite(f) && f > 0.1 * side && f < 20.0 * side) tried.push_back(f);
  } catch (const cv::Exception&) {
    // Views square to the axis say nothing of the focal length; the others are tried.
  }
  return tried;
}

}  // namespace

std::optional<BoardPose> poseOf(const Surface& surface, const Observed& view, const LensParameters& lens) {
  const Points points = pointsOf(surface, view);
  if (points.seen.size() < 4) return std::nullopt;
  const cv::Matx33d k{lens[0], 0, lens[2], 0, lens[1], lens[3], 0, 0, 1};
  const cv::Mat distortion(1, 8, CV_64F, const_cast<double*>(lens.data() + 4));
  std::vector<cv::Mat> turns, shifts;
  try {
    cv::solvePnPGeneric(points.on_target, points.seen, k, distortion, turns, shifts, false,
                        cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception&) {
    return std::nullopt;  // corners on one line, or a lens that cannot be inverted there
  }
  std::optional<BoardPose> best;
  double least = HUGE_VAL;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    BoardPose pose = poseFrom(turns[i], shifts[i]);
    if (!pose.rotation.allFinite() || !(pose.translation_mm.z() > 0.0)) continue;
    refinePose(surface, view, lens, pose);
    const double rms = rmsOf(residuals(surface, view, lens, pose));
    if (rms >= least) continue;
    least = rms;
    best = pose;
  }
  return best;
}

std::optional<Bundle> seedBundle(const Surface& surface, const std::vector<Observed>& views, ImageSize size) {
  std::optional<Bundle> best;
  double least = HUGE_VAL;
  for (const double focal : focalLengths(surface, views, size)) {
    Bundle bundle{.model = LensModel::K1, .lens = {}, .surface = surface};
    bundle.lens = {focal, focal, (size.width - 1) / 2.0, (size.height - 1) / 2.0};
    for (const Observed& view : views) {
      const auto pose = poseOf(surface, view, bundle.lens);
      if (!pose) break;
      bundle.poses.push_back(*pose);
    }
    if (bundle.poses.size() != views.size()) continue;
    std::vector<Observed> weighed = views;
    refine(weighed, bundle, {.is_robust = true, .steps = 30});
    double sum = 0.0;
    for (std::size_t v = 0; v < views.size(); ++v) {
      // The logarithm, for one bad view must not choose the lens.
      sum += std::log(1e-6 + rmsOf(residuals(bundle, views[v], v)));
    }
    if (!std::isfinite(sum) || sum >= least) continue;
    least = sum;
    best = bundle;
  }
  return best;
}

}  // namespace toftwin::intrinsics
