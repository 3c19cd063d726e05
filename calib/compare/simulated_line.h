// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/scan_line.h"
#include "sim/sensor/sensor_model.h"
#include "sim/tracer/scene.h"

namespace toftwin::compare {

/// How much work goes into one simulated scan line.
struct LineEffort {
  int batches = 4;              ///< independent traces; their scatter is the Monte-Carlo noise
  int samples_per_batch = 512;  ///< paths per pixel and batch
  int frames = 64;              ///< exposures per batch, each with its own shot noise
  int max_surfaces = 16;
  std::uint64_t seed = 1;
};

/// The middle row of a camera before a scene that is given in the camera's own frame (x right, y
/// down, z ahead), as the measurements were taken: the mean over many frames.
struct SimulatedLine {
  ScanLine line;
  std::vector<double> truth_mm;  ///< exact range of the first surface; NaN where nothing
  std::vector<double>
      monte_carlo_mm;            ///< standard error of the line by Monte-Carlo and sensor noise
  double median_error_mm = 0.0;  ///< median of that
};
Result<SimulatedLine> simulateLine(const sim::SensorModel& camera, const sim::Scene& scene,
                                   const LineEffort& effort,
                                   const std::function<void(double)>& progress = {});

/// The light of the middle row before a scene, traced once: for fits that change the camera's effects again
/// and again.
struct TracedLine {
  sim::Light light;
  int row = 0;
  std::vector<double> t;
};
/// Light that comes straight from the emitters, of so many samples a pixel.
TracedLine traceLine(const sim::SensorModel& camera, const sim::Scene& scene, int samples);
/// One frame of it; NaN where the camera calls a pixel invalid.
ScanLine readLine(const sim::SensorModel& camera, const TracedLine& line);
/// A camera of which one frame is the mean of many: its noise is off, and its companding, whose steps noise smooths;
/// all else acts.
sim::SensorModel withoutNoise(const sim::SensorModel& camera);
/// The camera with that effect before all others, in place of its own of that kind.
template <class E>
sim::SensorModel withEffect(const sim::SensorModel& camera, const E& effect) {
  std::vector<sim::AnyEffect> effects = camera.effects();
  std::erase_if(effects, [](const sim::AnyEffect& any) { return std::holds_alternative<E>(any); });
  effects.insert(effects.begin(), effect);
  return camera.withEffects(std::move(effects));
}

/// Ranges that one pure sine of that frequency would give along the middle row: −arg(P) c / 4πf,
/// unwrapped to the truth's period. For the published simulations, whose camera is not a product.
struct PhasorLines {
  std::vector<double> t, truth_mm;
  std::vector<std::vector<double>> range_mm;  ///< per frequency
};
Result<PhasorLines> tracePhasors(const sim::TraceRequest& request, const sim::Scene& scene);

/// One wall in section, for scenes: from (x0, z0) to (x1, z1) in millimetres, upright, `height_mm`
/// tall.
struct Wall {
  double x0, z0, x1, z1;
  double height_mm;
  const char* material;
};
/// The TOML text of a scene of upright walls and materials ("name albedo model sigma" by
/// materialToml).
std::string wallToml(const Wall& wall);
std::string materialToml(const std::string& name, double albedo, double oren_nayar_sigma_deg = 0.0);

}  // namespace toftwin::compare
