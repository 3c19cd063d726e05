// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "sim/images/light.h"
#include "sim/images/range.h"
#include "sim/images/samples.h"
#include "sim/tracer/trace.h"

namespace toftwin::sim {

/// A camera as data: lens, emitters, modulation, pixel, and the ordered list of its effects. Read from
/// a camera file (docs/camera-file.md); the presets lie in sim/cameras/. An invariant-free aggregate
/// is not enough here because the effect list is open; see sensor_model.cpp for the file's schema.
class SensorModel {
 public:
  static Result<SensorModel> load(const std::filesystem::path& file);
  static Result<SensorModel> parse(std::string_view toml, const std::filesystem::path& name);
  /// A preset by its name ("kinect_v2", "o3d303"), from the installed or source camera folder.
  static Result<SensorModel> preset(std::string_view name);

  [[nodiscard]] const std::string& model() const;
  [[nodiscard]] const CameraInfo& camera() const;
  /// Content hash of everything that the camera file says; 32 hex digits.
  [[nodiscard]] const std::string& id() const;
  [[nodiscard]] std::vector<std::string> effectNames() const;

  /// What the tracer must give for this camera: lens, emitters, frequencies and harmonics filled in;
  /// pose, sample count, surfaces, region and seed are the caller's.
  [[nodiscard]] TraceRequest traceRequest() const;

  /// One exposure: light → effects → samples → effects → decoding → range → effects. `moment` gives
  /// the covariates (time since power-on, temperatures, ambient); `seed` and `frame` key all noise.
  /// `region_x`, `region_y` say where the light's top left pixel lies in the full image.
  struct Exposed {
    Samples samples;
    RangeImage range;
  };
  [[nodiscard]] Exposed expose(const Light& light, const Moment& moment, std::uint64_t seed,
                               std::uint64_t frame, int region_x = 0, int region_y = 0) const;

  struct Impl;

 private:
  explicit SensorModel(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<const Impl> impl_;  // shared by copies; nobody changes it
};

}  // namespace toftwin::sim
