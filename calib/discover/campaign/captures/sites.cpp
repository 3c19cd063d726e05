// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/sites.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/compare/stack.h"

namespace toftwin::discover {
namespace {

/// How far what a camera sees lies from there in the image of another one, in cells along the axis where it is
/// more: the median over the image. Infinite where nothing is seen.
double shiftOf(const CameraInfo& camera, const CellGrid& grid, const Image<float>& range_m,
               const Transform<Camera, Camera>& other_from_camera) {
  constexpr int kSteps = 8;
  constexpr double kUnseen = std::numeric_limits<double>::infinity();
  std::vector<double> shifts;
  for (int j = 0; j <= kSteps; ++j) {
    for (int i = 0; i <= kSteps; ++i) {
      const int x = i * (camera.width - 1) / kSteps, y = j * (camera.height - 1) / kSteps;
      if (!std::isfinite(range_m(x, y))) continue;
      const Vec3d seen = static_cast<double>(range_m(x, y)) * rayThroughPixel(camera, x, y).v;
      const Point<Camera> there{other_from_camera.rotate(seen) + other_from_camera.translation_m};
      shifts.push_back(kUnseen);
      if (!(there.m.z > 0.0)) continue;
      const auto [u, v] = pixelOfPoint(camera, there);
      shifts.back() = std::max(std::abs(u - x) / grid.cell_width, std::abs(v - y) / grid.cell_height);
    }
  }
  if (shifts.empty()) return kUnseen;
  const auto middle = shifts.begin() + static_cast<std::ptrdiff_t>(shifts.size() / 2);
  std::ranges::nth_element(shifts, middle);
  return *middle;
}

}  // namespace

std::vector<std::size_t> sitesOf(const Declared& declared, const Lit& lit, const CellGrid& grid) {
  const auto isBeside = [&](std::size_t a, std::size_t b) {
    const MeasuredCapture &one = lit.captures[a], &other = lit.captures[b];
    const auto &here = *one.moment.world_from_camera, &there = *other.moment.world_from_camera;
    return declared.sceneOf(one.record.block).id() == declared.sceneOf(other.record.block).id() &&
           (compare::samePose(here, there) ||
            shiftOf(declared.model.camera(), grid, lit.traced[a]->light.truth.range_m,
                    there.inverse() * here) < 1.0);
  };
  std::vector<std::size_t> sites;
  for (std::size_t c = 0; c < lit.captures.size(); ++c) {
    sites.push_back(c);
    for (std::size_t other = 0; other < c; ++other) {
      if (sites[other] == sites[c] || !isBeside(c, other)) continue;
      const auto [first, later] = std::minmax({sites[c], sites[other]});
      std::ranges::replace(sites, later, first);
    }
  }
  return sites;
}

}  // namespace toftwin::discover
