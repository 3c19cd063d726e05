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

/// LED beside the lens: the light's way is (|p − L| + |p|), on the axis z + √(z² + b²); bias
/// (√(z² + b²) − z)/2 = 1.2469 mm at z = 0.5 m, 0.3125 mm at 2 m for b = 5 cm.
TEST(Emitter, BesideTheLensMakesNearThingsSeemFurther) {
  for (const auto& [z, bias_mm] : {std::pair{0.5, 1.2469}, std::pair{2.0, 0.3125}}) {
    const Scene scene = sceneOf("[[material]]\nname = 'm'\n[[object]]\nshape = 'rectangle'\nsize_m = [9, 9, 0]\n"
                                "position_m = [0, 0, " + std::to_string(z) + "]\nmaterial = 'm'\n");
    TraceRequest request = requestFor(3, 1, 1.0, {80_MHz});
    request.emitters[0].position_m = {0.05, 0.0, 0.0};
    const Light light = trace(scene, request);
    EXPECT_NEAR(rangeError(phasorAt(light, 0, 1, 0), 80_MHz, z) * 1e3, bias_mm, 1e-4);
    for (const int x : {0, 2}) {
      const double px = (x - 1) * z, r = std::hypot(px, z), way = r + std::hypot(px - 0.05, z);
      EXPECT_NEAR(rangeError(phasorAt(light, 0, x, 0), 80_MHz, r), way / 2.0 - r, 1e-7);
    }
  }
}

/// Two emitters, one with a lobe: P = Σ ρ/π cos θ I(γ)/d² e^{−ik(d + r)}, I(γ) = Φ (m+1)/2π cos^m γ.
TEST(Emitter, LobesConesAndSeveralEmittersAddUp) {
  const Scene scene = sceneOf("[[material]]\nname = 'm'\nalbedo = 0.5\n[[object]]\nshape = 'rectangle'\n"
                              "size_m = [9, 9, 0]\nposition_m = [0, 0, 1]\nmaterial = 'm'\n");
  TraceRequest request = requestFor(5, 1, 2.0, {80_MHz});
  EmitterSpec lobe{.position_m = {-0.1, 0.0, 0.0}, .power_w = 2.0, .lobe_exponent = 3.0};
  EmitterSpec cone{.position_m = {0.1, 0.0, 0.0}, .axis = {0.0, 0.0, 2.0}, .power_w = 1.0, .lobe_exponent = 0.0,
                   .half_angle = 20.0 * degree};
  request.emitters = {lobe, cone};
  const Light light = trace(scene, request);
  for (int x = 0; x < 5; ++x) {
    const double px = (x - 2) / 2.0, r = std::hypot(px, 1.0), k = wavenumber(80_MHz);
    Complex exact;
    const auto add = [&](double at, double intensity_at_axis, double exponent, double limit_deg) {
      const double d = std::hypot(px - at, 1.0), cosine = 1.0 / d;
      if (cosine < std::cos(limit_deg * kPi / 180.0)) return;
      exact += std::polar(0.5 / kPi * cosine * intensity_at_axis * std::pow(cosine, exponent) / (d * d), -k * (d + r));
    };
    add(-0.1, 2.0 * 4.0 / (2.0 * kPi), 3.0, 90.0);
    add(0.1, 1.0 / (2.0 * kPi), 0.0, 20.0);
    EXPECT_LT(std::abs(phasorAt(light, 0, x, 0) - exact), 5e-7 * std::abs(exact)) << x;
  }
}

/// A disc is the mean over its area of point lights; here by a polar midpoint rule.
TEST(Emitter, ADiscIsTheMeanOfItsPoints) {
  const Scene scene = sceneOf("[[material]]\nname = 'm'\nalbedo = 0.5\n[[object]]\nshape = 'rectangle'\n"
                              "size_m = [9, 9, 0]\nposition_m = [0, 0, 0.4]\nmaterial = 'm'\n");
  TraceRequest request = requestFor(1, 1, 1.0, {120_MHz});
  request.emitters[0] = {.position_m = {0.1, 0.0, 0.0}, .radius = 10_cm, .power_w = kPi, .lobe_exponent = 1.0};
  request.samples_per_pixel = 100'000;
  const Light light = trace(scene, request);
  Complex exact;
  const int rings = 400, spokes = 400;
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < spokes; ++j) {
      const double r = 0.1 * std::sqrt((i + 0.5) / rings), phi = 2.0 * kPi * (j + 0.5) / spokes;
      const double d = std::hypot(0.1 + r * std::cos(phi), r * std::sin(phi), 0.4), cosine = 0.4 / d;
      exact += std::polar(0.5 / kPi * cosine * cosine / (d * d), -wavenumber(120_MHz) * (d + 0.4)) / double(rings * spokes);
    }
  }
  const double sigma = std::sqrt(static_cast<double>(light.variance[0](0, 0)));
  EXPECT_LT(sigma, 2e-3 * std::abs(exact));
  EXPECT_LT(std::abs(phasorAt(light, 0, 0, 0) - exact), 3.5 * std::sqrt(2.0) * sigma) << exact;
}

/// Beyond c/2f the phase starts anew: range modulo the unambiguous range.
TEST(Wrapping, AWallBeyondTheUnambiguousRangeSeemsNearer) {
  const double beyond = unambiguousRange(80_MHz).in(metre) + 0.75;
  const Scene scene = sceneOf("[[material]]\nname = 'm'\n[[object]]\nshape = 'rectangle'\nsize_m = [9, 9, 0]\n"
                              "position_m = [0, 0, " + std::to_string(beyond) + "]\nmaterial = 'm'\n");
  const Light light = trace(scene, requestFor(1, 1, 1.0, {80_MHz}));
  const double phase = -std::arg(phasorAt(light, 0, 0, 0));
  EXPECT_NEAR(phase / (2.0 * wavenumber(80_MHz)), 0.75, 2e-6);
}

/// A pixel across an edge sees the area-weighted sum of both phasors: α A1 e^{−2ikd1} + (1−α) A2 e^{−2ikd2}.
TEST(FlyingPixel, IsTheAreaWeightedSumOfBothPhasors) {
  // One pixel of 0.1 mrad; the near plate ends 30 % into it. Ranges vary by less than 1e-8 m within.
  const double focal = 1e4, share = 0.3, edge = (share - 0.5) / focal;
  const Scene scene = sceneOf("[[material]]\nname = 'm'\nalbedo = 0.5\n[[object]]\nshape = 'rectangle'\nsize_m = [1, 9, 0]\n"
                              "position_m = [" + std::to_string(edge - 0.5) + ", 0, 1]\nmaterial = 'm'\n"
                              "[[object]]\nshape = 'rectangle'\nsize_m = [9, 9, 0]\nposition_m = [0, 0, 1.5]\nmaterial = 'm'\n");
  TraceRequest request = requestFor(1, 1, focal, {30_MHz, 120_MHz});
  request.pixel_extent = 1.0;
  request.samples_per_pixel = 40'000;
  const Light light = trace(scene, request);
  for (std::size_t f = 0; f < 2; ++f) {
    const double k = wavenumber(request.frequencies[f]);
    const Complex near = std::polar(0.5 / kPi, -2.0 * k), far = std::polar(0.5 / kPi / 2.25, -3.0 * k);
    const Complex exact = share * near + (1.0 - share) * far;
    // Only the hit count is random: it moves the sum along near − far.
    const double sigma = std::abs(near - far) * std::sqrt(share * (1.0 - share) / 40'000);
    EXPECT_LT(std::abs(phasorAt(light, f, 0, 0) - exact), 3.0 * sigma) << f;
    EXPECT_NEAR(std::sqrt(2.0 * static_cast<double>(light.variance[f](0, 0))), sigma, 0.02 * sigma);
  }
}

/// Wall at d ahead, wall at h behind the camera, H = d + h, on the axis:
///   Z2 = (ρ²I/π²) e^{−ikd} ∫ 2πs h (h²+s²)^{−3/2} H² (H²+s²)^{−2} e^{−ik(√(h²+s²) + √(H²+s²))} ds
/// d = 1.5, h = 0.5, ρ = 0.8: e = 256.34 mm at 16 MHz, 114.14 mm at 80 MHz.
TEST(ParallelWalls, TwoBouncesAgreeWithQuadrature) {
  const double d = 1.5, h = 0.5, albedo = 0.8, H = d + h;
  const Scene scene = sceneOf("[[material]]\nname = 'm'\nalbedo = 0.8\n[[object]]\nshape = 'rectangle'\nsize_m = [200, 200, 0]\n"
                              "position_m = [0, 0, 1.5]\nmaterial = 'm'\n[[object]]\nshape = 'rectangle'\n"
                              "size_m = [200, 200, 0]\nposition_m = [0, 0, -0.5]\nmaterial = 'm'\n");
  TraceRequest request = requestFor(1, 1, 1.0, {16_MHz, 80_MHz});
  request.max_surfaces = 2;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  request.samples_per_pixel = 500'000;  // instrumented builds look for other mistakes than millimetres
  const double wanted_sigma = 1.3e-3;
#else
  request.samples_per_pixel = 8'000'000;
  const double wanted_sigma = 0.3e-3;
#endif
  const Light light = trace(scene, request);
  for (const auto& [f, table_mm] : {std::pair{std::size_t{0}, 256.34}, std::pair{std::size_t{1}, 114.14}}) {
    const double k = wavenumber(request.frequencies[f]);
    Complex second;
    const double step = 1e-3;
    for (double t = -12.0; t < 12.0; t += step) {  // s = eᵗ
      const double s = std::exp(t), a = std::hypot(h, s), b = std::hypot(H, s);
      second += std::polar(step * s * 2.0 * kPi * s * h / (a * a * a) * H * H / (b * b * b * b), -k * (a + b + d));
    }
    second *= albedo * albedo / (kPi * kPi);
    const Complex first = std::polar(albedo / kPi / (d * d), -2.0 * k * d);
    const double expected = rangeError(first + second, request.frequencies[f], d);
    EXPECT_NEAR(expected * 1e3, table_mm, 0.01);
    const double sigma = rangeSigma(light, f, 0, 0);
    EXPECT_LT(sigma, wanted_sigma);
    EXPECT_NEAR(rangeError(phasorAt(light, f, 0, 0), request.frequencies[f], d), expected, 0.2e-3 + 3.0 * sigma);
  }
}

/// Harmonic n of frequency f is the fundamental of n f, and from the same paths: equal to rounding.
TEST(Harmonics, AreTheFundamentalsOfMultipleFrequencies) {
  const Scene scene = sceneOf("[[material]]\nname = 'm'\nalbedo = 0.8\n[[object]]\nshape = 'sphere'\nradius_m = 1.5\n"
                              "position_m = [0.2, 0.1, 0.3]\nmaterial = 'm'\n");
  TraceRequest request = requestFor(2, 2, 2.0, {16_MHz, 48_MHz, 112_MHz});
  request.harmonics = 7;
  request.max_surfaces = 4;
  request.samples_per_pixel = 64;
  const Light light = trace(scene, request);
  for (int p = 0; p < 4; ++p) {
    const double scale = static_cast<double>(light.steady(p % 2, p / 2));
    EXPECT_LT(std::abs(phasorAt(light, 0, p % 2, p / 2, 3) - phasorAt(light, 1, p % 2, p / 2)), 2e-6 * scale);
    EXPECT_LT(std::abs(phasorAt(light, 0, p % 2, p / 2, 7) - phasorAt(light, 2, p % 2, p / 2)), 4e-6 * scale);
  }
}

/// Oren & Nayar for light and viewer in one direction: ρ/π (A + B sin θ tan θ); A and B from their
/// equation 30, at σ = 30°.
TEST(OrenNayar, ScattersBackAsItsEquationSays) {
  const Scene scene = sceneOf("[[material]]\nname = 'm'\nmodel = 'oren-nayar'\nalbedo = 0.6\nsigma_deg = 30\n"
                              "[[object]]\nshape = 'rectangle'\nsize_m = [30, 30, 0]\nposition_m = [0, 0, 1]\nmaterial = 'm'\n");
  const Light light = trace(scene, requestFor(9, 1, 2.0, {80_MHz}));
  const double sigma2 = kPi * kPi / 36.0, a = 1.0 - 0.5 * sigma2 / (sigma2 + 0.33), b = 0.45 * sigma2 / (sigma2 + 0.09);
  for (int x = 0; x < 9; ++x) {
    const double tangent = std::abs(x - 4) / 2.0, cosine = 1.0 / std::hypot(tangent, 1.0);
    const double exact = 0.6 / kPi * (a + b * tangent * tangent * cosine) * cosine * cosine * cosine;
    EXPECT_NEAR(static_cast<double>(light.steady(x, 0)), exact, 1e-6 * exact) << x;
  }
}

/// Its second bounce: the reflected share of a plane lit from one direction must be what the sampled
/// bounces carry on. A white-furnace check: below a uniformly shining sky every direction of view gets
/// L ∫ f_r cos dω, here by a midpoint rule.
TEST(OrenNayar, BouncesCarryTheIntegralOfItsReflection) {
  const Scene scene = sceneOf("[ambient]\nradiance_w_per_m2_sr = 2\n[[material]]\nname = 'm'\nmodel = 'oren-nayar'\nalbedo = 0.6\n"
                              "sigma_deg = 40\n[[object]]\nshape = 'rectangle'\nsize_m = [30, 30, 0]\nposition_m = [0, 0, 1]\nmaterial = 'm'\n");
  TraceRequest request = requestFor(3, 1, 0.5, {});
  request.samples_per_pixel = 400'000;
  const Light light = trace(scene, request);
  const double sigma2 = std::pow(40.0 * kPi / 180.0, 2), a = 1.0 - 0.5 * sigma2 / (sigma2 + 0.33), b = 0.45 * sigma2 / (sigma2 + 0.09);
  for (int x = 0; x < 3; ++x) {
    const double viewer = std::atan(std::abs(x - 1) / 0.5);
    double integral = 0.0;
    const int n = 600;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        const double theta = (i + 0.5) / n * kPi / 2.0, phi = (j + 0.5) / n * 2.0 * kPi;
        const double shape = a + b * std::max(0.0, std::cos(phi)) * std::sin(std::max(theta, viewer)) * std::tan(std::min(theta, viewer));
        integral += shape * std::cos(theta) * std::sin(theta) * (kPi / 2.0 / n) * (2.0 * kPi / n) / kPi;
      }
    }
    // The weights lie between 0 and 1.2: the mean of 400,000 is within 0.3 % with 5 sigma.
    EXPECT_NEAR(static_cast<double>(light.ambient(x, 0)), 2.0 * 0.6 * integral, 0.003 * 2.0 * 0.6) << x;
  }
}

/// A convex body of albedo ρ under a uniform sky of radiance L shines ρL; nothing at all shines L.
TEST(Ambient, AConvexBodyReflectsTheSkysRadiance) {
  const Scene scene = sceneOf("[ambient]\nradiance_w_per_m2_sr = 3\n[[material]]\nname = 'm'\nalbedo = 0.4\n"
                              "[[object]]\nshape = 'sphere'\nradius_m = 0.5\nposition_m = [0, 0, 2]\nmaterial = 'm'\n");
  TraceRequest request = requestFor(9, 9, 9.0, {20_MHz});
  request.samples_per_pixel = 32;
  for (const int surfaces : {1, 3}) {
    request.max_surfaces = surfaces;
    const Light light = trace(scene, request);
    EXPECT_FLOAT_EQ(light.ambient(4, 4), 1.2f);
    EXPECT_FLOAT_EQ(light.ambient(0, 0), 3.0f);
    EXPECT_EQ(light.steady(0, 0), 0.0f);
    EXPECT_TRUE(std::isnan(light.truth.range_m(0, 0)));
  }
}

}  // namespace
}  // namespace toftwin::sim::testing
