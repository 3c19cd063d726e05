// SPDX-License-Identifier: Apache-2.0
// The tracer against exact answers. Symbols: r range, k = 2πf/c, ρ albedo, I radiant intensity.
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {
namespace {

constexpr auto kWall = R"(
[[material]]
name = "white"
albedo = 0.8
[[object]]
shape = "rectangle"
size_m = [40, 40, 0]
position_m = [0, 0, 2]
euler_deg = [{tilt}, 0, 0]
material = "white"
)";

std::string wallTilted(int degrees) {
  std::string text = kWall;
  return text.replace(text.find("{tilt}"), 6, std::to_string(degrees));
}

/// P = ρI/π · cos θ / r² · e^{−2ikr}: a wall with the light in the pinhole is measured exactly, however
/// it is tilted. Precision: the sines' 2e-7 and a few roundings to single precision.
TEST(Wall, HasExactlyItsRangeAndRadianceAtEveryTilt) {
  for (const int tilt : {0, 20, 60}) {
    const Scene scene = sceneOf(wallTilted(tilt));
    const Light light = trace(scene, requestFor(9, 7, 6.0, {80_MHz, 16_MHz, 120_MHz}));
    for (int y = 0; y < light.height(); ++y) {
      for (int x = 0; x < light.width(); ++x) {
        const double dx = (x - 4) / 6.0, dy = (y - 3) / 6.0;
        const double t = tilt * kPi / 180.0;
        // The wall's normal is (0, −sin t, cos t); it stands at z = 2 on the axis.
        const double along = -std::sin(t) * dy + std::cos(t);
        const double z = 2.0 * std::cos(t) / along, r = z * std::sqrt(dx * dx + dy * dy + 1.0);
        const double cosine = std::abs(along) / std::sqrt(dx * dx + dy * dy + 1.0);
        EXPECT_NEAR(light.truth.range_m(x, y), r, 1e-6 * r);
        for (std::size_t f = 0; f < 3; ++f) {
          const Complex exact = std::polar(0.8 / kPi * cosine / (r * r), -2.0 * wavenumber(light.frequencies[f]) * r);
          EXPECT_LT(std::abs(phasorAt(light, f, x, y) - exact), 5e-7 * std::abs(exact)) << tilt << " deg " << x << " " << y;
          EXPECT_NEAR(rangeError(phasorAt(light, f, x, y), light.frequencies[f], r), 0.0, 1e-5);
        }
      }
    }
  }
}

/// The integrating sphere with camera and light in its centre (closed form):
///   P = ρI/(πR²) · e^{−2ikR} · (1 − (ρΦ)^N) / (1 − ρΦ),  Φ = [(1 + 2ikR) e^{−2ikR} − 1] / (2k²R²)
TEST(IntegratingSphere, GivesTheClosedFormOfAllBounces) {
  for (const double albedo : {0.5, 0.8}) {
    const Scene scene = sceneOf("[[material]]\nname = 'm'\nalbedo = " + std::to_string(albedo) +
                                "\n[[object]]\nshape = 'sphere'\nradius_m = 1\nmaterial = 'm'\n");
    TraceRequest request = requestFor(4, 4, 4.0, {16_MHz, 80_MHz, 120_MHz});
    request.samples_per_pixel = 4096;
    for (const int surfaces : {1, 2, 5, 60}) {
      request.max_surfaces = surfaces;
      const Light light = trace(scene, request);
      for (std::size_t f = 0; f < 3; ++f) {
        const double k = wavenumber(light.frequencies[f]);
        const Complex i{0.0, 1.0}, turn = std::polar(1.0, -2.0 * k);
        const Complex phi = ((1.0 + 2.0 * i * k) * turn - 1.0) / (2.0 * k * k);
        const Complex exact = albedo / kPi * turn * (1.0 - std::pow(albedo * phi, surfaces)) / (1.0 - albedo * phi);
        Complex mean;
        double variance = 0.0;
        for (int p = 0; p < 16; ++p) {
          mean += phasorAt(light, f, p % 4, p / 4) / 16.0;
          variance += static_cast<double>(light.variance[f](p % 4, p / 4)) / 256.0;
        }
        EXPECT_LT(std::abs(mean - exact), 3.5 * std::sqrt(2.0 * variance) + 1e-6)
            << "albedo " << albedo << " surfaces " << surfaces << " f " << f << " exact " << exact << " is " << mean
            << " sigma " << std::sqrt(variance);
      }
    }
  }
}

}  // namespace
}  // namespace toftwin::sim::testing
