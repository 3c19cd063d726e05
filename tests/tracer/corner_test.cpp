// SPDX-License-Identifier: Apache-2.0
// Multipath in a corner against independent quadrature and phasor radiosity, which are themselves held to each other and
// to tables of this project's own reference computations. Tolerance: a goal + 3σ and nothing more, with σ from the spread
// of 1024 independent pixels that look at the same place. The goal is 0.05 mm for two bounces and 0.1 mm for all
// orders. 3σ alone is exceeded by 0.27 % of correct results; the goal makes that far less. All seeds are fixed.
//
// Every table is also asked whether it can fail: direct light alone has error 0 in all of these scenes,
// and each row that expects more than 3 mm must be at least two tolerances away from that.
#include "tests/tracer/corner.h"
#include "tests/tracer/corner_radiosity.h"

#include <algorithm>
#include <bit>
#include <iostream>
#include <map>

namespace toftwin::sim::testing {
namespace {

/// How well a table must be met, and the largest standard deviation at which that is looked at. Paths over
/// many surfaces scatter more, which costs time by the square.
struct Bar {
  double goal_m, sigma_m;
};
constexpr Bar kTwoSurfaces{0.05e-3, 0.03e-3}, kAllOrders{0.1e-3, 0.03e-3};

/// Instrumented builds look for other mistakes than wrong millimetres and are many times slower: they
/// reach a larger σ, which leaves rows without power.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr double kSigmaFactor = 6.0;
#else
constexpr double kSigmaFactor = 1.0;
#endif

/// The standard deviation to reach: the bar's, less where the value itself is small, so that 3σ does not
/// cover it. The paths that make small values near the edge scatter little, so that this costs little.
double wantedSigma(double expected_m, const Bar& bar) {
  return kSigmaFactor * std::clamp(std::abs(expected_m) / 40.0, 0.02e-3, bar.sigma_m);
}

/// Two-bounce light of the infinite corner relative to the direct light, by quadrature:
///   Z1 = (ρI/π) b / r_p³ · e^{−2ik r_p}
///   Z2 = (ρ²I/π²) e^{−ik r_p} ∫dy ∫dz a x y / (R³ d⁴) e^{−ik(R+d)},
///   R² = a² + (y − b)² + z², d² = x² + y² + z²; y = e^s, z = √(x²+y²) sinh t, trapezoids.
Complex secondOverFirst(double x, double a, double b, double albedo, double k, double step) {
  const double range = std::hypot(x - a, b);
  Complex sum;
  for (double s = -16.0; s <= 6.0; s += step) {
    const double y = std::exp(s), q = std::hypot(x, y);
    for (double t = -9.0; t <= 9.0; t += step) {
      const double z = q * std::sinh(t), dz = q * std::cosh(t);
      const double light = std::sqrt(a * a + (y - b) * (y - b) + z * z), d2 = x * x + y * y + z * z;
      sum += a * x * y / (light * light * light * d2 * d2) * y * dz * std::polar(1.0, -k * (light + std::sqrt(d2)));
    }
  }
  sum *= step * step;
  const Complex first = b / (range * range * range) * std::polar(1.0, -k * range);
  return albedo / kPi * sum / first;
}

/// e = −arg(1 + Z2/Z1) / 2k in metres.
double twoBounceError(const Corner& corner, double s, Frequency f, double step = 0.1) {
  const double k = wavenumber(f);
  return -std::arg(1.0 + secondOverFirst(s, corner.side(), corner.side(), corner.albedo, k, step)) / (2.0 * k);
}

constexpr CornerRadiosity::Walls kInfinite{.length = 60.0, .half_height = 60.0, .nearest = 1e-5};
constexpr CornerRadiosity::Grid kInfiniteGrid{.along = 64, .across = 45, .angles = 40};

struct Seen {
  double error_m, sigma_m;
};
constexpr int kSide = 32;  ///< of the image of 1024 pixels

/// The mean phasor's error. Pixels are 1e-9 rad apart: the same place, sampled 1024 times over. Each pixel's
/// own samples are even, so that their spread would state a larger σ than the means have.
std::vector<Seen> traceError(const Corner& corner, const Scene& scene, double s, std::vector<Frequency> frequencies,
                             int surfaces, int samples, std::uint64_t seed) {
  TraceRequest request = corner.lookingAt(s, std::move(frequencies));
  request.camera.width = request.camera.height = kSide;
  request.camera.fx = request.camera.fy = 1e9;
  request.max_surfaces = surfaces;
  request.samples_per_pixel = samples;
  request.seed = seed;
  const Light light = trace(scene, request);
  std::vector<Seen> seen;
  for (std::size_t f = 0; f < request.frequencies.size(); ++f) {
    const PixelMean mean = meanOfPixels(light, f);
    seen.push_back({rangeError(mean.phasor, request.frequencies[f], corner.range(s)),
                    mean.sigma_across / std::abs(mean.phasor) / (2.0 * wavenumber(request.frequencies[f]))});
  }
  return seen;
}

/// As many samples as it takes for each frequency's wanted σ, by a pilot run with another seed: a power of
/// two, which are the most even.
std::vector<Seen> traceError(const Corner& corner, const Scene& scene, double s,
                             const std::vector<Frequency>& frequencies, int surfaces,
                             const std::vector<double>& expected_m, const Bar& bar) {
  constexpr int kPilot = 32;
  double worst = 0.0;
  const auto pilot = traceError(corner, scene, s, frequencies, surfaces, kPilot, 1);
  for (std::size_t f = 0; f < pilot.size(); ++f)
    worst = std::max(worst, pilot[f].sigma_m / wantedSigma(expected_m[f], bar));
  const auto needed = static_cast<unsigned>(std::max<double>(kPilot, kPilot * worst * worst));
  return traceError(corner, scene, s, frequencies, surfaces, static_cast<int>(std::bit_ceil(needed)), 2);
}

/// Checks the values of a table one by one and prints, when it goes, what the table was worth.
class Judge {
 public:
  Judge(std::string table, const Bar& bar) : table_(std::move(table)), bar_(bar) {}
  Judge(const Judge&) = delete;
  Judge& operator=(const Judge&) = delete;
  ~Judge() {
    std::cout << table_ << ": " << rows_ << " rows; " << powerful_
              << " are two tolerances or more away from direct light alone; worst: " << worst_share_ << " of "
              << bar_.goal_m * 1e3 << " mm + 3 sigma; largest deviation " << worst_m_ * 1e3
              << " mm; largest tolerance " << largest_m_ * 1e3 << " mm\n";
  }

  void check(const Seen& seen, double expected_m, const std::string& where) {
    const double allowed_m = bar_.goal_m + 3.0 * seen.sigma_m;
    const double deviation_m = std::abs(seen.error_m - expected_m);
    EXPECT_LE(deviation_m, allowed_m) << where << ": " << seen.error_m * 1e3 << " mm seen, " << expected_m * 1e3
                                      << " mm expected, sigma " << seen.sigma_m * 1e3 << " mm";
    EXPECT_LT(seen.sigma_m, 1.2 * wantedSigma(expected_m, bar_))
        << where << ": too few samples for this check to mean much";
    const bool rejects_direct_light = std::abs(expected_m) >= 2.0 * allowed_m;
    if (kSigmaFactor == 1.0 && std::abs(expected_m) > 3e-3) {
      EXPECT_TRUE(rejects_direct_light) << where << ": " << expected_m * 1e3 << " mm expected, but direct light alone is only "
                                        << std::abs(expected_m) / allowed_m << " tolerances away";
    }
    ++rows_;
    powerful_ += rejects_direct_light ? 1 : 0;
    worst_m_ = std::max(worst_m_, deviation_m);
    worst_share_ = std::max(worst_share_, deviation_m / allowed_m);
    largest_m_ = std::max(largest_m_, allowed_m);
  }
 private:
  std::string table_;
  Bar bar_;
  int rows_ = 0, powerful_ = 0;
  double worst_m_ = 0.0, worst_share_ = 0.0, largest_m_ = 0.0;
};

/// What the tables are judged against is what the tracer gives without any multipath.
TEST(Corner, DirectLightAloneHasNoError) {
  for (const double wall : {60.0, 1.0}) {
    Corner corner;
    corner.wall_length = wall;
    corner.wall_height = 2.0 * wall;
    const Scene scene = corner.scene();
    for (const double s : {0.001, 0.02, 0.3, 0.9}) {
      for (const Seen& seen : traceError(corner, scene, s, {16_MHz, 80_MHz, 120_MHz}, 1, 16, 3)) {
        EXPECT_NEAR(seen.error_m, 0.0, 1e-5) << s;
      }
    }
  }
}

/// Two surfaces, D = 1.5 m: the published errors in mm at kTablePlaces.
struct TwoBounceRow {
  double albedo;
  Frequency f;
  std::vector<double> error_mm;
};
const std::vector<double> kTablePlaces{0.001, 0.005, 0.02, 0.1, 0.2, 0.3, 0.5, 1.0};
const std::vector<TwoBounceRow> kTwoBounces{{0.8, 16_MHz, {0.995, 4.286, 14.51, 52.93, 82.80, 99.93, 109.76, 89.81}},
                                            {0.8, 80_MHz, {0.849, 3.566, 11.75, 40.83, 60.18, 66.54, 54.29, 7.61}},
                                            {0.8, 120_MHz, {0.785, 3.254, 10.55, 35.22, 48.57, 47.66, 22.41, -9.92}},
                                            {0.5, 80_MHz, {0.594, 2.500, 8.246, 28.31, 40.63, 43.59, 33.81, 4.62}},
                                            {0.2, 80_MHz, {0.270, 1.138, 3.758, 12.69, 17.61, 18.24, 13.44, 1.80}}};

TEST(CornerQuadrature, AgreesWithItselfAtHalfTheStepAndWithTheTable) {
  for (const TwoBounceRow& row : kTwoBounces) {
    Corner corner;
    corner.albedo = row.albedo;
    for (std::size_t i = 0; i < kTablePlaces.size(); ++i) {
      const double error = twoBounceError(corner, kTablePlaces[i], row.f);
      EXPECT_NEAR(error, twoBounceError(corner, kTablePlaces[i], row.f, 0.05), 1e-6);
      const double last_digit_mm = kTablePlaces[i] < 0.01 ? 1e-3 : 1e-2;  // of the published value
      EXPECT_NEAR(error * 1e3, row.error_mm[i], last_digit_mm)
          << "albedo " << row.albedo << ", f " << row.f.in(megahertz) << " MHz, s " << kTablePlaces[i];
    }
  }
}

TEST(Corner, TwoBouncesAgreeWithQuadrature) {
  Judge judge{"two bounces", kTwoSurfaces};
  for (const TwoBounceRow& row : kTwoBounces) {
    Corner corner;
    corner.albedo = row.albedo;
    const Scene scene = corner.scene();
    for (const double s : kTablePlaces) {
      const double expected = twoBounceError(corner, s, row.f);
      judge.check(traceError(corner, scene, s, {row.f}, 2, {expected}, kTwoSurfaces)[0], expected,
                  "albedo " + std::to_string(row.albedo) + ", f " + std::to_string(row.f.in(megahertz)) +
                      ", s " + std::to_string(s));
    }
  }
}

/// The infinite corner by radiosity, as large as the one that is traced. Its matrix takes seconds.
const CornerRadiosity& infiniteCorner(Frequency f) {
  static std::map<double, CornerRadiosity> known;
  const double k = wavenumber(f);
  return known.try_emplace(k, k, 1.5, kInfinite, kInfiniteGrid).first->second;
}

/// Sixteen surfaces, D = 1.5 m, at kTablePlaces: mm, by Monte Carlo in double precision.
struct SixteenRow {
  double albedo;
  Frequency f;
  std::vector<double> error_mm;
  double last_digit_mm;
};
const std::vector<SixteenRow> kSixteenSurfaces{
    {0.8, 16_MHz, {8.3, 22.2, 49.7, 113.1, 148.1, 163.0, 162.1, 119.5}, 0.1},
    {0.8, 80_MHz, {4.9, 13.0, 28.6, 63.9, 78.9, 78.8, 56.3, 5.6}, 0.1},
    {0.8, 120_MHz, {4.0, 10.6, 23.0, 49.8, 57.4, 50.5, 19.9, -10.1}, 0.1},
    {0.5, 80_MHz, {1.8, 5.8, 14.7, 37.6, 48.0, 48.2, 34.5, 3.9}, 0.1},
    {0.2, 80_MHz, {0.42, 1.62, 4.81, 14.26, 18.78, 18.95, 13.53, 1.69}, 0.01}};

/// The Monte-Carlo table states a standard
/// deviation of 0.05 to 0.25 mm for itself, but not of which row.
TEST(InfiniteCornerRadiosity, AgreesWithQuadratureACoarserGridAndTheTable) {
  for (const SixteenRow& row : kSixteenSurfaces) {
    const CornerRadiosity& radiosity = infiniteCorner(row.f);
    const CornerRadiosity coarser{wavenumber(row.f), 1.5, kInfinite, {.along = 48, .across = 35, .angles = 32}};
    Corner corner;
    corner.albedo = row.albedo;
    for (std::size_t i = 0; i < kTablePlaces.size(); ++i) {
      const double s = kTablePlaces[i];
      EXPECT_NEAR(1e3 * radiosity.error(row.albedo, s, 2), 1e3 * twoBounceError(corner, s, row.f), 0.002) << s;
      const double error_mm = 1e3 * radiosity.error(row.albedo, s, 16);
      EXPECT_NEAR(error_mm, 1e3 * coarser.error(row.albedo, s, 16), 0.04) << s;
      EXPECT_NEAR(error_mm, row.error_mm[i], 3.0 * (row.albedo > 0.2 ? 0.25 : 0.05) + 0.5 * row.last_digit_mm) << s;
    }
  }
}

TEST(InfiniteCornerRadiosity, HasConverged) {
  const CornerRadiosity finer{wavenumber(16_MHz), 1.5, {.length = 60.0, .half_height = 60.0, .nearest = 5e-6},
                              {.along = 72, .across = 55, .angles = 56}};
  for (const double s : kTablePlaces)
    EXPECT_NEAR(1e3 * infiniteCorner(16_MHz).error(0.8, s, 16), 1e3 * finer.error(0.8, s, 16), 0.015) << s;
}

TEST(Corner, SixteenSurfacesAgreeWithRadiosity) {
  Judge judge{"sixteen surfaces", kAllOrders};
  for (const SixteenRow& row : kSixteenSurfaces) {
    Corner corner;
    corner.albedo = row.albedo;
    const Scene scene = corner.scene();
    for (const double s : kTablePlaces) {
      const double expected = infiniteCorner(row.f).error(row.albedo, s, 16);
      judge.check(traceError(corner, scene, s, {row.f}, 16, {expected}, kAllOrders)[0], expected,
                  "albedo " + std::to_string(row.albedo) + ", f " + std::to_string(row.f.in(megahertz)) + ", s " +
                      std::to_string(s));
    }
  }
}

/// Close to the edge a minimum ray distance of 1 cm would cost 1.7 mm (of 4.93 mm) and a rounding error
/// at large coordinates would show. An object at the world's origin keeps the tracer from moving its
/// own origin to the corner: single-precision coordinates are then 8 µm apart.
TEST(Corner, KeepsItsValueNextToTheEdgeFarFromTheOrigin) {
  const std::string anchor =
      "[[object]]\nshape = 'disc'\nradius_m = 0.01\nmaterial = 'm'\nposition_m = [-100, -80, -120]\n";
  Judge judge{"far from the origin", kAllOrders};
  for (const std::string& more : {std::string{}, anchor}) {
    Corner corner;
    corner.shift = {100.0, 80.0, -60.0};
    corner.more = more;
    const Scene scene = corner.scene();
    for (const double s : {0.001, 0.005, 0.02}) {
      const double expected = infiniteCorner(80_MHz).error(corner.albedo, s, 16);
      judge.check(traceError(corner, scene, s, {80_MHz}, 16, {expected}, kAllOrders)[0], expected,
                  "s " + std::to_string(s) + (more.empty() ? "" : " with anchor"));
    }
  }
}

/// Two walls of 1 × 1 m, all bounces, at places u from the edge.
struct FiniteRow {
  double distance, albedo;
  std::vector<double> at_30_mm, at_120_mm;  ///< published, from 40 patches a side, one decimal
  double one_bounce_mm;                     ///< the same of two surfaces alone, at 30 MHz, 30 cm from the edge
};
const std::vector<double> kPlaces{0.02, 0.10, 0.30, 0.60, 0.90};
const std::vector<FiniteRow> kFiniteCorner{
    {1.5, 0.1, {1.9, 6.1, 8.3, 5.8, 3.5}, {1.8, 5.3, 5.7, 1.7, -0.1}, 8.0},
    {1.5, 0.3, {6.9, 19.4, 25.8, 17.9, 10.7}, {6.1, 16.4, 17.3, 5.2, -0.3}, 22.7},
    {1.5, 0.5, {13.5, 34.4, 44.4, 30.9, 18.5}, {11.5, 28.0, 29.2, 8.5, -0.6}, 36.0},
    {1.5, 0.8, {27.5, 60.8, 74.9, 52.3, 31.3}, {21.7, 46.9, 47.6, 13.3, -1.2}, 53.5},
    {1.5, 0.9, {33.5, 70.8, 86.0, 60.0, 35.9}, {25.8, 53.7, 54.0, 14.9, -1.5}, 58.8},
    {1.0, 0.5, {14.9, 36.7, 42.0, 26.4, 19.5}, {12.3, 29.0, 25.9, 7.0, 0.8}, 34.3},
    {2.5, 0.5, {12.0, 30.9, 42.7, 33.5, 20.8}, {10.5, 25.9, 29.4, 9.8, -1.4}, 34.3}};
constexpr CornerRadiosity::Grid kCoarser{.along = 48, .across = 9, .angles = 16};

/// At each of the rows' distances. Their matrices take seconds.
class FiniteRadiosity {
 public:
  explicit FiniteRadiosity(Frequency f, CornerRadiosity::Grid grid = {}) {
    for (const FiniteRow& row : kFiniteCorner)
      at_distance_.try_emplace(row.distance, wavenumber(f), row.distance, CornerRadiosity::Walls{}, grid);
  }
  [[nodiscard]] double error(const FiniteRow& row, double u, int surfaces = CornerRadiosity::kAllSurfaces) const {
    return at_distance_.at(row.distance).error(row.albedo, u, surfaces);
  }

 private:
  std::map<double, CornerRadiosity> at_distance_;
};

Corner finiteCorner(const FiniteRow& row) {
  return {.distance = row.distance, .wall_length = 1.0, .wall_height = 1.0, .albedo = row.albedo, .shift = {}, .more = {}};
}
constexpr double kOneBouncePlace = 0.3;

/// From 10 cm on the published table has the error that it states, 0.1 mm and half of its last digit.
/// At 2 cm its patches of 2.5 cm are too coarse, by up to 0.9 mm with albedo 0.9: there our own finer
/// and coarser grids are the witnesses. Of two surfaces alone its patches miss up to 0.2 mm.
TEST(CornerRadiosityTable, AgreesWithACoarserGridAndWithThePublishedTable) {
  for (const Frequency f : {30_MHz, 120_MHz}) {
    const FiniteRadiosity radiosity{f}, coarser{f, kCoarser};
    for (const FiniteRow& row : kFiniteCorner) {
      for (std::size_t i = 0; i < kPlaces.size(); ++i) {
        const double error_mm = radiosity.error(row, kPlaces[i]) * 1e3;
        const double published_mm = f == 30_MHz ? row.at_30_mm[i] : row.at_120_mm[i];
        EXPECT_NEAR(error_mm, coarser.error(row, kPlaces[i]) * 1e3, 0.01);
        EXPECT_NEAR(error_mm, published_mm, kPlaces[i] < 0.05 ? 1.0 : 0.15);
      }
      if (f != 30_MHz) continue;
      EXPECT_NEAR(radiosity.error(row, kOneBouncePlace, 2) * 1e3, row.one_bounce_mm, 0.2);
    }
  }
}

TEST(FiniteCorner, AgreesWithRadiosity) {
  const FiniteRadiosity at_30{30_MHz}, at_120{120_MHz};
  Judge judge{"finite corner", kAllOrders};
  for (const FiniteRow& row : kFiniteCorner) {
    const Corner corner = finiteCorner(row);
    const Scene scene = corner.scene();
    for (const double u : kPlaces) {
      const std::vector<double> expected{at_30.error(row, u), at_120.error(row, u)};
      const auto seen = traceError(corner, scene, u, {30_MHz, 120_MHz}, 100, expected, kAllOrders);
      const std::string where = "D " + std::to_string(row.distance) + ", albedo " + std::to_string(row.albedo) +
                                ", u " + std::to_string(u);
      judge.check(seen[0], expected[0], where + ", 30 MHz");
      judge.check(seen[1], expected[1], where + ", 120 MHz");
    }
  }
}

TEST(FiniteCorner, OneBounceAgreesWithRadiosity) {
  const FiniteRadiosity radiosity{30_MHz};
  Judge judge{"finite corner, one bounce", kTwoSurfaces};
  for (const FiniteRow& row : kFiniteCorner) {
    const Corner corner = finiteCorner(row);
    const Scene scene = corner.scene();
    const double expected = radiosity.error(row, kOneBouncePlace, 2);
    judge.check(traceError(corner, scene, kOneBouncePlace, {30_MHz}, 2, {expected}, kTwoSurfaces)[0], expected,
                "D " + std::to_string(row.distance) + ", albedo " + std::to_string(row.albedo));
  }
}

}  // namespace
}  // namespace toftwin::sim::testing
