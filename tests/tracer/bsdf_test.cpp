// SPDX-License-Identifier: Apache-2.0
// Laws that every reflection model obeys, and what each promises of itself.
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "sim/tracer/bsdf/any.h"

namespace toftwin::sim::bsdf {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr unsigned kSeed = 20261121;

struct Case {
  std::string name;
  Any model;
  double albedo;
};

std::vector<Case> spreadCases() {
  return {{"lambertian", Diffuse{}, 0.8},
          {"oren-nayar 20", Diffuse::rough(0.35), 0.8},
          {"oren-nayar 40", Diffuse::rough(0.7), 1.0},
          {"metal 0.2", RoughMetal::ofRoughness(0.2), 0.9},
          {"metal 0.5", RoughMetal::ofRoughness(0.5), 0.6},
          {"metal 1", RoughMetal::ofRoughness(1.0), 1.0},
          {"dielectric 0.15", RoughDielectric::of(0.15, 1.5), 0.5},
          {"dielectric 0.6", RoughDielectric::of(0.6, 1.5), 1.0},
          {"dielectric 1, black", RoughDielectric::of(1.0, 1.8), 0.0},
          {"retro 0.3 deg", Retroreflector::withLobe(0.3 * kPi / 180.0, 1.0), 1.0},
          {"retro 8 deg, part", Retroreflector::withLobe(8.0 * kPi / 180.0, 0.6), 0.9},
          {"translucent", Translucent{0.0, 0.01}, 0.7},
          {"translucent, through", Translucent{0.4, 0.01}, 1.0}};
}

Vec3d direction(double cosine, double phi) {
  const double sine = std::sqrt(1.0 - cosine * cosine);
  return {sine * std::cos(phi), sine * std::sin(phi), cosine};
}
const std::vector<Vec3d>& viewers() {
  static const std::vector<Vec3d> all{direction(1.0, 0.0), direction(0.8, 0.3), direction(0.4, 2.0),
                                      direction(0.1, -1.0)};
  return all;
}

double valueOf(const Case& c, Vec3d from, Vec3d to) {
  return std::visit([&](const auto& m) { return m.value(c.albedo, from, to); }, c.model);
}
double densityOf(const Case& c, Vec3d from, Vec3d to) {
  return std::visit([&](const auto& m) { return m.density(c.albedo, from, to); }, c.model);
}
Scattered sampleOf(const Case& c, Vec3d from, Draw draw) {
  return std::visit([&](const auto& m) { return m.sample(c.albedo, from, draw); }, c.model);
}

/// Polar coordinates about the lobe's axis with θ = π s³: a grid that is fine where the lobe is narrow.
struct Polar {
  Vec3d x, y, axis;
  explicit Polar(const Case& c, Vec3d from) {
    const bool is_facet =
        std::holds_alternative<RoughMetal>(c.model) || std::holds_alternative<RoughDielectric>(c.model);
    axis = is_facet                                          ? Vec3d{-from.x, -from.y, from.z}
           : std::holds_alternative<Retroreflector>(c.model) ? from
                                                             : Vec3d{0, 0, 1};
    x = normalised(cross(axis, std::abs(axis.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    y = cross(axis, x);
  }
  [[nodiscard]] Vec3d at(double s, double t) const {
    const double theta = kPi * s * s * s, phi = 2.0 * kPi * t;
    return axis * std::cos(theta) + x * (std::sin(theta) * std::cos(phi)) +
           y * (std::sin(theta) * std::sin(phi));
  }
  [[nodiscard]] static double solidAngle(double s) {  // per ds dt
    return 2.0 * kPi * std::sin(kPi * s * s * s) * kPi * 3.0 * s * s;
  }
  [[nodiscard]] std::pair<double, double> of(Vec3d d) const {
    const double theta = std::acos(std::clamp(dot(d, axis), -1.0, 1.0));
    const double phi = std::atan2(dot(d, y), dot(d, x));
    return {std::cbrt(theta / kPi), phi < 0.0 ? phi / (2.0 * kPi) + 1.0 : phi / (2.0 * kPi)};
  }
};

constexpr int kGrid = 600;
template <class Function>
double integral(const Polar& polar, const Function& function) {
  double sum = 0.0;
  for (int i = 0; i < kGrid; ++i) {
    const double s = (i + 0.5) / kGrid, weight = Polar::solidAngle(s) / (kGrid * kGrid);
    for (int j = 0; j < kGrid; ++j) sum += weight * function(polar.at(s, (j + 0.5) / kGrid));
  }
  return sum;
}

/// ∫ f |cos| over all directions: what a viewer in uniform light of radiance 1 sees. Midpoint rule on 600²
/// cells: wrong by 2e-4 at most (seen by doubling the grid), at the horizon's edge.
constexpr double kQuadrature = 1e-3;

TEST(Bsdf, NoModelGivesBackMoreThanItGot) {
  for (const Case& c : spreadCases()) {
    for (const Vec3d from : viewers()) {
      const double seen =
          integral(Polar{c, from}, [&](Vec3d to) { return valueOf(c, from, to) * std::abs(to.z); });
      // The tables of 1 − E are linear between 65 cosines: 0.002.
      EXPECT_LT(seen, 1.0 + kQuadrature + 0.002) << c.name << " cosine " << from.z;
      EXPECT_GE(seen, 0.0);
    }
  }
}

/// At albedo 1, metals and dielectrics lose nothing, however rough: facets' repeated reflections included.
TEST(Bsdf, MicrofacetsOfAlbedoOneLoseNothing) {
  for (const double roughness : {0.15, 0.3, 0.5, 0.8, 1.0}) {
    for (const Case& c : {Case{"metal", RoughMetal::ofRoughness(roughness), 1.0},
                          Case{"dielectric", RoughDielectric::of(roughness, 1.5), 1.0}}) {
      for (const Vec3d from : viewers()) {
        const double seen =
            integral(Polar{c, from}, [&](Vec3d to) { return valueOf(c, from, to) * std::abs(to.z); });
        EXPECT_NEAR(seen, 1.0, kQuadrature + 0.003) << c.name << " " << roughness << " cosine " << from.z;
      }
    }
  }
}

TEST(Bsdf, LightGoesBothWaysAlike) {
  std::mt19937 generator{kSeed};
  std::uniform_real_distribution<double> uniform;
  for (const Case& c : spreadCases()) {
    for (int i = 0; i < 2000; ++i) {
      const Vec3d a = direction(0.02 + 0.98 * uniform(generator), 6.3 * uniform(generator));
      // Half of the pairs lie close together, where a retroreflector's lobe is.
      const Vec3d near = normalised(a + 0.01 * direction(uniform(generator), 6.3 * uniform(generator)));
      const Vec3d b =
          i % 2 == 0 ? near : direction(0.02 + 0.98 * uniform(generator), 6.3 * uniform(generator));
      const double there = valueOf(c, a, b), back = valueOf(c, b, a);
      EXPECT_NEAR(there, back, 1e-9 * (there + back) + 1e-12) << c.name;
    }
  }
}

/// Density and directions agree: χ² over 16 × 16 cells about the lobe and one for what is absorbed, cells
/// with fewer than 10 expected counts pooled. z > 4.2 by Wilson & Hilferty has the chance 1.3e-5; 52 cases
/// give a false alarm once in 1500 seeds. Also: the density's integral and the absorbed share make 1.
TEST(Bsdf, SamplesFollowTheirDensity) {
  constexpr int kCells = 16, kFine = 20, kSamples = 200'000;
  std::mt19937 generator{kSeed};
  std::uniform_real_distribution<double> uniform;
  for (const Case& c : spreadCases()) {
    for (const Vec3d from : viewers()) {
      const Polar polar{c, from};
      std::vector<double> expected(kCells * kCells), counted(kCells * kCells);
      double absorbed = 0.0, all = 0.0;
      for (int i = 0; i < kSamples; ++i) {
        const Scattered s = sampleOf(c, from, {uniform(generator), uniform(generator), uniform(generator)});
        if (s.density <= 0.0) {
          ++absorbed;
          continue;
        }
        EXPECT_NEAR(norm(s.to), 1.0, 1e-9);
        const auto [a, b] = polar.of(s.to);
        const int row = std::min(kCells - 1, static_cast<int>(a * kCells)),
                  column = std::min(kCells - 1, static_cast<int>(b * kCells));
        ++counted[static_cast<std::size_t>(row * kCells + column)];
      }
      for (int i = 0; i < kCells * kFine; ++i) {
        const double s = (i + 0.5) / (kCells * kFine),
                     weight = Polar::solidAngle(s) / (kCells * kFine * kCells * kFine);
        for (int j = 0; j < kCells * kFine; ++j) {
          const double p = weight * densityOf(c, from, polar.at(s, (j + 0.5) / (kCells * kFine)));
          expected[static_cast<std::size_t>(i / kFine * kCells + j / kFine)] += p * kSamples;
          all += p;
        }
      }
      EXPECT_NEAR(all + absorbed / kSamples, 1.0, 2e-3 + 5.0 * std::sqrt(0.25 / kSamples))
          << c.name << " cosine " << from.z;
      double chi2 = 0.0, pooled_expected = (1.0 - all) * kSamples, pooled_counted = absorbed;
      int cells = 0;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        if (expected[i] < 10.0) {
          pooled_expected += expected[i];
          pooled_counted += counted[i];
          continue;
        }
        chi2 += (counted[i] - expected[i]) * (counted[i] - expected[i]) / expected[i];
        ++cells;
      }
      if (pooled_expected >= 10.0) {
        chi2 += (pooled_counted - pooled_expected) * (pooled_counted - pooled_expected) / pooled_expected;
        ++cells;
      }
      const double n = cells - 1.0, spread = 2.0 / (9.0 * n);
      const double z = (std::cbrt(chi2 / n) - (1.0 - spread)) / std::sqrt(spread);
      EXPECT_LT(z, 4.2) << c.name << " cosine " << from.z << " chi2 " << chi2 << " of " << cells
                        << " cells, seed " << kSeed;
    }
  }
}

/// A sample's weight is f cos / density: together with the density's own test, samples have the right mean.
TEST(Bsdf, WeightsAreValueOverDensity) {
  std::mt19937 generator{kSeed};
  std::uniform_real_distribution<double> uniform;
  for (const Case& c : spreadCases()) {
    for (const Vec3d from : viewers()) {
      for (int i = 0; i < 500; ++i) {
        const Scattered s = sampleOf(c, from, {uniform(generator), uniform(generator), uniform(generator)});
        if (s.density <= 0.0) continue;
        EXPECT_NEAR(s.density, densityOf(c, from, s.to), 1e-9 * s.density) << c.name;
        EXPECT_NEAR(s.weight * s.density, valueOf(c, from, s.to) * std::abs(s.to.z),
                    1e-9 * s.weight * s.density)
            << c.name;
      }
    }
  }
}

/// A smooth boundary seen at roughness → 0 reflects what Fresnel says; 1.5: 4 % ahead, all at grazing.
TEST(Fresnel, HasItsKnownValues) {
  EXPECT_NEAR(dielectricFresnel(1.0, 1.5), 0.04, 1e-12);
  EXPECT_NEAR(dielectricFresnel(1e-9, 1.5), 1.0, 1e-6);
  const double brewster = std::atan(1.5), c = std::cos(brewster), s = std::sin(brewster);
  const double inner = std::sqrt(1.0 - s * s / 2.25), across = (c - 1.5 * inner) / (c + 1.5 * inner);
  EXPECT_NEAR(dielectricFresnel(c, 1.5), 0.5 * across * across, 1e-12)
      << "no light polarised along the plane";
  EXPECT_NEAR(RoughDielectric::of(0.1, 1.5).boundary.at(1.0), 0.04, 1e-3);
}

/// Ten layers summed by hand: R = F + (1−F)²F Σ F^{2j} …
TEST(ThinGlass, SumsAllReflectionsWithin) {
  for (const double clarity : {1.0, 0.8}) {
    for (const double cosine : {1.0, 0.6, 0.2}) {
      const ThinGlass glass{.index = 1.52, .clarity = clarity, .thickness_m = 0.0};
      const double f = dielectricFresnel(cosine, 1.52);
      const double tau = std::pow(clarity, 1.0 / std::sqrt(1.0 - (1.0 - cosine * cosine) / (1.52 * 1.52)));
      double inside = 1.0 - f, reflected = f, transmitted = 0.0;
      for (int i = 0; i < 60; ++i) {
        inside *= tau;
        (i % 2 == 0 ? transmitted : reflected) += inside * (1.0 - f);
        inside *= f;
      }
      EXPECT_NEAR(glass.shares(cosine).reflected, reflected, 1e-12);
      EXPECT_NEAR(glass.shares(-cosine).transmitted, transmitted, 1e-12);
      EXPECT_TRUE(clarity < 1.0 || std::abs(reflected + transmitted - 1.0) < 1e-12);
    }
  }
  // 4 mm of index 1.5 delay by 2 mm of air.
  EXPECT_NEAR((ThinGlass{1.5, 1.0, 4e-3}.extraLength(1.0)), 2e-3, 1e-15);
}

/// ⟨e^{−iωt}⟩ of the sampled ways is 1/(1 + iωτ), with the midpoints of 10⁶ strata: 1e-5.
TEST(Translucent, DelaysByAnExponentialWay) {
  const Translucent wax{.through = 0.0, .mean_length_m = 0.03};
  const double k = 2.0 * kPi * 80e6 / 299792458.0;
  double re = 0.0, im = 0.0;
  constexpr int kStrata = 1'000'000;
  for (int i = 0; i < kStrata; ++i) {
    const double way = wax.wayWithin((i + 0.5) / kStrata);
    re += std::cos(k * way) / kStrata;
    im -= std::sin(k * way) / kStrata;
  }
  const double x = k * 0.03;
  EXPECT_NEAR(re, 1.0 / (1.0 + x * x), 1e-5);
  EXPECT_NEAR(im, -x / (1.0 + x * x), 1e-5);
}

}  // namespace
}  // namespace toftwin::sim::bsdf
