// SPDX-License-Identifier: Apache-2.0
// Light by its time of arrival.
#include "sim/tracer/transient.h"
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {
namespace {

constexpr auto kRoom =
    "[[material]]\nname = 'm'\nalbedo = 0.7\n[[object]]\nshape = 'box'\nsize_m = [4, 3, 5]\n"
    "position_m = [0, 0, 1]\nmaterial = 'm'\n";

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

}  // namespace
}  // namespace toftwin::sim::testing
