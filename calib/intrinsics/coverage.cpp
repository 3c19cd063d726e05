// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/coverage.h"

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocol/types/counted.h"

namespace toftwin::intrinsics {
namespace {

/// Which edges of the board were nearest by enough, and how far it was.
struct Stance {
  bool left = false, right = false, top = false, bottom = false;
  double nearest = HUGE_VAL, farthest = 0.0;
};

void look(Stance& stance, const BoardPose& pose, double tilt_deg) {
  const double least = std::sin(tilt_deg * std::numbers::pi / 180.0);
  // The board's normal, pointing away; x > 0: its left edge is farther than its right.
  const Eigen::Vector3d normal = pose.rotation.col(2) * (pose.rotation(2, 2) < 0.0 ? -1.0 : 1.0);
  stance.right |= normal.x() > least;
  stance.left |= normal.x() < -least;
  stance.bottom |= normal.y() > least;
  stance.top |= normal.y() < -least;
  const double distance = pose.translation_mm.norm();
  stance.nearest = std::min(stance.nearest, distance);
  stance.farthest = std::max(stance.farthest, distance);
}

/// With the lens if it is known, else with one of 60 degrees: good enough to tell directions.
Stance stanceOf(const Target& target, const std::vector<Sighting>& sightings, ImageSize size,
                const Estimate* estimate, const GuidanceGoals& goals) {
  Stance stance;
  if (estimate != nullptr) {
    for (const BoardPose& pose : estimate->bundle.poses) look(stance, pose, goals.tilt_deg);
    return stance;
  }
  const double focal = 0.87 * size.width;
  const LensParameters lens{focal, focal, (size.width - 1) / 2.0, (size.height - 1) / 2.0};
  for (const Sighting& sighting : sightings) {
    if (!sighting.isUsed()) continue;
    if (const auto pose = poseOf(Surface{target, 0}, observed(sighting.corners), lens)) {
      look(stance, *pose, goals.tilt_deg);
    }
  }
  return stance;
}

std::string listed(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, ", ")); }

void guideStance(Guidance& guidance, const Stance& stance, const GuidanceGoals& goals) {
  std::vector<std::string> edges;
  if (!stance.left) edges.emplace_back("left");
  if (!stance.right) edges.emplace_back("right");
  if (!stance.top) edges.emplace_back("top");
  if (!stance.bottom) edges.emplace_back("bottom");
  if (!edges.empty()) {
    guidance.missing.push_back(fmt::format("tilt the board by {:.0f} degrees or more so that its {} edge is nearest",
                                           goals.tilt_deg, fmt::join(edges, ", then its ")));
  }
  if (stance.farthest < goals.distance_ratio * stance.nearest) {
    guidance.missing.push_back(
        fmt::format("show it from farther away as well: {:.0f} to {:.0f} mm so far", stance.nearest, stance.farthest));
  }
}

}  // namespace

void ImageCover::add(const Sighting& sighting) {
  std::vector<cv::Point2f> points;
  for (const Corner& corner : sighting.corners) {
    points.emplace_back(static_cast<float>(corner.at.u), static_cast<float>(corner.at.v));
    box_ = {std::min(box_[0], corner.at.u), std::min(box_[1], corner.at.v),
            std::max(box_[2], corner.at.u), std::max(box_[3], corner.at.v)};
  }
  if (points.size() < 3) return;
  std::vector<cv::Point2f> hull;
  cv::convexHull(points, hull);
  for (int row = 0; row < kDown; ++row) {
    for (int column = 0; column < kAcross; ++column) {
      const Pixel at = centre(column, row);
      const double inside =
          cv::pointPolygonTest(hull, {static_cast<float>(at.u), static_cast<float>(at.v)}, true);
      if (inside >= -0.5 * sighting.square_px) cells_[index(column, row)] = true;
    }
  }
}

Pixel ImageCover::centre(int column, int row) const {
  return {(column + 0.5) * size_.width / kAcross - 0.5, (row + 0.5) * size_.height / kDown - 0.5};
}

double ImageCover::share() const {
  return static_cast<double>(std::ranges::count(cells_, true)) / static_cast<double>(cells_.size());
}

std::vector<std::string> ImageCover::missing(double least) const {
  constexpr const char* kNames[] = {"top left", "top",         "top right", "left",        "centre",
                                    "right",    "bottom left", "bottom",    "bottom right"};
  std::array<int, 9> covered{}, all{};
  for (int row = 0; row < kDown; ++row) {
    for (int column = 0; column < kAcross; ++column) {
      const auto part = static_cast<std::size_t>(3 * (3 * row / kDown) + 3 * column / kAcross);
      ++all[part];
      covered[part] += isCovered(column, row) ? 1 : 0;
    }
  }
  std::vector<std::string> names;
  for (std::size_t part = 0; part < 9; ++part) {
    if (covered[part] < least * all[part]) names.emplace_back(kNames[part]);
  }
  return names;
}

int wholePercent(double share) { return static_cast<int>(std::floor(100.0 * share)); }

Guidance guide(const Target& target, const std::vector<Sighting>& sightings, ImageSize size,
               const Estimate* estimate, const GuidanceGoals& goals) {
  Guidance guidance;
  ImageCover cover{target, size};
  for (const Sighting& sighting : sightings) {
    if (!sighting.isUsed()) continue;
    cover.add(sighting);
    ++guidance.views;
  }
  guidance.covered = cover.share();
  if (const auto parts = cover.missing(); !parts.empty()) {
    guidance.missing.push_back("show the board in these parts of the image: " + listed(parts));
  } else if (guidance.covered < goals.covered) {
    // One of nine parts at least has less than the mean that is wanted.
    auto edges = cover.missing(goals.covered);
    std::erase(edges, "centre");
    guidance.missing.push_back(
        fmt::format("{}: {} % of the image are covered, {:.0f} % are wanted",
                    edges.empty() ? "fill the centre of the image"
                                  : "go closer to the image's edge at its " + listed(edges),
                    wholePercent(guidance.covered), 100.0 * goals.covered));
  }
  if (guidance.views > 0) guideStance(guidance, stanceOf(target, sightings, size, estimate, goals), goals);
  if (guidance.views < goals.views) {
    guidance.missing.push_back(counted(goals.views - guidance.views, "more view"));
  }
  if (estimate == nullptr) return guidance;
  const MappingError error{estimate->bundle, estimate->uncertainty, size.width, size.height};
  double worst = 0.0;
  for (int row = 0; row < ImageCover::kDown; ++row) {
    for (int column = 0; column < ImageCover::kAcross; ++column) {
      const Pixel at = cover.centre(column, row);
      worst = std::max(worst, error.at(at.u, at.v));
    }
  }
  guidance.worst_error_px = worst;
  if (guidance.missing.empty() && worst > goals.worst_error_px) {
    guidance.missing.push_back(fmt::format("more views: the lens is known to {:.2f} px (one standard error), {:.2f} "
                                           "are wanted",
                                           worst, goals.worst_error_px));
  }
  return guidance;
}

}  // namespace toftwin::intrinsics
