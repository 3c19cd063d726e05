// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/agreement/agreement.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/sensor/sensor_model.h"
#include "sim/tracer/scene.h"
#include "tests/reference_device/device/device.h"

namespace toftwin::reference {
namespace {

template <class T>
T valueOf(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return *std::move(result);
}

sim::RangeImage simulated(const AgreementJob& job) {
  const sim::SensorModel model = valueOf(sim::SensorModel::load(job.camera));
  const double exposure_us = model.exposures({}).front().duration.in(microsecond)*job.exposure_scale;
  const sim::SensorModel quiet = valueOf(model.with("exposure_us", exposure_us)).withEffects({});
  sim::TraceRequest request = quiet.traceRequest();
  request.world_from_camera = job.world_from_camera;
  request.samples_per_pixel = job.samples_per_pixel;
  request.max_surfaces = job.max_surfaces;
  request.sampler = sim::Sampler::Even;
  request.seed = job.seed;
  request.region_x = job.first_column, request.region_width = job.columns;
  request.region_height = job.columns > 0 ? request.camera.height : 0;
  const sim::Scene scene = valueOf(sim::Scene::load(job.scene));
  Moment moment;
  moment.exposures = quiet.exposures({});
  return quiet.expose(sim::trace(scene, request), moment, 1, 1).range;
}

/// Whether ranges or amplitudes jump near a pixel, or a neighbour sees nothing.
bool isAtEdge(const Measured& seen, std::size_t pixel) {
  const int width = seen.width, x = static_cast<int>(pixel) % width, y = static_cast<int>(pixel) / width;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (x + dx < 0 || x + dx >= width || y + dy < 0 || y + dy >= seen.height) continue;
      const auto other = static_cast<std::size_t>((y + dy) * width + x + dx);
      if (!(std::abs(seen.range_m[other] - seen.range_m[pixel]) < 0.05F * seen.range_m[pixel])) return true;
      if (std::abs(std::log(seen.amplitude[other] / seen.amplitude[pixel])) > 0.3F) return true;
    }
  }
  return false;
}

}  // namespace

Agreement agreementOf(const AgreementJob& job) {
  const Datasheet sheet = valueOf(readDatasheet(job.camera));
  Device device{valueOf(readRoom(job.scene)), sheet, {}, 1, {}};
  State state{.world_from_camera = job.world_from_camera, .exposure_scale = job.exposure_scale};
  const Measured ours = device.exposeNoiseFree(state, 0, false).measured;
  const sim::RangeImage theirs = simulated(job);
  const double metre_per_rad =
      299'792'458.0 / (4.0 * std::numbers::pi * sheet.modulations.front().frequency.in(hertz));
  const auto* read = sheet.declares("read_noise");
  const double read_variance = read == nullptr ? 0.0 : read->sigma_electrons * read->sigma_electrons;

  Agreement all;
  double noise = 0.0, squares = 0.0, gains = 0.0, edge_squares = 0.0;
  for (std::size_t i = 0; i < ours.range_m.size(); ++i) {
    const int x = static_cast<int>(i) % ours.width - job.first_column, y = static_cast<int>(i) / ours.width;
    if (x < 0 || x >= theirs.range_m.width()) continue;
    const double off_mm = 1e3 * static_cast<double>(theirs.range_m(x, y) - ours.range_m[i]);
    if (std::isnan(off_mm)) continue;
    if (isAtEdge(ours, i)) {
      ++all.edges, all.edge_mean_mm += off_mm, edge_squares += off_mm * off_mm;
      continue;
    }
    const double amplitude = static_cast<double>(ours.amplitude[i]);
    const double gain = std::log(static_cast<double>(theirs.amplitude(x, y)) / amplitude);
    ++all.pixels, all.mean_mm += off_mm, squares += off_mm * off_mm, all.mean_gain += gain,
        gains += gain * gain;
    all.worst_mm = std::max(all.worst_mm, std::abs(off_mm));
    const double variance =
        2.0 / sheet.sampling.steps * (static_cast<double>(ours.ambient[i]) + 2.0 * read_variance) / 8.0;
    noise += variance / (amplitude * amplitude);
  }
  const double n = std::max(1.0, static_cast<double>(all.pixels)),
               edges = std::max(1.0, static_cast<double>(all.edges));
  all.mean_mm /= n, all.mean_gain /= n, all.edge_mean_mm /= edges;
  all.rms_mm = std::sqrt(squares / n), all.rms_gain = std::sqrt(gains / n),
  all.edge_rms_mm = std::sqrt(edge_squares / edges);
  all.noise_mm = 1e3 * metre_per_rad * std::sqrt(noise / n);
  return all;
}

}  // namespace toftwin::reference
