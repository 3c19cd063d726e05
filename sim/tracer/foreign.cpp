// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/foreign.h"

#include <cmath>
#include <complex>
#include <numbers>

namespace toftwin::sim {

TraceRequest foreignRequest(const ForeignEmitterSpec& emitter, const TraceRequest& own) {
  const auto& p = emitter.position_m;
  const auto& a = emitter.axis;
  const Transform<Camera, World> camera_from_world = own.world_from_camera.inverse();
  TraceRequest request = own;
  request.emitters = {{.position_m = (camera_from_world * Point<World>{{p[0], p[1], p[2]}}).m,
                       .axis = camera_from_world.rotate(normalised(Vec3d{a[0], a[1], a[2]})),
                       .radius = emitter.radius,
                       .power_w = emitter.power_w,
                       .lobe_exponent = emitter.lobe_exponent,
                       .half_angle = emitter.half_angle,
                       .isotropic = emitter.isotropic}};
  request.frequencies = {emitter.frequency};
  request.harmonics = 1;
  request.gates.clear();
  request.seed = own.seed ^ 0x6a09e667f3bcc909u;  // its paths' noise is its own
  return request;
}

void addForeignLight(const ForeignEmitterSpec& emitter, const Light& foreign, Frequency f, Duration middle,
                     Duration exposure, Duration row_delay, Light& light) {
  const double beat = emitter.frequency.in(hertz)-f.in(hertz);
  const double half_turns = std::numbers::pi * beat * exposure.in(second);
  const double left = std::abs(half_turns) < 1e-8 ? 1.0 : std::sin(half_turns) / half_turns;
  const auto factorOf = [&](int row) {
    const double turns = std::remainder(beat * (middle + row * row_delay).in(second), 1.0);
    return std::complex<float>{
        std::polar(emitter.modulation * left, 2.0 * std::numbers::pi * turns + emitter.phase.in(radian))};
  };
  for (std::size_t i = 0; i < light.ambient.size(); ++i) light.ambient[i] += foreign.steady[i];
  for (std::size_t of = 0; of < light.frequencies.size(); ++of) {
    if (light.frequencies[of] != f) continue;
    Image<std::complex<float>>& sum = light.phasor(of, 1);
    const Image<std::complex<float>>& added = foreign.phasor(0, 1);
    for (int y = 0; y < sum.height(); ++y) {
      const std::complex<float> factor = factorOf(y);
      for (int x = 0; x < sum.width(); ++x) sum(x, y) += factor * added(x, y);
    }
  }
}

}  // namespace toftwin::sim
