// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "sim/sensor/sensor_model.h"
#include "tests/sim/synthetic_light.h"

namespace toftwin::sim {

inline constexpr double kPi = std::numbers::pi;

/// A camera whose pixels collect 1e4 electrons per raw exposure at radiance 1; `more` is appended.
inline std::string plainCamera(int steps, int taps, double contrast, const std::string& more = {}) {
  return "[lens]\nwidth = 400\nheight = 250\nfx = 300\nfy = 300\ncx = 200\ncy = 125\n[[emitter]]\n"
         "[[modulation]]\nfrequency_mhz = 80\nexposure_us = 1000\ncontrast = " +
         std::to_string(contrast) + "\n[sampling]\nsteps = " + std::to_string(steps) +
         "\ntaps = " + std::to_string(taps) + "\n[pixel]\nelectrons_per_radiance_s = 1e7\n" + more;
}
inline constexpr auto kShotNoise = "[[effect]]\ntype = 'shot_noise'\n";

inline SensorModel modelOf(const std::string& toml) {
  auto model = SensorModel::parse(toml, "camera.toml");
  if (!model) throw std::runtime_error{model.error().message};
  return *std::move(model);
}
inline std::string errorOf(const std::string& toml) {
  const auto model = SensorModel::parse(toml, "camera.toml");
  return model ? "" : model.error().message;
}

/// For effects that only ask for the image's size.
inline CameraInfo cameraOfSize(int width, int height) {
  CameraInfo camera;
  camera.width = width, camera.height = height;
  return camera;
}

inline Light evenLight(const SensorModel& model, double radiance, double range_m,
                       double ambient = 0.0) {
  const TraceRequest request = model.traceRequest();
  Light light = syntheticLight(
      model.camera().width, model.camera().height, request.frequencies, request.harmonics,
      [&](int, int) {
        return std::vector<Way>{{radiance, range_m}};
      },
      ambient);
  return light;
}

struct Statistics {
  double mean = 0.0, sigma = 0.0, valid = 0.0;
};
/// Of the pixels that are at least `margin` from the border.
inline Statistics rangeStatistics(const RangeImage& image, int margin = 0) {
  Statistics s;
  double sum = 0.0, squares = 0.0, n = 0.0, all = 0.0;
  for (int y = margin; y < image.range_m.height() - margin; ++y) {
    for (int x = margin; x < image.range_m.width() - margin; ++x) {
      const auto range_m = static_cast<double>(image.range_m(x, y));
      all += 1.0;
      if (std::isnan(range_m)) continue;
      sum += range_m;
      squares += range_m * range_m;
      n += 1.0;
    }
  }
  s.mean = sum / n;
  s.sigma = std::sqrt(squares / n - s.mean * s.mean);
  s.valid = n / all;
  return s;
}
inline constexpr double kSigmaToPhase80MHz = 4.0 * kPi * 80e6 / kSpeedOfLight_m_per_s;

}  // namespace toftwin::sim
