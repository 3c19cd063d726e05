// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <toftwin/units.h>

#include "drivers/lens.h"
#include "drivers/pace.h"
#include "sim/tracer/trace.h"

namespace toftwin::drivers::simulator {

/// Of the camera from the world's origin, set by the configuration or by a client.
constexpr double kMostPosition_m = 1e6;

/// How light is traced: docs/realtime.md.
enum class Mode { Unbiased, RealTime };

/// By name, for the command line.
inline const std::map<std::string, sim::Sampler>& samplers() {
  static const std::map<std::string, sim::Sampler> kSamplers{
      {"shared", sim::Sampler::Shared}, {"even", sim::Sampler::Even}, {"plain", sim::Sampler::Plain}};
  return kSamplers;
}
inline std::string nameOf(sim::Sampler sampler) {
  for (const auto& [name, value] : samplers()) {
    if (value == sampler) return name;
  }
  return {};
}

/// The keys of a [[source]] table with driver = "sim".
struct Keys {
  std::string uri = "sim:generic_cw";
  std::string camera;
  std::string calibration;
  std::string scene;
  bool convert_meshes = false;
  Mode mode = Mode::Unbiased;
  sim::Sampler sampler = sim::Sampler::Shared;
  int samples_per_pixel = 4;
  Length light_noise = 0_mm;
  int max_surfaces = 4;
  double pixel_extent = 1.0;
  std::uint64_t seed = 1;
  Pace pace = Pace::RealTime;
  Duration frame_interval = 0_ms;
  std::uint64_t frames = 0;
  std::array<double, 3> position_m{};
  std::array<double, 3> euler_deg{};
  std::array<double, 3> velocity_m_per_s{};
  std::array<double, 3> rotation_rate_deg_per_s{};
  Duration powered_on_before = 10'800_s;
  Temperature room_temperature = 23_degC;
  Illuminance ambient = 0_klx;
  std::vector<std::string> planes;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("uri", uri, "sim: and the name of a camera preset");
    v.text("camera", camera, "path of a camera file, relative to this file, instead of a preset");
    v.text("calibration", calibration, kCalibrationHelp);
    v.text("scene", scene,
           "path of a scene file, relative to this file; empty: a box before a wall");
    v.flag("convert_meshes", convert_meshes,
           "lets a program of its own convert meshes that are neither OBJ, PLY, STL nor glTF (DAE, FBX, 3DS, …), within "
           "1 GiB of memory and 30 s of processor time");
    v.choice("mode", mode, {{"unbiased", Mode::Unbiased}, {"realtime", Mode::RealTime}},
             "how light is traced: exactly but for noise, or frame after frame at the camera's pace, with "
             "light over several surfaces kept, smoothed and some millimetres wrong");
    v.number("samples_per_pixel", samples_per_pixel, {1, 65'536},
             "paths traced per pixel; realtime has its own");
    v.choice("sampler", sampler,
             {{"shared", sim::Sampler::Shared}, {"even", sim::Sampler::Even}, {"plain", sim::Sampler::Plain}},
             "how paths are drawn: evenly, and shared by tiles of 8 x 8 pixels; evenly by each pixel for itself; or "
             "by plain random numbers, for comparison");
    v.quantity("light_noise", light_noise, millimetre, {0.0, 1000.0},
               "take only as many paths as leave this noise of the light in the range at the highest frequency, at "
               "most samples_per_pixel; 0: always that many");
    v.number("max_surfaces", max_surfaces, {1, 64},
             "surfaces a path may touch: 1 is direct light only");
    v.number("pixel_extent", pixel_extent, {0.0, 4.0},
             "side of a pixel's footprint in pixels; 0: its central ray, no flying pixels");
    v.number("seed", seed, {0, 9'007'199'254'740'992.0},
             "of all noise, of the tracer and of the sensor");
    v.choice(
        "pace", pace,
        {{"real_time", Pace::RealTime}, {"fast", Pace::Fast}, {"trigger", Pace::Trigger}},
        "when a frame comes: at the frame interval, as soon as possible, or one per trigger; under "
        "lockstep the clients say when");
    v.quantity("frame_interval", frame_interval, millisecond, {0.0, 1e6},
               "of device time, whatever the pace; 0: the camera's own");
    v.number("frames", frames, {0, 1e15}, "end of the stream after so many frames; 0: never");
    v.numbers("position_m", position_m, {-kMostPosition_m, kMostPosition_m},
              "of the lens in the world, until a client sets a pose");
    v.numbers("euler_deg", euler_deg, {-360.0, 360.0},
              "how it is turned: about the fixed world axes x, then y, then z; 0: it looks along "
              "z, y down");
    v.numbers("velocity_m_per_s", velocity_m_per_s, {-1e4, 1e4},
              "how fast the camera moves in the world; its pose is that at device time 0");
    v.numbers("rotation_rate_deg_per_s", rotation_rate_deg_per_s, {-36000.0, 36000.0},
              "how fast it turns about its lens: a vector along the axis, in the world");
    v.quantity("powered_on_before", powered_on_before, second, {0.0, 1e9},
               "how long before its first frame the camera was switched on; three hours: warm");
    v.quantity("room_temperature", room_temperature, celsius, {-40.0, 100.0},
               "reported with every frame");
    v.quantity("ambient", ambient, kilolux, {0.0, 200.0},
               "reported with every frame, and shone on the scene by the effect ambient_light");
    v.texts("planes", planes,
            "which of range, depth, amplitude, ambient, flags, samples, phasors (not of pulsed cameras), "
            "truth_range, truth_normal, exposure (of cameras with several), light_sigma (not of pulsed "
            "cameras), color (of "
            "those with a colour lens); empty: the first five");
  }

  /// What the keys say of the light, into a camera's request.
  void applyTo(sim::TraceRequest& request) const {
    request.sampler = sampler;
    request.samples_per_pixel = samples_per_pixel;
    request.wanted_noise = light_noise;
    request.max_surfaces = max_surfaces;
    request.pixel_extent = pixel_extent;
    request.seed = seed;
  }
};

}  // namespace toftwin::drivers::simulator
