// SPDX-License-Identifier: Apache-2.0
// Light by its time of arrival, and light of other cameras.
#include "sim/tracer/foreign.h"
#include "sim/tracer/transient.h"
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {
namespace {

constexpr auto kRoom =
    "[[material]]\nname = 'm'\nalbedo = 0.7\n[[object]]\nshape = 'box'\nsize_m = [4, 3, 5]\n"
    "position_m = [0, 0, 1]\nmaterial = 'm'\n";

void expectNear(Complex is, Complex exact) {
  EXPECT_LT(std::abs(is - exact), 2e-7)
      << is << " instead of " << exact;  // single precision of radiance 0.05
}

/// The same paths as trace() takes: their phasor from the bins is off by at most the light times half a bin's
/// phase.
TEST(Transient, GivesThePhasorsWithinABinsWidth) {
  TraceRequest request = requestFor(8, 6, 6.0, {16_MHz, 80_MHz});
  request.samples_per_pixel = 64;
  request.max_surfaces = 5;
  const Scene scene = sceneOf(kRoom);
  const Light light = trace(scene, request);
  for (const Length width : {1_cm, 4_cm}) {
    const TransientBins bins{1_m, width, static_cast<int>(60.0 / width.in(metre))};
    const Transient transient = traceTransient(scene, request, bins);
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 8; ++x) {
        double sum = 0.0;
        for (const auto& image : transient.radiance) sum += static_cast<double>(image(x, y));
        EXPECT_NEAR(sum, static_cast<double>(light.steady(x, y)), 1e-5 * sum);
        EXPECT_EQ(transient.outside(x, y), 0.0f);
        for (std::size_t f = 0; f < 2; ++f) {
          const double bound = sum * wavenumber(light.frequencies[f]) * width.in(metre) / 2.0;
          EXPECT_LT(std::abs(transient.phasor(light.frequencies[f], x, y) - phasorAt(light, f, x, y)), bound)
              << x << y;
        }
      }
    }
  }
}

/// A wall with the light in the pinhole: everything arrives at 2r, in one bin; without that bin it is
/// outside.
TEST(Transient, PutsDirectLightIntoTheBinOfItsWay) {
  const Scene scene = sceneOf(
      "[[material]]\nname = 'm'\nalbedo = 0.7\n[[object]]\nshape = 'rectangle'\nsize_m = [9, 9, 0]\n"
      "position_m = [0, 0, 2]\nmaterial = 'm'\n");
  const TraceRequest request = requestFor(1, 1, 1.0, {});
  const Transient transient = traceTransient(scene, request, {3.95_m, 10_cm, 3});
  EXPECT_NEAR(static_cast<double>(transient.radiance[0](0, 0)), 0.7 / kPi / 4.0, 1e-7);
  EXPECT_EQ(transient.radiance[1](0, 0) + transient.radiance[2](0, 0) + transient.outside(0, 0), 0.0f);
  EXPECT_NEAR(static_cast<double>(traceTransient(scene, request, {5_m, 10_cm, 3}).outside(0, 0)),
              0.7 / kPi / 4.0, 1e-7);
  EXPECT_THROW(traceTransient(scene, request, {5_m, 0_cm, 3}), std::invalid_argument);
}

TEST(Transient, TellsItsRowsAndEndsWhenAskedTo) {
  const Scene scene = sceneOf(
      "[[material]]\nname = 'm'\nalbedo = 0.7\n[[object]]\nshape = 'rectangle'\nsize_m = [99, 99, 0]\n"
      "position_m = [0, 0, 2]\nmaterial = 'm'\n");
  const TraceRequest request = requestFor(3, 40, 20.0, {});
  std::vector<int> told;
  const Transient whole = traceTransient(scene, request, {3_m, 1_m, 9}, [&](int rows) {
    told.push_back(rows);
    return true;
  });
  EXPECT_EQ(told, (std::vector<int>{16, 32, 40}));
  const Transient part = traceTransient(scene, request, {3_m, 1_m, 9}, [](int rows) { return rows < 16; });
  EXPECT_EQ(part.radiance[1](1, 15), whole.radiance[1](1, 15));
  EXPECT_GT(whole.radiance[1](1, 16), 0.0f);
  for (const auto& image : part.radiance) EXPECT_EQ(image(1, 16), 0.0f);
}

/// A foreign light at a known place: its own way, its mean as charge, its beat as the closed form says.
TEST(ForeignLight, BeatsWithTheCamerasOwn) {
  const Scene scene = sceneOf(
      "[[material]]\nname = 'm'\nalbedo = 0.7\n[[object]]\nshape = 'rectangle'\nsize_m = [9, 9, 0]\n"
      "position_m = [0, 0, 2]\nmaterial = 'm'\n[[foreign_emitter]]\nposition_m = [1.5, 0, 0]\nisotropic = "
      "true\n"
      "power_w = 6.283185307\nfrequency_mhz = 80.001\nmodulation = 0.8\nphase_deg = 30\n");
  TraceRequest request = requestFor(1, 1, 1.0, {80_MHz});
  ASSERT_EQ(scene.foreignEmitters().size(), 1u);
  const ForeignEmitterSpec& emitter = scene.foreignEmitters()[0];
  // The camera looks the same way from further left, turned about its axis: the emitter stays in the world.
  request.world_from_camera = rotation<World, Camera>({0, 0, 1}, 0.7);
  const Light foreign = trace(scene, foreignRequest(emitter, request));
  const double d = 2.5, radiance = 0.7 / kPi * 0.5 * (2.0 / d) / (d * d);
  const Complex way = std::polar(radiance, -wavenumber(emitter.frequency) * (2.0 + d));
  expectNear(phasorAt(foreign, 0, 0, 0), way);
  const Light own = trace(scene, request);
  for (const double t : {0.0, 0.3e-3, 1.77e-3}) {
    Light light = own;
    addForeignLight(emitter, foreign, 80_MHz, t * 1_s, 200_us, 0_s, light);
    const double x = kPi * 1000.0 * 200e-6, turns = 1000.0 * t;
    const Complex added = 0.8 * way * std::polar(std::sin(x) / x, 2.0 * kPi * turns + kPi / 6.0);
    expectNear(phasorAt(light, 0, 0, 0) - phasorAt(own, 0, 0, 0), added);
    EXPECT_NEAR(static_cast<double>(light.ambient(0, 0) - own.ambient(0, 0)), radiance, 1e-7);
  }
  // A whole number of beats within the exposure leaves charge alone.
  Light light = own;
  addForeignLight(emitter, foreign, 80_MHz, 0_s, 1_ms, 0_s, light);
  EXPECT_LT(std::abs(phasorAt(light, 0, 0, 0) - phasorAt(own, 0, 0, 0)), 1e-7);
}

}  // namespace
}  // namespace toftwin::sim::testing
