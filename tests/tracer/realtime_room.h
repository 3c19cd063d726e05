// SPDX-License-Identifier: Apache-2.0
// A room in front of a Kinect's emitter, and how far light in real time is from the exact one there.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "sim/tracer/realtime.h"
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {

inline constexpr int kWidth = 256, kHeight = 212;

/// A closed room with a white thing in it.
inline std::string roomWith(const std::string& thing) {
  return R"(
    [[material]]
    name = "white"
    albedo = 0.8
    [[object]]
    shape = "box"
    size_m = [4, 2.5, 5]
    position_m = [0, 0, 2]
    material = "white"
    [[object]]
    material = "white"
    )" + thing;
}

/// With a ball whose middle is at x.
inline std::string room(double x, const std::string& motion = "") {
  return roomWith(fmt::format("shape = 'sphere'\nradius_m = 0.4\nposition_m = [{}, 0.1, 2.2]\n{}", x, motion));
}

/// The middle of a Kinect's image: as many pixels per degree, and its emitter.
inline TraceRequest roomRequest() {
  TraceRequest request = requestFor(kWidth, kHeight, 365.0, {80_MHz, 16_MHz, 120_MHz});
  request.emitters = {EmitterSpec{.position_m = {0.045, 0.0, 0.0}, .half_angle = 45.0 * degree}};
  request.max_surfaces = 16;
  request.pixel_extent = 1.0;
  return request;
}

inline double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

/// How far a pixel's light is from the exact one, in mm of range at 80 MHz.
inline double errorOf(const Light& light, int x, int y, Complex exact) {
  return std::abs(std::arg(phasorAt(light, 0, x, y) * std::conj(exact))) / (2.0 * wavenumber(80_MHz)) * 1e3;
}

/// Frame after frame of scenes and requests; the last one's light.
struct Frames {
  RealtimeTracer tracer;
  const Light* light = nullptr;
  void next(const Scene& scene, const TraceRequest& request) { light = &tracer.next(scene, request); }
};

}  // namespace toftwin::sim::testing
