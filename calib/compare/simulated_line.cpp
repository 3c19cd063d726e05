// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/simulated_line.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <type_traits>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/statistics.h"
#include "sim/tracer/trace.h"

namespace toftwin::compare {
namespace {

/// So many rows above and below its own does a camera's decoder look at: its filters and their edge test.
constexpr int kRowsBeside = 2;

int rowsBeside(const CameraInfo& camera) {
  return camera.height > 2 * kRowsBeside ? kRowsBeside : 0;
}

int middleRow(const CameraInfo& camera) {
  return std::clamp(static_cast<int>(std::lround(camera.cy)), rowsBeside(camera),
                    camera.height - 1 - rowsBeside(camera));
}

sim::TraceRequest middleRowOnly(sim::TraceRequest request) {
  request.region_x = 0;
  request.region_y = middleRow(request.camera);
  request.region_width = request.camera.width;
  request.region_height = 1;
  return request;
}

/// The one row of samples between copies of itself, for decoders that look at neighbours: the scenes of
/// the measured lines are the same above and below. The noise, which comes later, is not copied.
sim::Samples amongItsLike(const sim::Samples& row, int beside) {
  sim::Samples rows = row;
  for (std::size_t i = 0; i < row.electrons.size(); ++i) {
    rows.electrons[i] = Image<float>{row.width(), 2 * beside + 1};
    for (int y = 0; y <= 2 * beside; ++y) {
      std::ranges::copy(row.electrons[i].pixels(), &rows.electrons[i](0, y));
    }
  }
  return rows;
}

/// Per pixel: the mean over one batch's frames, NaN where most frames are invalid.
std::vector<double> meanRange(const sim::SensorModel& camera, const sim::Light& light,
                              const LineEffort& effort, int row, std::uint64_t first_frame) {
  std::vector<Running> mean(static_cast<std::size_t>(light.width()));
  const int beside = rowsBeside(camera.camera());
  const sim::Samples collected =
      amongItsLike(camera.collect(light, {}, effort.seed, first_frame, 0, row), beside);
  for (int frame = 0; frame < effort.frames; ++frame) {
    const auto exposed = camera.readOut(collected, {}, effort.seed,
                                        first_frame + static_cast<std::uint64_t>(frame), 0,
                                        row - beside);
    for (std::size_t x = 0; x < mean.size(); ++x) {
      const auto range =
          static_cast<double>(exposed.range.range_m(static_cast<int>(x), beside));
      if (std::isfinite(range)) mean[x].add(1e3 * range);
    }
  }
  std::vector<double> result;
  for (const Running& pixel : mean)
    result.push_back(2 * pixel.n() >= static_cast<std::size_t>(effort.frames) ? pixel.mean()
                                                                              : kNaN);
  return result;
}

bool isNoise(const sim::AnyEffect& effect) {
  return std::visit(
      []<class E>(const E&) {
        return std::is_same_v<E, sim::ShotNoise> || std::is_same_v<E, sim::ReadNoise> ||
               std::is_same_v<E, sim::RangeNoise> || std::is_same_v<E, sim::Companding>;
      },
      effect);
}

}  // namespace

TracedLine traceLine(const sim::SensorModel& camera, const sim::Scene& scene, int samples) {
  sim::TraceRequest request = middleRowOnly(camera.traceRequest());
  request.samples_per_pixel = samples;
  request.max_surfaces = 1;
  TracedLine line{.light = sim::trace(scene, request), .row = request.region_y, .t = {}};
  for (int x = 0; x < line.light.width(); ++x) {
    const Vec3d ray = rayThroughPixel(request.camera, static_cast<double>(x), line.row).v;
    line.t.push_back(ray.x / ray.z);
  }
  return line;
}

ScanLine readLine(const sim::SensorModel& camera, const TracedLine& line) {
  return {line.t, meanRange(camera, line.light, {.frames = 1}, line.row, 0)};
}

sim::SensorModel withoutNoise(const sim::SensorModel& camera) {
  std::vector<sim::AnyEffect> effects = camera.effects();
  std::erase_if(effects, isNoise);
  return camera.withEffects(std::move(effects));
}

Result<SimulatedLine> simulateLine(const sim::SensorModel& camera, const sim::Scene& scene,
                                   const LineEffort& effort,
                                   const std::function<void(double)>& progress) {
  sim::TraceRequest request = middleRowOnly(camera.traceRequest());
  request.samples_per_pixel = effort.samples_per_batch;
  request.max_surfaces = effort.max_surfaces;
  const auto width = static_cast<std::size_t>(camera.camera().width);
  std::vector<Running> across(width);
  SimulatedLine result;
  for (int batch = 0; batch < effort.batches; ++batch) {
    if (progress) progress(static_cast<double>(batch) / effort.batches);
    request.seed = effort.seed * 1000 + static_cast<std::uint64_t>(batch);
    const sim::Light light = sim::trace(scene, request);
    const auto first_frame =
        static_cast<std::uint64_t>(batch) * static_cast<std::uint64_t>(effort.frames);
    const auto range = meanRange(camera, light, effort, request.region_y, first_frame);
    for (std::size_t x = 0; x < width; ++x) {
      if (std::isfinite(range[x])) across[x].add(range[x]);
      if (batch == 0) result.truth_mm.push_back(1e3 * static_cast<double>(light.truth.range_m[x]));
    }
  }
  for (std::size_t x = 0; x < width; ++x) {
    const Vec3d ray = rayThroughPixel(camera.camera(), static_cast<double>(x), request.region_y).v;
    result.line.t.push_back(ray.x / ray.z);
    const bool valid =
        2 * across[x].n() >= static_cast<std::size_t>(effort.batches) && across[x].n() > 0;
    result.line.range_mm.push_back(valid ? across[x].mean() : kNaN);
    result.monte_carlo_mm.push_back(
        across[x].n() > 1 ? std::sqrt(across[x].variance() / static_cast<double>(across[x].n()))
                          : kNaN);
  }
  result.median_error_mm = quantile(result.monte_carlo_mm, 0.5);
  return result;
}

Result<PhasorLines> tracePhasors(const sim::TraceRequest& whole, const sim::Scene& scene) {
  const sim::TraceRequest request = middleRowOnly(whole);
  const sim::Light light = sim::trace(scene, request);
  PhasorLines result;
  result.range_mm.resize(request.frequencies.size());
  for (int x = 0; x < light.width(); ++x) {
    const Vec3d ray = rayThroughPixel(request.camera, x, request.region_y).v;
    result.t.push_back(ray.x / ray.z);
    const double truth = 1e3 * static_cast<double>(light.truth.range_m(x, 0));
    result.truth_mm.push_back(truth);
    for (std::size_t f = 0; f < request.frequencies.size(); ++f) {
      const double period = unambiguousRange(request.frequencies[f]).in(millimetre);
      const std::complex<double> p = light.phasor(f, 1)(x, 0);
      const double wrapped = -std::arg(p) / (2.0 * std::numbers::pi) * period;
      result.range_mm[f].push_back(wrapped + period * std::round((truth - wrapped) / period));
    }
  }
  return result;
}

std::string materialToml(const std::string& name, double albedo, double oren_nayar_sigma_deg) {
  std::string text = fmt::format("[[material]]\nname = \"{}\"\nalbedo = {:.6g}\n", name, albedo);
  if (oren_nayar_sigma_deg > 0.0)
    text += fmt::format("model = \"oren-nayar\"\nsigma_deg = {:.6g}\n", oren_nayar_sigma_deg);
  return text;
}

std::string wallToml(const Wall& wall) {
  const double dx = wall.x1 - wall.x0, dz = wall.z1 - wall.z0;
  // A rectangle's own x axis runs along the wall: a turn by α about y takes (1, 0, 0) to (cos α, 0,
  // −sin α).
  const double turn_deg = std::atan2(-dz, dx) * 180.0 / std::numbers::pi;
  return fmt::format(
      "[[object]]\nshape = \"rectangle\"\nsize_m = [{:.9g}, {:.9g}, 0.0]\nposition_m = [{:.9g}, "
      "0.0, {:.9g}]\n"
      "euler_deg = [0.0, {:.12g}, 0.0]\nmaterial = \"{}\"\n",
      1e-3 * std::hypot(dx, dz), 1e-3 * wall.height_mm, 0.5e-3 * (wall.x0 + wall.x1),
      0.5e-3 * (wall.z0 + wall.z1), turn_deg, wall.material);
}

}  // namespace toftwin::compare
