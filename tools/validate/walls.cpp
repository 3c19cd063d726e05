// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/walls.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <toftwin/nan.h>

#include "tools/validate/traced_line.h"
#include "calib/compare/statistics.h"
#include "sim/tracer/scene.h"
#include "sim/tracer/trace.h"

namespace toftwin::validate {

using compare::Running;

namespace {

constexpr int kInner = 4, kSide = kInner + 2;  // filters leave the outermost pixels as they are

/// Calls `visit(range in m, amplitude, number)` for the inner pixels of what was read.
template <class Visit>
void forInner(const sim::RangeImage& image, const Visit& visit) {
  for (int p = 0; p < kInner * kInner; ++p) {
    const int x = 1 + p % kInner, y = 1 + p / kInner;
    visit(static_cast<double>(image.range_m(x, y)), static_cast<double>(image.amplitude(x, y)),
          static_cast<std::size_t>(p));
  }
}

}  // namespace

Result<TracedWalls> traceWalls(const sim::SensorModel& camera, double albedo,
                               const std::vector<double>& distances_mm, std::uint64_t seed) {
  const auto scene = sim::Scene::parse(
      materialToml("wall", albedo) + wallToml({-2000, 0, 2000, 0, 4000, "wall"}), "wall.toml");
  if (!scene) return scene.error();
  sim::TraceRequest request = camera.traceRequest();
  request.samples_per_pixel = 64;
  request.max_surfaces = 1;  // one flat wall: no light comes twice
  request.seed = seed;
  request.region_x = std::clamp(static_cast<int>(std::lround(request.camera.cx)) - kSide / 2, 0,
                                request.camera.width - kSide);
  request.region_y = std::clamp(static_cast<int>(std::lround(request.camera.cy)) - kSide / 2, 0,
                                request.camera.height - kSide);
  request.region_width = request.region_height = kSide;
  TracedWalls walls{.light = {}, .truth_mm = {}, .left = request.region_x, .top = request.region_y};
  for (const double distance_mm : distances_mm) {
    request.world_from_camera.translation_m = {0.0, 0.0, -1e-3 * distance_mm};
    walls.light.push_back(sim::trace(*scene, request));
    Running truth;
    for (const float t : walls.light.back().truth.range_m.pixels()) truth.add(1e3 * static_cast<double>(t));
    walls.truth_mm.push_back(truth.mean());
  }
  return walls;
}

std::vector<double> readRanges(const sim::SensorModel& camera, const TracedWalls& walls,
                               const Moment& moment) {
  std::vector<double> ranges_mm;
  for (const sim::Light& light : walls.light) {
    double sum_m = 0.0;
    forInner(camera.expose(light, moment, 0, 0, walls.left, walls.top).range,
             [&](double range_m, double, std::size_t) { sum_m += range_m; });
    ranges_mm.push_back(1e3 * sum_m / (kInner * kInner));
  }
  return ranges_mm;
}

std::vector<WallReading> readWalls(const sim::SensorModel& camera, const TracedWalls& walls, int frames,
                                   std::uint64_t seed, const std::function<void(double)>& progress) {
  std::vector<WallReading> readings;
  for (std::size_t i = 0; i < walls.light.size(); ++i) {
    if (progress) progress(static_cast<double>(i) / static_cast<double>(walls.light.size()));
    const sim::Samples collected = camera.collect(walls.light[i], {}, seed, 0, walls.left, walls.top);
    std::vector<Running> range(kInner * kInner);
    Running amplitude;
    for (int frame = 0; frame < frames; ++frame) {
      const auto key = static_cast<std::uint64_t>(i) * static_cast<std::uint64_t>(frames) +
                       static_cast<std::uint64_t>(frame);
      forInner(camera.readOut(collected, {}, seed, key, walls.left, walls.top).range,
               [&](double range_m, double electrons, std::size_t pixel) {
                 if (std::isfinite(range_m)) range[pixel].add(1e3 * range_m), amplitude.add(electrons);
               });
    }
    Running mean, variance;
    for (const Running& pixel : range) {
      if (pixel.n() > 1) mean.add(pixel.mean()), variance.add(pixel.variance());
    }
    readings.push_back(
        {.truth_mm = walls.truth_mm[i],
         .range_mm = mean.n() > 0 ? mean.mean() : kNaN,
         .sigma_mm = variance.n() > 0 ? std::sqrt(variance.mean()) : kNaN,
         .amplitude = amplitude.mean(),
         .valid_share = static_cast<double>(amplitude.n()) / (static_cast<double>(range.size()) * frames)});
  }
  return readings;
}

std::vector<double> errorsAt(const std::vector<double>& reference_mm, const std::vector<double>& truth_mm,
                             const std::vector<double>& range_mm) {
  std::vector<double> errors;
  for (const double at : reference_mm) {
    const auto above = static_cast<std::size_t>(std::ranges::upper_bound(truth_mm, at) - truth_mm.begin());
    if (above == 0 || above == truth_mm.size()) {
      errors.push_back(kNaN);
      continue;
    }
    const std::size_t below = above - 1;
    const double share = (at - truth_mm[below]) / (truth_mm[above] - truth_mm[below]);
    errors.push_back((1.0 - share) * (range_mm[below] - truth_mm[below]) +
                     share * (range_mm[above] - truth_mm[above]));
  }
  return errors;
}

}  // namespace toftwin::validate
