// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/traced_line.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/statistics.h"
#include "sim/tracer/trace.h"

namespace toftwin::validate {

using compare::quantile;
using compare::Running;

namespace {

using std::numbers::pi;
using Phasor = std::complex<double>;

/// So many rows above and below its own does a camera's decoder look at: its filters and their edge test.
constexpr int kRowsBeside = 2;

int rowsBeside(const CameraInfo& camera) {
  return camera.height > 2 * kRowsBeside ? kRowsBeside : 0;
}

int middleRow(const CameraInfo& camera) {
  return std::clamp(static_cast<int>(std::lround(camera.cy)), rowsBeside(camera),
                    camera.height - 1 - rowsBeside(camera));
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
std::vector<double> meanRange(const sim::SensorModel& camera, const sim::Light& light, int row, std::uint64_t seed,
                              int frames, std::uint64_t first_frame) {
  std::vector<Running> mean(static_cast<std::size_t>(light.width()));
  const int beside = rowsBeside(camera.camera());
  const sim::Samples collected =
      amongItsLike(camera.collect(light, {}, seed, first_frame, 0, row), beside);
  for (int frame = 0; frame < frames; ++frame) {
    const auto exposed = camera.readOut(collected, {}, seed, first_frame + static_cast<std::uint64_t>(frame), 0,
                                        row - beside);
    for (std::size_t x = 0; x < mean.size(); ++x) {
      const auto range = static_cast<double>(exposed.range.range_m(static_cast<int>(x), beside));
      if (std::isfinite(range)) mean[x].add(1e3 * range);
    }
  }
  std::vector<double> result;
  for (const Running& pixel : mean)
    result.push_back(2 * pixel.n() >= static_cast<std::size_t>(frames) ? pixel.mean() : kNaN);
  return result;
}

/// The phasors of a row with a share of them spread along it.
std::vector<Phasor> spread(const sim::Light& light, std::size_t frequency, const RowHalo& halo) {
  const int n = light.width(), reach = halo.share == 0.0 ? 0 : static_cast<int>(std::ceil(3.0 * halo.radius_px));
  std::vector<double> weight;
  double sum = 0.0;
  for (int i = -reach; i <= reach; ++i)
    weight.push_back(std::exp(-0.5 * i * i / (halo.radius_px * halo.radius_px))), sum += weight.back();
  std::vector<Phasor> seen;
  for (int x = 0; x < n; ++x) {
    Phasor far;
    for (int i = std::max(-reach, -x); i <= std::min(reach, n - 1 - x); ++i)
      far += weight[static_cast<std::size_t>(i + reach)] / sum * Phasor{light.phasor(frequency, 1)(x + i, 0)};
    seen.push_back((1.0 - halo.share) * Phasor{light.phasor(frequency, 1)(x, 0)} + halo.share * far);
  }
  return seen;
}

}  // namespace

TracedLine traceLine(const sim::TraceRequest& whole, const sim::Scene& scene, const LineEffort& effort) {
  sim::TraceRequest request = whole;
  request.region_x = 0;
  request.region_y = middleRow(request.camera);
  request.region_width = request.camera.width;
  request.region_height = 1;
  request.samples_per_pixel = effort.samples;
  request.max_surfaces = effort.surfaces;
  TracedLine line{.light = {}, .row = request.region_y, .seed = effort.seed, .t = {}, .truth_mm = {}, .frequencies = request.frequencies};
  for (int batch = 0; batch < effort.batches; ++batch) {
    request.seed = effort.seed * 1000 + static_cast<std::uint64_t>(batch);
    line.light.push_back(sim::trace(scene, request));
  }
  for (int x = 0; x < request.camera.width; ++x) {
    const Vec3d ray = rayThroughPixel(request.camera, static_cast<double>(x), line.row).v;
    line.t.push_back(ray.x / ray.z);
    line.truth_mm.push_back(1e3 * static_cast<double>(line.light.front().truth.range_m(x, 0)));
  }
  return line;
}

ReadLine readLine(const sim::SensorModel& camera, const TracedLine& line, int frames) {
  std::vector<Running> across(line.t.size());
  for (std::size_t batch = 0; batch < line.light.size(); ++batch) {
    const auto first_frame = static_cast<std::uint64_t>(batch) * static_cast<std::uint64_t>(frames);
    const auto range = meanRange(camera, line.light[batch], line.row, line.seed, frames, first_frame);
    for (std::size_t x = 0; x < range.size(); ++x)
      if (std::isfinite(range[x])) across[x].add(range[x]);
  }
  ReadLine result{.line = {line.t, {}}};
  std::vector<double> errors;
  for (const Running& pixel : across) {
    const bool is_valid = 2 * pixel.n() >= line.light.size() && pixel.n() > 0;
    result.line.range_mm.push_back(is_valid ? pixel.mean() : kNaN);
    errors.push_back(pixel.n() > 1 ? std::sqrt(pixel.variance() / static_cast<double>(pixel.n())) : kNaN);
  }
  result.error_mm = quantile(errors, 0.5);
  return result;
}

ScanLine readSines(const TracedLine& line, const RowHalo& halo) {
  ScanLine result{line.t, line.truth_mm};
  double sum_mhz = 0.0;
  for (const Frequency f : line.frequencies) sum_mhz += f.in(megahertz);
  for (std::size_t f = 0; f < line.frequencies.size(); ++f) {
    const double period = unambiguousRange(line.frequencies[f]).in(millimetre);
    const std::vector<Phasor> seen = spread(line.light.front(), f, halo);
    for (std::size_t x = 0; x < seen.size(); ++x) {
      const double turn = 2.0 * pi * line.truth_mm[x] / period;
      result.range_mm[x] -= line.frequencies[f].in(megahertz) / sum_mhz * std::arg(seen[x] * std::polar(1.0, turn)) /
                            (2.0 * pi) * period;
    }
  }
  return result;
}

std::string materialToml(const std::string& name, double albedo) {
  return fmt::format("[[material]]\nname = \"{}\"\nalbedo = {:.6g}\n", name, albedo);
}

std::string wallToml(const Wall& wall) {
  const double dx = wall.x1 - wall.x0, dz = wall.z1 - wall.z0;
  // A rectangle's own x axis runs along the wall: a turn by α about y takes (1, 0, 0) to (cos α, 0,
  // −sin α).
  const double turn_deg = std::atan2(-dz, dx) * 180.0 / pi;
  return fmt::format(
      "[[object]]\nshape = \"rectangle\"\nsize_m = [{:.9g}, {:.9g}, 0.0]\nposition_m = [{:.9g}, "
      "0.0, {:.9g}]\n"
      "euler_deg = [0.0, {:.12g}, 0.0]\nmaterial = \"{}\"\n",
      1e-3 * std::hypot(dx, dz), 1e-3 * wall.height_mm, 0.5e-3 * (wall.x0 + wall.x1),
      0.5e-3 * (wall.z0 + wall.z1), turn_deg, wall.material);
}

}  // namespace toftwin::validate
