// SPDX-License-Identifier: Apache-2.0
// What is no effect but falls out of light, waveform, footprint and time (docs/consequences.md): small scenes
// from the tracer to the range, without noise.
#include <cmath>
#include <stdexcept>

#include "sim/sensor/collect_moving.h"
#include "sim/tracer/trace.h"
#include "tests/sim/camera_testing.h"
#include "tests/sim/figures/canvas.h"
#include "tests/sim/figures/figures.h"

namespace toftwin::sim::figures {
namespace {

constexpr int kWidth = 64, kHeight = 48;

/// 64 × 48 pixels, four steps of two taps; `modulation` and `sampling` are lines of these tables.
SensorModel camera(const std::string& modulation, const std::string& emitter_mm = "[0, 0, 0]",
                   const std::string& sampling = "") {
  return modelOf(
      "[lens]\nwidth = 64\nheight = 48\nfx = 62\nfy = 62\ncx = 31.5\ncy = 23.5\n[[emitter]]\nposition_mm = " +
      emitter_mm + "\nhalf_angle_deg = 60\n" + modulation + "[sampling]\nsteps = 4\ntaps = 2\n" + sampling +
      "[pixel]\nelectrons_per_radiance_s = 4e8\n");
}
std::string modulation(double frequency_MHz, const std::string& more = {}) {
  return "[[modulation]]\nfrequency_mhz = " + std::to_string(frequency_MHz) +
         "\nexposure_us = 1000\ncontrast = 0.5\n" + more;
}

Scene sceneOf(const std::string& objects) {
  auto scene = Scene::parse("[[material]]\nname = 'white'\nalbedo = 0.8\n[[material]]\nname = 'grey'\n"
                            "albedo = 0.3\n" + objects, "figure.toml");
  if (!scene) throw std::runtime_error{scene.error().message};
  return *std::move(scene);
}
std::string rectangle(const std::string& size, const std::string& position, const std::string& turned,
                      const std::string& material) {
  return "[[object]]\nshape = 'rectangle'\nsize_m = " + size + "\nposition_m = " + position +
         "\neuler_deg = " + turned + "\nmaterial = '" + material + "'\n";
}
std::string boxBeforeWall(const std::string& motion = {}) {
  return rectangle("[8, 6, 0]", "[0, 0, 2.4]", "[0, 0, 0]", "grey") +
         "[[object]]\nshape = 'box'\nsize_m = [0.4, 0.5, 0.3]\nposition_m = [0, 0.15, 1.1]\n"
         "euler_deg = [0, 25, 0]\nmaterial = 'white'\n" + motion;
}
/// A wide plane that is this far on the axis and leans back by 60°: from 0.6 to 2.9 times as far.
std::string slope(const std::string& distance_m) {
  return rectangle("[80, 80, 0]", "[0, 0, " + distance_m + "]", "[-60, 0, 0]", "white");
}
std::string corner() {
  return rectangle("[1, 1, 0]", "[0.35355339, 0, 1.14644661]", "[0, 45, 0]", "white") +
         rectangle("[1, 1, 0]", "[-0.35355339, 0, 1.14644661]", "[0, -45, 0]", "white");
}

struct Rays {
  int samples = 16;
  int surfaces = 1;
  double footprint = 1.0;
};
struct Seen {
  RangeImage range;
  Truth truth;
};
Seen look(const SensorModel& model, const Scene& scene, const Rays& rays) {
  TraceRequest request = model.traceRequest();
  request.samples_per_pixel = rays.samples;
  request.max_surfaces = rays.surfaces;
  request.pixel_extent = rays.footprint;
  Moment moment;
  moment.exposures = model.exposures(DeviceTime{});
  if (!scene.moves()) {
    const Light light = trace(scene, request);
    return {model.expose(light, moment, 1, 0).range, light.truth};
  }
  Light light;
  Truth truth;
  auto collected = collectMoving(model, moment, 1, 0, [&](std::size_t e) {
    light = trace(scene.at(middleOf(moment.exposures[e])), request);
    if (e == moment.exposures.size() / 2) truth = light.truth;
    return &light;
  });
  return {model.readOut(*std::move(collected), moment, 1, 0).range, truth};
}

Image<float> error_mm(const Seen& seen) {
  Image<float> error{kWidth, kHeight};
  for (std::size_t i = 0; i < error.size(); ++i)
    error[i] = 1e3F * (seen.range.range_m[i] - seen.truth.range_m[i]);
  return error;
}

std::string errors(double most_mm, std::vector<Panel> panels) {
  return standalone(Panels{.label = "error of the range, mm",
                           .low = -most_mm,
                           .high = most_mm,
                           .diverging = true,
                           .panels = std::move(panels)});
}

std::string wiggling() {
  const Scene scene = sceneOf(slope("3"));
  const auto with = [&](const std::string& waveform) {
    return error_mm(look(camera(modulation(15.0, "emitted = '" + waveform + "'\ndemodulated = '" + waveform + "'\n"),
                                "[0, 0, 0]", "harmonics = 15\n"),
                         scene, {.samples = 1, .footprint = 0.0}));
  };
  return errors(150.0, {{"sines", with("sine")}, {"square waves", with("square")}});
}

std::string wrapAround() {
  const Scene scene = sceneOf(slope("5"));
  const auto with = [&](const std::string& modulations) {
    return look(camera(modulations), scene, {.samples = 1, .footprint = 0.0}).range.range_m;
  };
  return standalone(Panels{.label = "range, m",
                           .low = 0.0,
                           .high = 15.0,
                           .panels = {{"30 MHz: it begins anew every 5 m", with(modulation(30.0))},
                                      {"30 and 40 MHz: every 15 m", with(modulation(30.0) + modulation(40.0))}}});
}

compare::Curve fromAbove(const RangeImage& image, std::string name, compare::Ink ink) {
  compare::Curve points{.name = std::move(name), .ink = ink, .stroke = compare::Stroke::Dots};
  for (int y = 14; y < 36; y += 2) {
    for (int x = 0; x < kWidth; ++x) {
      const double across = (x - 31.5) / 62.0, up = (y - 23.5) / 62.0;
      const double depth_m = static_cast<double>(image.range_m(x, y)) / std::sqrt(1.0 + across * across + up * up);
      points.x.push_back(across * depth_m);
      points.y.push_back(depth_m);
    }
  }
  return points;
}

std::string flyingPixels() {
  const Scene scene = sceneOf(boxBeforeWall());
  const SensorModel model = camera(modulation(30.0), "[40, 0, 0]");
  return standalone(compare::Plot{
      .title = "a box before a wall, seen from above",
      .x_label = "to the right, m",
      .y_label = "depth, m",
      .curves = {fromAbove(look(model, scene, {}).range, "whole pixels", compare::Ink::Published),
                 fromAbove(look(model, scene, {.samples = 1, .footprint = 0.0}).range, "their central rays alone",
                           compare::Ink::Simulated)},
      .y_range = std::pair{0.7, 2.6}});
}

std::string shadow() {
  const Scene scene = sceneOf(boxBeforeWall());
  const auto with = [&](const std::string& emitter_mm) {
    Image<float> amplitude = look(camera(modulation(30.0), emitter_mm), scene, {}).range.amplitude;
    for (float& value : amplitude.pixels()) value = std::log10(std::max(value, 1.0f));
    return amplitude;
  };
  return standalone(Panels{.label = "log10 of the amplitude, e-",
                           .low = 1.0,
                           .high = 4.5,
                           .panels = {{"light from the lens", with("[0, 0, 0]")},
                                      {"100 mm to its right", with("[100, 0, 0]")}}});
}

std::string multipath() {
  const Scene scene = sceneOf(corner());
  const SensorModel model = camera(modulation(80.0));
  return errors(80.0, {{"direct light", error_mm(look(model, scene, {.footprint = 0.0}))},
                       {"over up to 8 surfaces",
                        error_mm(look(model, scene, {.samples = 512, .surfaces = 8, .footprint = 0.0}))}});
}

std::string motion() {
  const SensorModel model = camera(modulation(30.0), "[0, 0, 0]", "gap_us = 1000\n");
  const auto with = [&](const std::string& velocity) {
    return error_mm(look(model, sceneOf(boxBeforeWall("velocity_m_per_s = " + velocity + "\n")), {}));
  };
  return errors(200.0, {{"3 m/s to the right", with("[3, 0, 0]")}, {"3 m/s towards the camera", with("[0, 0, -3]")}});
}

}  // namespace

void addConsequenceFigures(std::map<std::string, Draw>& figures) {
  figures["consequence_wiggling"] = wiggling;
  figures["consequence_wrap_around"] = wrapAround;
  figures["consequence_flying_pixels"] = flyingPixels;
  figures["consequence_shadow"] = shadow;
  figures["consequence_multipath"] = multipath;
  figures["consequence_motion"] = motion;
}

}  // namespace toftwin::sim::figures
