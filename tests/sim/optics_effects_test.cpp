// SPDX-License-Identifier: Apache-2.0
// What the way from the scene through the lens to the pixel does wrong.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/sim/phase_rig.h"

namespace toftwin::sim {
namespace {

Light applied(const auto& effect, const Light& light, const CameraInfo& camera) {
  return effect.apply(light, {Moment{}, camera}, Random{1, 1, 1});
}

double phaseOf(const std::complex<float>& phasor) {
  return -std::arg(std::complex<double>{phasor});
}
double phaseAt(double range_m, double hz) { return 4.0 * kPi * hz * range_m / kSpeedOfLight_m_per_s; }

// A white box at 1 m that covers a fifth of the image, before a wall at 4 m of the same albedo; 1 % of all
// light is an even veil. The wall's own phasor a_b gets s·a_f of the box's phase:
//     δφ = atan2(s a_f sin Δ, a_b + s a_f cos Δ),  Δ = φ_f − φ_b
TEST(LensScatter, OfABoxPushesTheWallBehindItFarther) {
  constexpr double kHz = 30e6, kShare = 0.01, kBox = 0.2;
  const Light light = syntheticLight(100, 50, {30_MHz}, 1, [&](int x, int) {
    return std::vector<Way>{x < 20 ? Way{1.0, 1.0} : Way{1.0 / 16.0, 4.0}};
  });
  const Light seen =
      applied(LensScatter{.veil = kShare, .halo = 0.0}, light, cameraOfSize(100, 50));
  const double delta = phaseAt(1.0, kHz) - phaseAt(4.0, kHz);
  const double wall = (1.0 - kShare * kBox) / 16.0, stray = kShare * kBox;
  const double expected =
      std::atan2(stray * std::sin(delta), wall + stray * std::cos(delta));
  const double error = std::remainder(phaseOf(seen.phasor(0, 1)(70, 20)) - phaseAt(4.0, kHz), 2.0 * kPi);
  EXPECT_NEAR(error, expected, 1e-6);
  const double mm = 1e3 * error * unambiguousRange(30_MHz).in(metre) / (2.0 * kPi);
  EXPECT_NEAR(mm, 15.0, 0.5);  // worked by hand: 0.032 · 0.59 rad; the sign comes from sin Δ > 0
}

// The source of scatter is light, not charge: a pixel that is full scatters as what shines on it does.
TEST(LensScatter, ComesFromOverexposedLightUnclipped) {
  const SensorModel model = modelOf(plainCamera(
      4, 2, 0.5,
      "[[effect]]\ntype = 'saturation'\nfull_well_electrons = 50000\n[[effect]]\ntype = "
      "'lens_scatter'\nveil = 0.01\nhalo = 0\n"));
  const auto wallBehind = [&](double radiance) {
    const Light light = syntheticLight(400, 250, {80_MHz}, 1, [&](int x, int) {
      return std::vector<Way>{x < 40 ? Way{radiance, 0.3} : Way{1.0, 1.0}};
    });
    const RangeImage image = model.expose(light, {}, 1, 0).range;
    EXPECT_TRUE(image.flags(3, 3) & static_cast<unsigned>(PixelFlag::Saturated));
    return static_cast<double>(image.range_m(300, 100)) - 1.0;
  };
  const double once = wallBehind(20.0), twice = wallBehind(40.0);
  EXPECT_GT(std::abs(once), 1e-3);
  EXPECT_GT(twice / once, 1.8);  // linear but for the angle's own curvature
  EXPECT_LT(twice / once, 2.2);
}

// The wide halo is recursive; the exact one is the sum over all pixels of the Gaussian. A bright box, and
// the image's border, beyond which it is dark.
TEST(LensScatter, WideHaloIsTheGaussianWithinAThousandthOfItsPeak) {
  for (double sigma : {6.0, 9.0, 12.0, 15.0, 33.0}) {
    const auto boxAt = [](int x, int y) { return x >= 41 && x < 52 && y >= 23 && y < 30 ? 1.0 : 0.0; };
    const Light light = syntheticLight(150, 100, {20_MHz}, 1, [&](int x, int y) {
      return std::vector<Way>{{boxAt(x, y), 1.0}};
    });
    const Light seen = applied(LensScatter{.veil = 0.0, .halo = 0.5, .halo_radius = sigma}, light,
                               cameraOfSize(150, 100));
    std::vector<double> gaussian;
    double sum = 0.0;
    const int reach = static_cast<int>(std::ceil(7.0 * sigma));
    for (int i = -reach; i <= reach; ++i) {
      gaussian.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
      sum += gaussian.back();
    }
    const auto at = [&](int i) {
      return std::abs(i) > reach ? 0.0 : gaussian[static_cast<std::size_t>(i + reach)] / sum;
    };
    const double peak = 0.5 * 77.0 / (2.0 * kPi * sigma * sigma);  // of 77 pixels in one point
    for (const auto& [x, y] : {std::pair{46, 26}, {60, 26}, {41, 50}, {0, 0}, {75, 3}, {149, 99}}) {
      double expected = 0.0;
      for (int v = 23; v < 30; ++v) {
        for (int u = 41; u < 52; ++u) expected += 0.5 * at(x - u) * at(y - v);
      }
      expected += 0.5 * boxAt(x, y);
      EXPECT_NEAR(seen.steady(x, y), expected, 1e-3 * peak) << sigma << ": " << x << ' ' << y;
    }
  }
}

TEST(LensGhost, PutsTheMirroredPixelsShareIntoEachPixelAndKeepsAllLight) {
  CameraInfo camera = cameraOfSize(41, 31);
  camera.cx = 20.0, camera.cy = 15.0;
  const Light light = syntheticLight(41, 31, {20_MHz}, 2, [](int x, int y) {
    return std::vector<Way>{{x == 12 && y == 10 ? 5.0 : 0.0, 1.3}};
  });
  const Light seen = applied(LensGhost{.share = 0.02, .right = 1.0, .down = 0.0}, light, camera);
  EXPECT_NEAR(seen.steady(2 * 21 - 12, 2 * 15 - 10), 0.02 * 5.0, 1e-6);
  EXPECT_NEAR(seen.steady(12, 10), 0.98 * 5.0, 1e-6);
  EXPECT_NEAR(phaseOf(seen.phasor(0, 2)(30, 20)), std::remainder(2.0 * phaseAt(1.3, 20e6), 2.0 * kPi), 1e-6);
  double sum = 0.0;
  for (float steady : seen.steady.pixels()) sum += static_cast<double>(steady);
  EXPECT_NEAR(sum, 5.0, 1e-6);
}

// What turns it need not be in the middle of a pixel or between two: a search that moves it sees each step.
TEST(LensGhost, IsLinearBetweenPixels) {
  CameraInfo camera = cameraOfSize(41, 31);
  camera.cx = 20.0, camera.cy = 15.0;
  const Light light = syntheticLight(
      41, 31, {20_MHz}, 2, [](int x, int y) { return std::vector<Way>{{x == 12 && y == 10 ? 5.0 : 0.0, 1.3}}; });
  const Light seen = applied(LensGhost{.share = 0.02, .right = 1.1, .down = -0.05}, light, camera);
  // At 30.2, 19.9.
  EXPECT_NEAR(seen.steady(30, 20), 0.02 * 5.0 * 0.8 * 0.9, 1e-6);
  EXPECT_NEAR(seen.steady(31, 20), 0.02 * 5.0 * 0.2 * 0.9, 1e-6);
  EXPECT_NEAR(seen.steady(30, 19), 0.02 * 5.0 * 0.8 * 0.1, 1e-6);
  EXPECT_NEAR(seen.steady(31, 19), 0.02 * 5.0 * 0.2 * 0.1, 1e-6);
}

Learned learnedFrom(const std::vector<std::string>& texts) {
  const Learned learned{.title = {}, .terms = LearnedTerms::parsed(texts)};
  EXPECT_EQ(learned.problem(), "");
  return learned;
}

// One bright pixel of phase φ among dark ones: a square of reach 2 has a 25th of it, or, where the image ends
// after 3 × 3 of its pixels, a 9th.
TEST(LearnedLight, PutsItsShareOfASquaresMeanIntoEachPixel) {
  const Light light = syntheticLight(11, 9, {20_MHz}, 2, [](int x, int y) {
    return std::vector<Way>{{(x == 5 && y == 4) || (x == 0 && y == 0) ? 5.0 : 0.0, 1.3}};
  });
  const Learned square = learnedFrom({"light_percent += 4 * square(2)"});
  const Light seen = applied(square, light, cameraOfSize(11, 9));
  EXPECT_NEAR(seen.steady(7, 6), 0.04 * 5.0 / 25.0, 1e-6);
  EXPECT_NEAR(seen.steady(8, 6), 0.0, 1e-9) << "3 columns away";
  EXPECT_NEAR(seen.steady(5, 4), 5.0 + 0.04 * 5.0 / 25.0, 1e-6) << "itself included";
  EXPECT_NEAR(seen.steady(0, 0), 5.0 + 0.04 * 5.0 / 9.0, 1e-6) << "squares end at the image's edge";
  EXPECT_NEAR(phaseOf(seen.phasor(0, 2)(7, 6)), std::remainder(2.0 * phaseAt(1.3, 20e6), 2.0 * kPi), 1e-6);
}

TEST(LearnedLight, AddsUpItsSquaresOfTheLightAsItCame) {
  const Light light = syntheticLight(30, 20, {20_MHz}, 1, [](int x, int) {
    return std::vector<Way>{x < 10 ? Way{3.0, 0.7} : Way{1.0, 2.1}};
  });
  const CameraInfo camera = cameraOfSize(30, 20);
  const Light both = applied(learnedFrom({"light_percent += -2 * square(1)", "light_percent += 3 * square(100)"}), light, camera),
              near = applied(learnedFrom({"light_percent += -2 * square(1)"}), light, camera),
              far = applied(learnedFrom({"light_percent += 3 * square(100)"}), light, camera);
  EXPECT_NEAR(far.steady(17, 3), 1.0 + 0.03 * (10.0 * 3.0 + 20.0) / 30.0, 1e-6) << "the mean of all";
  for (int x = 0; x < 30; ++x) {
    const auto sum = near.phasor(0, 1)(x, 7) + far.phasor(0, 1)(x, 7) - light.phasor(0, 1)(x, 7);
    EXPECT_NEAR(std::abs(both.phasor(0, 1)(x, 7) - sum), 0.0, 1e-6) << x;
  }
}

// Of a row of 11 pixels and a column of 9 with one bright one.
TEST(LearnedLight, PutsItsShareOfARowsAndAColumnsMeanIntoEachPixel) {
  const Light light = syntheticLight(
      11, 9, {20_MHz}, 2, [](int x, int y) { return std::vector<Way>{{x == 5 && y == 4 ? 5.0 : 0.0, 1.3}}; });
  const Learned lines = learnedFrom({"light_percent += 4 * row_mean()", "light_percent += -2 * column_mean()"});
  const Light seen = applied(lines, light, cameraOfSize(11, 9));
  EXPECT_NEAR(seen.steady(0, 4), 0.04 * 5.0 / 11.0, 1e-6);
  EXPECT_NEAR(seen.steady(5, 8), -0.02 * 5.0 / 9.0, 1e-6);
  EXPECT_NEAR(seen.steady(5, 4), 5.0 + 0.04 * 5.0 / 11.0 - 0.02 * 5.0 / 9.0, 1e-6) << "itself included";
  EXPECT_NEAR(seen.steady(4, 3), 0.0, 1e-9) << "in neither";
}

// As the ghost does, but for the light that is missing at its source; and between pixels.
TEST(LearnedLight, PutsItsShareOfTheMirroredPlaceIntoEachPixel) {
  CameraInfo camera = cameraOfSize(41, 31);
  camera.cx = 20.0, camera.cy = 15.0;
  const Light light = syntheticLight(41, 31, {20_MHz}, 2, [](int x, int y) {
    return std::vector<Way>{{x == 12 && y == 10 ? 5.0 : 0.0, 1.3}};
  });
  const auto mirrored = [&](double reach, double right) {
    return applied(learnedFrom({"light_percent += 2 * mirror(" + std::to_string(reach) + ", " + std::to_string(right) + ", 0)"}),
                   light, camera);
  };
  const Light sharp = mirrored(0.0, 1.0);
  EXPECT_NEAR(sharp.steady(2 * 21 - 12, 2 * 15 - 10), 0.02 * 5.0, 1e-6);
  EXPECT_NEAR(sharp.steady(12, 10), 5.0, 1e-6);
  EXPECT_NEAR(phaseOf(sharp.phasor(0, 2)(30, 20)), std::remainder(2.0 * phaseAt(1.3, 20e6), 2.0 * kPi), 1e-6);
  const Light between = mirrored(0.0, 1.125);  // a quarter of a pixel farther
  EXPECT_NEAR(between.steady(30, 20), 0.75 * 0.02 * 5.0, 1e-6);
  EXPECT_NEAR(between.steady(31, 20), 0.25 * 0.02 * 5.0, 1e-6);
  const Light wide = mirrored(2.0, 1.0);
  EXPECT_NEAR(wide.steady(32, 22), 0.02 * 5.0 / 25.0, 1e-6);
  EXPECT_NEAR(wide.steady(33, 22), 0.0, 1e-9) << "3 columns away";
}

// s = (1/(1 + ε) − 1) r is a focal length that is longer by ε.
TEST(LearnedLight, IsALongerFocalLengthWhereItIsAShareOfTheRadius) {
  constexpr double kLonger = 0.01;
  CameraInfo camera = cameraOfSize(60, 40);
  camera.fx = camera.fy = 50.0, camera.cx = 29.5, camera.cy = 19.5;
  const Light light = syntheticLight(60, 40, {20_MHz}, 1, [](int x, int y) {
    return std::vector<Way>{
        {1.0 + 0.3 * std::sin(0.4 * x) + 0.1 * y, 1.0 + 0.02 * x + 0.2 * std::cos(0.3 * y)}};
  });
  const Light longer = applied(DistortionMisfit{.focal_error = kLonger}, light, camera);
  const Learned shift = learnedFrom({"outward_px += " + std::to_string(1.0 / (1.0 + kLonger) - 1.0) + " * radius_px"});
  const Light shifted = applied(shift, light, camera);
  for (const auto& [x, y] : {std::pair{0, 0}, {59, 39}, {3, 20}, {41, 7}}) {
    EXPECT_NEAR(shifted.steady(x, y), longer.steady(x, y), 1e-5) << x << ' ' << y;
    EXPECT_NEAR(std::abs(shifted.phasor(0, 1)(x, y) - longer.phasor(0, 1)(x, y)), 0.0, 1e-5) << x << ' ' << y;
    EXPECT_GT(std::abs(shifted.steady(x, y) - light.steady(x, y)), 1e-3F) << "the picture moves";
  }
}

// A surface turned by 60° about the vertical: 1/cos is 2 on the axis.
TEST(LearnedLight, IsLaterAndDimmerAsItsTableSaysOfTheIncidence) {
  Light light = syntheticLight(3, 1, {20_MHz}, 2, [](int, int) { return std::vector<Way>{{0.8, 1.5}}; });
  const double turn = kPi / 3.0;
  for (Vec3f& normal : light.truth.normal.pixels())
    normal = {static_cast<float>(std::sin(turn)), 0.0F, static_cast<float>(-std::cos(turn))};
  const Learned learned = learnedFrom({"delay_mm += 1 * curve(incidence, 1, 0, 3, 20)", "light_percent += -4 * hinge(incidence, 1)"});
  CameraInfo camera = cameraOfSize(3, 1);
  camera.fx = camera.fy = 1.0, camera.cx = 1.0, camera.cy = 0.0;
  const Light seen = applied(learned, light, camera);
  for (int n = 1; n <= 2; ++n) {
    EXPECT_NEAR(phaseOf(seen.phasor(0, n)(1, 0)), std::remainder(n * phaseAt(1.51, 20e6), 2.0 * kPi), 1e-5)
        << n;
    EXPECT_NEAR(std::abs(seen.phasor(0, n)(1, 0)), 0.96 * 0.8, 1e-5) << n;
  }
  EXPECT_NEAR(seen.steady(1, 0), 0.96 * 0.8, 1e-6);
  light.truth.normal = {};
  const Light unknown = applied(learned, light, camera);
  EXPECT_EQ(unknown.phasor(0, 1)(1, 0), light.phasor(0, 1)(1, 0)) << "light of no scene";
}

// Half way between the knots: 20 mm late.
TEST(LearnedLight, IsLaterAsItsTableSaysOfTheScenesAlbedo) {
  Light light = syntheticLight(2, 1, {20_MHz}, 1, [](int, int) { return std::vector<Way>{{0.8, 1.5}}; });
  light.truth.albedo(0, 0) = 0.5F, light.truth.albedo(1, 0) = 0.9F;
  const Learned learned = learnedFrom({"delay_mm += 40 * curve(albedo, 0.1, 1, 0.9, 0)"});
  const Light seen = applied(learned, light, cameraOfSize(2, 1));
  EXPECT_NEAR(phaseOf(seen.phasor(0, 1)(0, 0)), phaseAt(1.52, 20e6), 1e-5);
  EXPECT_NEAR(phaseOf(seen.phasor(0, 1)(1, 0)), phaseAt(1.5, 20e6), 1e-5);
  light.truth.albedo = {};
  EXPECT_EQ(applied(learned, light, cameraOfSize(2, 1)).phasor(0, 1)(0, 0), light.phasor(0, 1)(0, 0)) << "no scene";
}

// A pixel four times as bright as the 80 others of its square, whose mean is 84/81.
TEST(LearnedLight, ComparesAPixelWithItsSurroundings) {
  const Light light = syntheticLight(40, 30, {20_MHz}, 1, [](int x, int y) {
    return std::vector<Way>{{x == 20 && y == 15 ? 4.0 : 1.0, 1.0}};
  });
  const Learned learned = learnedFrom({"light_percent += 10 * surround_4px"});
  const Light seen = applied(learned, light, cameraOfSize(40, 30));
  const double mean = 84.0 / 81.0;
  EXPECT_NEAR(seen.steady(20, 15), 4.0 * (1.0 + 0.1 * std::log(mean / 4.0)), 1e-5);
  EXPECT_NEAR(seen.steady(17, 12), 1.0 + 0.1 * std::log(mean), 1e-5);
  EXPECT_NEAR(seen.steady(5, 5), 1.0, 1e-6);
}

std::string reflection(double radiance, double half_way_mm) {
  return "[[effect]]\ntype = 'internal_reflection'\nradiance_w_per_m2_sr = " +
         std::to_string(radiance) + "\nhalf_way_mm = " + std::to_string(half_way_mm) + "\n";
}

// A stray phasor z of 20 electrons: δφ = (z/A) sin(φ_z − φ), one cycle, inversely with the amplitude.
TEST(InternalReflection, IsOneCycleOfItsShareOfTheAmplitude) {
  for (const auto& [amplitude, cycles] : {std::pair{1000.0, 0.020}, {250.0, 0.080}}) {
    const Turn turn = turnOf({.amplitude = amplitude, .effects = reflection(20.0, 30.0)});
    EXPECT_NEAR(turn.errorCycles(1), cycles, 1e-4 * cycles) << amplitude;
    // The series is Σ (z/A)^j/j sin j(φ_z − φ).
    EXPECT_NEAR(turn.errorCycles(2), cycles * cycles / 2.0, 1e-5);
    EXPECT_LT(turn.closureCycles(0) + turn.closureCycles(1) + turn.closureCycles(2), 1e-5);
  }
}

TEST(InternalReflection, ScalesWithTheExposureAsTheSignalDoes) {
  PhaseRig rig{.effects = reflection(20.0, 30.0)};
  const Turn once = turnOf(rig);
  rig.amplitude *= 3.0, rig.mean *= 3.0, rig.effects = reflection(60.0, 30.0);  // three times the light
  const Turn thrice = turnOf(rig);
  for (std::size_t i = 0; i < 360; i += 17)
    EXPECT_NEAR(once.error_rad[i], thrice.error_rad[i], 1e-5);
}

TEST(Defocus, OfAnEdgeIsTheIntegralOfTheGaussian) {
  constexpr double kSigma = 1.4;
  const Light light = syntheticLight(100, 30, {20_MHz}, 1, [](int x, int) {
    return std::vector<Way>{{x < 50 ? 0.0 : 1.0, 1.0}};
  });
  const Light seen = applied(Defocus{.sigma = kSigma}, light, cameraOfSize(100, 30));
  for (int x = 46; x < 54; ++x) {
    // A source pixel's light starts from its centre: the sum of pixels from 50 on, each spread by the
    // Gaussian integrated over pixel x.
    double expected = 0.0;
    for (int from = 50; from < 80; ++from) {
      const double d = x - from;
      expected += 0.5 * (std::erf((d + 0.5) / kSigma / std::sqrt(2.0)) -
                         std::erf((d - 0.5) / kSigma / std::sqrt(2.0)));
    }
    EXPECT_NEAR(seen.steady(x, 15), expected, 1e-4) << x;  // cut at four σ
  }
  EXPECT_NEAR(seen.steady(0, 0), 0.0, 1e-6);
  EXPECT_NEAR(seen.steady(99, 0), 1.0, 1e-6);  // the border goes on outwards
}

TEST(Defocus, OfADiscSpreadsAPointOverItsAreaAndKeepsAllLight) {
  const Light light = syntheticLight(61, 61, {20_MHz}, 1, [](int x, int y) {
    return std::vector<Way>{{x == 30 && y == 30 ? 1.0 : 0.0, 1.0}};
  });
  const Light seen = applied(Defocus{.radius = 6.0, .sigma = 0.3}, light, cameraOfSize(61, 61));
  const double even = 1.0 / (kPi * 36.0);
  // 24 points across the disc of 12 pixels: the disc's middle is even to 2 %.
  EXPECT_NEAR(seen.steady(30, 30), even, 0.02 * even);
  EXPECT_NEAR(seen.steady(33, 28), even, 0.02 * even);
  EXPECT_NEAR(seen.steady(38, 30), 0.0, 1e-6);
  double sum = 0.0;
  for (float steady : seen.steady.pixels()) sum += static_cast<double>(steady);
  EXPECT_NEAR(sum, 1.0, 1e-5);
}

// Half of the near side's phasor and half of the far side's: the chord between them, at any contrast.
TEST(Defocus, MakesAnEdgesPixelsMixturesOfBothSides) {
  const Light light = syntheticLight(40, 20, {20_MHz}, 1, [](int x, int) {
    return std::vector<Way>{x < 20 ? Way{4.0, 1.0} : Way{1.0, 2.0}};
  });
  const Light seen = applied(Defocus{.sigma = 1.0}, light, cameraOfSize(40, 20));
  const double near_share =
      (static_cast<double>(seen.steady(20, 10)) - 1.0) / 3.0;  // of the near side's light
  const std::complex<double> chord = 4.0 * near_share * std::polar(1.0, -phaseAt(1.0, 20e6)) +
                                     (1.0 - near_share) * std::polar(1.0, -phaseAt(2.0, 20e6));
  EXPECT_NEAR(std::abs(std::complex<double>{seen.phasor(0, 1)(20, 10)} - chord), 0.0, 1e-6);
  EXPECT_GT(near_share, 0.2);
}

TEST(Vignetting, IsTheFourthPowerOfTheCosineAndLeavesTheRange) {
  CameraInfo camera = cameraOfSize(201, 3);
  camera.fx = camera.fy = 100.0 / std::tan(kPi / 6.0);  // 30 degrees at the edge
  camera.cx = 100.0, camera.cy = 1.0;
  const Light light = syntheticLight(201, 3, {20_MHz}, 2, [](int, int) {
    return std::vector<Way>{{1.0, 1.7}};
  }, 0.5);
  const Light seen = applied(Vignetting{}, light, camera);
  EXPECT_NEAR(seen.steady(200, 1), 0.5625, 1e-6);  // (√3/2)⁴
  EXPECT_NEAR(seen.ambient(0, 1), 0.5 * 0.5625, 1e-6);
  EXPECT_NEAR(seen.steady(100, 1), 1.0, 1e-6);
  EXPECT_NEAR(phaseOf(seen.phasor(0, 2)(200, 1)), phaseOf(light.phasor(0, 2)(200, 1)), 1e-6);
}

// A wall square to the axis at Z: the pixel looks along θ', reads Z / cos θ', and the device lays that
// along θ: depth Z cos θ / cos θ'.
TEST(DistortionMisfit, OfTheFocalLengthBendsAFlatWall) {
  CameraInfo camera = cameraOfSize(301, 3);
  camera.fx = camera.fy = 200.0;
  camera.cx = 150.0, camera.cy = 1.0;
  const auto cosine = [](double across) { return 1.0 / std::hypot(1.0, across); };
  const Light light = syntheticLight(301, 3, {20_MHz}, 1, [&](int x, int) {
    return std::vector<Way>{{1.0, 2.0 / cosine((x - 150.0) / 200.0)}};
  });
  const Light seen = applied(DistortionMisfit{.focal_error = 0.01}, light, camera);
  for (int x : {20, 100, 150, 260}) {
    const double across = (x - 150.0) / 200.0;
    const double range_m =
        phaseOf(seen.phasor(0, 1)(x, 1)) / phaseAt(1.0, 20e6);
    EXPECT_NEAR(range_m * cosine(across), 2.0 * cosine(across) / cosine(across / 1.01), 2e-5) << x;
  }
  const double corner = 2.0 * cosine(0.65) / cosine(0.65 / 1.01) - 2.0;
  EXPECT_LT(corner, -5e-3);  // 6 mm too near at 33 degrees: worth testing
}

TEST(DistortionMisfit, MovesThePictureByWholePixelsExactly) {
  CameraInfo camera = cameraOfSize(40, 30);
  camera.fx = camera.fy = 50.0;
  const Light light = syntheticLight(40, 30, {20_MHz}, 1, [](int x, int y) {
    return std::vector<Way>{{1.0 + x + 40 * y, 1.0}};
  });
  const Light seen =
      applied(DistortionMisfit{.focal_error = 0.0, .right = 3.0, .down = -2.0}, light, camera);
  EXPECT_NEAR(seen.steady(10, 10), light.steady(13, 8), 1e-3);
  EXPECT_NEAR(seen.steady(39, 10), light.steady(39, 8), 1e-3);  // the border goes on outwards
}

TEST(PropagationDelay, TiltsTheImageByTheSameMillimetresAtEveryFrequency) {
  const CameraInfo camera = cameraOfSize(101, 51);
  const Light light =
      syntheticLight(101, 51, {16_MHz, 120_MHz}, 2, [](int, int) {
        return std::vector<Way>{{1.0, 0.4}};
      });
  const PropagationDelay effect{
      .per_column = 0.5_mm, .per_row = -0.25_mm, .per_row_from_middle = 1_mm};
  const Light seen = applied(effect, light, camera);
  for (std::size_t f : {0U, 1U}) {
    const double hz = light.frequencies[f].in(hertz);
    for (const auto& [x, y] : {std::pair{0, 0}, {100, 50}, {50, 25}, {70, 10}}) {
      const double delay_m = 1e-3 * (0.5 * (x - 50) - 0.25 * (y - 25) + std::abs(y - 25));
      const double turned = std::remainder(
          phaseOf(seen.phasor(f, 2)(x, y)) - phaseOf(light.phasor(f, 2)(x, y)), 2.0 * kPi);
      EXPECT_NEAR(turned, 2.0 * phaseAt(delay_m, hz), 2e-6) << x << ' ' << y;
    }
  }
}

// The speed of light 3·10⁸ in place of the exact one: 0.0692 %, 2.77 mm at 4 m.
TEST(ClockScale, AsAKinectV2sSpeedOfLightIsTwoPointEightMillimetresAtFourMetres) {
  RangeImage image;
  image.range_m = {1, 1, 4.0F};
  const ClockScale scale{.ppm = 1e6 * (3e8 / kSpeedOfLight_m_per_s - 1.0)};
  EXPECT_NEAR(scale.ppm, 692.3, 0.1);
  image = scale.apply(image, {Moment{}, CameraInfo{}}, Random{1, 1, 1});
  EXPECT_NEAR(1e3 * (static_cast<double>(image.range_m(0, 0)) - 4.0), 2.769, 1e-3);
}

}  // namespace
}  // namespace toftwin::sim
