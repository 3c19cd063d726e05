// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "calib/compare/statistics.h"
#include "calib/table/table.h"
#include "reference_corner.h"
#include "tools/validate/dataset.h"
#include "tools/validate/traced_line.h"

namespace toftwin::published {
namespace {

using std::numbers::pi;
using Phasor = std::complex<double>;

/// The arbiter: two-bounce light in the finite corner by quadrature, no sampling. The other board
/// is integrated over q = eᵘ (distance from the edge) and y = √(q² + q₀²) sinh v, which resolves
/// the form factor's peak near the edge; midpoints of n × n cells.
double twoBounceError_mm(const CornerTrace& what, double t, int n) {
  const SymmetricCorner& c = what.corner;
  const double h = std::numbers::sqrt2 / 2.0, side = t < 0.0 ? -1.0 : 1.0;
  const double z = c.depth_m / (1.0 + std::abs(t)), q0 = std::abs(t) * z / h;
  const Vec3d p{t * z, 0.0, z}, edge{0.0, 0.0, c.depth_m};
  const Vec3d own{-side * h, 0.0, -h}, other{side * h, 0.0, -h}, along{-side * h, 0.0, -h};
  const double k = 2.0 * pi * what.frequencies[0].in(hertz) / kSpeedOfLight_m_per_s;
  const Vec3d view = -normalised(p);
  const auto lit = [&](Vec3d at, Vec3d normal, Vec3d from, double path) {
    Phasor sum;
    for (const Vec3d emitter : what.emitters_m) {
      const Vec3d to = emitter - at;
      const double d = norm(to);
      sum += std::polar(reflectance(what.material, normal, from, to / d, what.fresnel) *
                            std::max(0.0, dot(normal, to / d)) / (d * d),
                        k * (d + path));
    }
    return sum;
  };
  const Phasor direct = lit(p, own, view, norm(p));
  const double low = std::log(1e-7), span = std::log(c.board_m) - low;
  Phasor twice;
  for (int i = 0; i < n; ++i) {
    const double q = std::exp(low + (i + 0.5) / n * span), rho = std::hypot(q, q0);
    const double top = std::asinh(0.5 * c.height_m / rho);
    for (int j = 0; j < n; ++j) {
      const double v = top * (2.0 * (j + 0.5) / n - 1.0);
      const Vec3d at = edge + q * along + Vec3d{0.0, rho * std::sinh(v), 0.0};
      const Vec3d to = at - p;
      const double d = norm(to);
      const double area = q * span / n * rho * std::cosh(v) * 2.0 * top / n;
      twice += area * reflectance(what.material, own, view, to / d) * dot(own, to / d) *
               dot(other, -to / d) / (d * d) * lit(at, other, -to / d, d + norm(p));
    }
  }
  return std::arg((direct + twice) * std::conj(direct)) / (2.0 * k) * 1e3;
}

const std::vector<double> kRays{-0.7, -0.45, -0.2, -0.05, 0.02, 0.1, 0.3, 0.6};

TEST(PublishedArbiter, QuadratureHasConvergedAndKnowsTheInfiniteCorner) {
  // The infinite corner's row of D = 1.5 m, albedo 0.8, 80 MHz: 40.83, 66.54 mm at 10, 30 cm from
  // the edge (two-bounce quadrature of an infinite corner, light at the pinhole). Boards 40 m long
  // and tall miss less than 0.1 mm of it.
  CornerTrace what{.corner = {.depth_m = 1.5, .board_m = 40.0, .height_m = 40.0},
                   .material = {.albedo = 0.8, .roughness = -1.0},
                   .emitters_m = {{0, 0, 0}},
                   .frequencies = {80_MHz}};
  const auto rayAt = [](double s) { return s * std::sqrt(0.5) / (1.5 - s * std::sqrt(0.5)); };
  EXPECT_NEAR(twoBounceError_mm(what, rayAt(0.1), 600), 40.83, 0.1);
  EXPECT_NEAR(twoBounceError_mm(what, rayAt(0.3), 600), 66.54, 0.1);
  CornerTrace glossy;
  for (const double t : kRays)
    EXPECT_NEAR(twoBounceError_mm(glossy, t, 150), twoBounceError_mm(glossy, t, 300), 0.02) << t;
}

TEST(PublishedArbiter, ReferenceTracerAgreesForBothMaterials) {
  for (const double roughness : {-1.0, 0.5}) {
    CornerTrace what{.material = {.albedo = 0.9, .roughness = roughness}, .paths = 1 << 18};
    const CornerErrors traced = traceCorner(what, kRays);
    for (std::size_t i = 0; i < kRays.size(); ++i) {
      const double exact = twoBounceError_mm(what, kRays[i], 200);
      // 8 rays × 2 materials at 4 σ: a false alarm in 1000 runs; σ is an upper bound, samples are
      // even.
      EXPECT_NEAR(traced.error_mm[0][i], exact, 0.03 + 4.0 * traced.sigma_mm[i])
          << "ray " << kRays[i] << " roughness " << roughness << " seed " << what.seed;
      EXPECT_LT(traced.sigma_mm[i], 0.6) << "no power";
    }
  }
}

TEST(PublishedArbiter, OurTracerAgreesInThePublishedCorner) {
  using validate::materialToml, validate::wallToml;
  const auto scene = sim::Scene::parse(materialToml("board", 0.9) +
                                           wallToml({-1000, 1000, 0, 2000, 2000, "board"}) +
                                           wallToml({0, 2000, 1000, 1000, 2000, "board"}),
                                       "corner.toml");
  ASSERT_TRUE(scene.ok());
  CornerTrace what{.material = {.albedo = 0.9, .roughness = -1.0}};
  const auto camera = sim::SensorModel::load(std::filesystem::path{TOFTWIN_SOURCE_DIR} /
                                             "tools/validate/datasets/tof-thesis-2018/published_camera.toml");
  ASSERT_TRUE(camera.ok()) << camera.error().message;
  sim::TraceRequest request = camera->traceRequest();
  request.harmonics = 1;
  request.pixel_extent = 0.0;
  request.camera.width = 16, request.camera.height = 1;
  request.camera.fx = request.camera.fy = 11.0, request.camera.cx = 7.7, request.camera.cy = 0.0;
  std::vector<double> direct;
  for (const int surfaces : {1, 2}) {
    const auto line = validate::readSines(
        validate::traceLine(request, *scene, {.samples = 16384, .surfaces = surfaces, .seed = 71}));
    for (std::size_t i = 0; i < line.t.size(); ++i) {
      if (surfaces == 1) {
        direct.push_back(line.range_mm[i]);
        continue;
      }
      // 16384 even samples per ray leave under 0.2 mm (3 σ), seen as scatter over seeds.
      EXPECT_NEAR(line.range_mm[i] - direct[i], twoBounceError_mm(what, line.t[i], 200), 0.2 + 0.6)
          << line.t[i];
    }
  }
}

/// All sixteen surfaces of an infinite corner, D = 1.5 m, albedo 0.8, 80 MHz, at 1, 5, 20, 50 mm
/// from the edge (double-precision Monte-Carlo of another program, ± 0.05 … 0.25 mm).
struct RayOffset {
  double minimum_mm;
  double error_mm[4];
};
void PrintTo(const RayOffset& row, std::ostream* out) { *out << row.minimum_mm << " mm"; }
class EdgeOfTheCorner : public testing::TestWithParam<RayOffset> {};

TEST_P(EdgeOfTheCorner, FollowsTheRayOffsetAsTabulated) {
  const RayOffset& row = GetParam();
  std::vector<double> t;
  for (const double s : {0.001, 0.005, 0.020, 0.050})
    t.push_back(s * std::sqrt(0.5) / (1.5 - s * std::sqrt(0.5)));
  const CornerTrace what{.corner = {.depth_m = 1.5, .board_m = 60.0, .height_m = 60.0},
                         .material = {.albedo = 0.8, .roughness = -1.0},
                         .emitters_m = {{0, 0, 0}},
                         .frequencies = {80_MHz},
                         .max_surfaces = 16,
                         .minimum_ray_m = 1e-3 * row.minimum_mm,
                         .paths = 1 << 20,
                         .seed = 5};
  const CornerErrors traced = traceCorner(what, t);
  for (std::size_t i = 0; i < t.size(); ++i) {
    EXPECT_NEAR(traced.error_mm[0][i], row.error_mm[i], 0.25 + 3.0 * traced.sigma_mm[i])
        << "ray " << i << ", seed " << what.seed;
    EXPECT_LT(traced.sigma_mm[i], 0.12) << "no power to tell 1 mm from 10 mm";
  }
}

INSTANTIATE_TEST_SUITE_P(Offsets, EdgeOfTheCorner,
                         testing::Values(RayOffset{0, {4.92, 12.90, 28.67, 46.55}},
                                         RayOffset{1, {4.94, 12.91, 28.66, 46.55}},
                                         RayOffset{10, {3.19, 12.40, 28.59, 46.50}},
                                         RayOffset{20, {2.38, 10.47, 28.35, 46.37}}),
                         [](const testing::TestParamInfo<RayOffset>& row) {
                           return "Minimum" +
                                  std::to_string(static_cast<int>(row.param.minimum_mm)) + "mm";
                         });

TEST(Convergence, ErrorFallsAtLeastAsTheRootOfThePaths) {
  // RMS over 8 rays and 12 seeds against quadrature, from 2¹⁰ to 2¹⁶ paths. The lattice of the
  // first bounces makes it fall faster than N^-½; the slope's own error is about 0.04.
  double log_error[2];
  const CornerTrace base{.material = {.albedo = 0.9, .roughness = -1.0}};
  std::vector<double> exact;
  for (const double ray : kRays) exact.push_back(twoBounceError_mm(base, ray, 300));
  for (const int step : {0, 1}) {
    double square = 0.0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      CornerTrace what = base;
      what.paths = 1 << (10 + 6 * step), what.seed = seed;
      const CornerErrors traced = traceCorner(what, kRays);
      for (std::size_t i = 0; i < kRays.size(); ++i)
        square += std::pow(traced.error_mm[0][i] - exact[i], 2);
    }
    log_error[step] = 0.5 * std::log2(square);
  }
  const double slope = (log_error[1] - log_error[0]) / 6.0;
  RecordProperty("slope", std::to_string(slope));
  EXPECT_LT(slope, -0.5 + 0.12);
}

class PublishedData : public testing::Test {
 protected:
  void SetUp() override {
    const auto found = validate::findData("tof-thesis-2018", {}, std::filesystem::path{TOFTWIN_SOURCE_DIR} / "dataset.toml");
    if (!found) GTEST_SKIP() << "no tof-thesis-2018 in $TOFTWIN_DATA or ../shared/data";
    folder = *found / "published_simulation";
  }
  /// A published corner curve: errors along each ray.
  std::pair<std::vector<double>, std::vector<double>> curve(const std::string& file, std::size_t every) {
    std::pair<std::vector<double>, std::vector<double>> result;
    const auto columns = table::readNumbers(folder / file, {"x_mm", "z_mm", "reference_z_mm"});
    if (!columns) return result;
    for (std::size_t i = every / 2; i < (*columns)[0].size(); i += every) {
      const double t = (*columns)[0][i] / (*columns)[2][i];  // x belongs to the reference point
      result.first.push_back(t);
      result.second.push_back(((*columns)[1][i] - (*columns)[2][i]) * std::sqrt(1.0 + t * t));
    }
    return result;
  }
  /// Theirs − exact for every 8th ray: mean over the line.
  double meanDifference(const CornerTrace& what) {
    const auto columns =
        table::readNumbers(folder / "corner_max_path_length_2.csv", {"x_mm", "z_mm", "reference_z_mm"});
    if (!columns) return std::nan("");
    double sum = 0.0;
    int n = 0;
    for (std::size_t i = 4; i < (*columns)[0].size(); i += 8, ++n) {
      const double t = (*columns)[0][i] / (*columns)[2][i];
      const double theirs = ((*columns)[1][i] - (*columns)[2][i]) * std::sqrt(1.0 + t * t);
      sum += theirs - twoBounceError_mm(what, t, 100);
    }
    return sum / n;
  }
  std::filesystem::path folder;
};

// Their curve scatters by 1.7 mm from ray to ray: 0.2 mm is one standard error of the mean of 64
// rays.
TEST_F(PublishedData, TwoSurfaceCornerIsExactForTheirMaterialWithTheWholeAngleFresnel) {
  EXPECT_NEAR(meanDifference({.fresnel = EmitterFresnel::WholeAngle}), 0.0, 0.7);
}

TEST_F(PublishedData, EveryOtherReadingOfItsModelIsExcluded) {
  const EmitterFresnel slip = EmitterFresnel::WholeAngle;
  EXPECT_LT(meanDifference({}), -1.2) << "Fresnel at the half angle, as it should be";
  EXPECT_LT(meanDifference({.fresnel = slip, .frequencies = {20_MHz}}), -2.0);
  EXPECT_GT(meanDifference({.material = {.albedo = 0.8}, .fresnel = slip}), 3.0);
  EXPECT_LT(meanDifference({.material = {.roughness = 0.0}, .fresnel = slip}), -5.0);
  EXPECT_LT(meanDifference({.material = {.albedo = 0.8, .roughness = -1.0}}), -10.0);
}

TEST_F(PublishedData, SquareWaveDistanceErrorIsTheClosedFormWithTheOtherSign) {
  const auto rays = table::readNumbers(folder / "corner_path_length_16_reference.csv", {"x_mm", "z_mm"});
  ASSERT_TRUE(rays.ok());
  for (const int mhz : {20, 30}) {
    const auto table = table::readNumbers(folder / ("distance_error_" + std::to_string(mhz) + "mhz.csv"),
                                   {"reference_mm", "reference_minus_measured_mm"});
    ASSERT_TRUE(table.ok());
    double square = 0.0;
    for (std::size_t i = 0; i < (*table)[0].size(); ++i) {
      const double t = (*rays)[0][i] / (*rays)[1][i], root = std::sqrt(1.0 + t * t);
      const double e = squareWaveError_mm(1e-3 * (*table)[0][i] * root,
                                          Frequency{static_cast<double>(mhz), megahertz}) /
                       root;
      square += std::pow((*table)[1][i] - e, 2);
    }
    // Two readings cut to whole millimetres differ by 0.41 mm RMS; the rest is the rays' own
    // rounding.
    EXPECT_LT(std::sqrt(square / static_cast<double>((*table)[0].size())), 0.6) << mhz;
  }
}

/// The README's "who is right": root mean squares over all ten curves, every eighth ray.
TEST_F(PublishedData, OneSlipExplainsWhatTheirTenCurvesAreOffTheirOwnModelBy) {
  double exact_square = 0.0, slip_square = 0.0;
  int n = 0;
  const auto add = [&](const std::string& file, int surfaces, double roughness) {
    const auto [t, theirs] = curve(file, 8);
    ASSERT_FALSE(t.empty()) << file;
    for (const auto fresnel : {EmitterFresnel::HalfAngle, EmitterFresnel::WholeAngle}) {
      // Two independent traces: the product of what both leave has none of their own noise in its mean.
      const auto traced = [&](std::uint64_t seed) {
        return traceCorner({.material = {.albedo = 0.9, .roughness = roughness},
                            .fresnel = fresnel,
                            .max_surfaces = surfaces,
                            .paths = 4096,
                            .seed = seed}, t);
      };
      const CornerErrors one = traced(1), other = traced(2);
      for (std::size_t i = 0; i < t.size(); ++i)
        (fresnel == EmitterFresnel::HalfAngle ? exact_square : slip_square) += (theirs[i] - one.error_mm[0][i]) * (theirs[i] - other.error_mm[0][i]);
    }
    n += static_cast<int>(t.size());
  };
  for (const int surfaces : {2, 3, 5, 9}) add("corner_max_path_length_" + std::to_string(surfaces) + ".csv", surfaces, 0.5);
  for (const char* roughness : {"0.0", "0.2", "0.4", "0.6", "0.8", "1.0"})
    add(std::string{"corner_roughness_"} + roughness + ".csv", 16, std::stod(roughness));
  EXPECT_NEAR(std::sqrt(exact_square / n), 5.2, 0.15);
  // With the noise of one trace in it this was 2.4; without, what is left can only be less.
  EXPECT_LT(std::sqrt(std::max(0.0, slip_square) / n), 2.4 + 0.15);
}

/// docs/edge-of-the-corner.md: their curve within 30 mm of the edge against their model with a minimum ray distance.
TEST_F(PublishedData, AMinimumRayDistanceOfTwentyMillimetresIsExcludedByTheirEdge) {
  const auto [all_t, all] = curve("corner_max_path_length_9.csv", 1);
  std::vector<double> t, theirs;
  for (std::size_t i = 0; i < all_t.size(); ++i) {
    if (std::abs(std::numbers::sqrt2 * 2000.0 * all_t[i] / (1.0 + std::abs(all_t[i]))) < 30.0)
      t.push_back(all_t[i]), theirs.push_back(all[i]);
  }
  const auto left = [&](double minimum_mm) {
    const auto traced = [&](std::uint64_t seed) {
      return traceCorner({.fresnel = EmitterFresnel::WholeAngle, .max_surfaces = 9, .minimum_ray_m = 1e-3 * minimum_mm, .paths = 1 << 14, .seed = seed}, t);
    };
    const CornerErrors one = traced(1), other = traced(2);
    double square = 0.0;
    for (std::size_t i = 0; i < t.size(); ++i) square += (theirs[i] - one.error_mm[0][i]) * (theirs[i] - other.error_mm[0][i]);
    return std::sqrt(std::max(0.0, square) / static_cast<double>(t.size()));
  };
  EXPECT_LT(left(0.0), 1.2);
  EXPECT_LT(left(5.0), 1.2);
  EXPECT_GT(left(20.0), 2.0);
  EXPECT_GT(left(50.0), 5.0);
}

TEST(SquareWave, ErrorHasTheWigglingOfFourTaps) {
  // Largest at u = (1 − √(4/π − 1))/2 of a quarter period: 56.55 mm at 30 MHz, read too near.
  const double u = 0.5 * (1.0 - std::sqrt(4.0 / pi - 1.0));
  const double range = 0.25 * u * unambiguousRange(30_MHz).in(metre);
  EXPECT_NEAR(squareWaveError_mm(range, 30_MHz), -56.55, 0.01);
  EXPECT_NEAR(squareWaveError_mm(range + unambiguousRange(30_MHz).in(metre), 30_MHz), -56.55, 0.01);
}

TEST(TwoGates, AmbientPullsToTheMiddle) {
  const double reach = 0.5 * unambiguousRange(20_MHz).in(metre);
  EXPECT_NEAR(twoGateError_mm(0.3 * reach, 20_MHz, 0.0), 0.0, 1e-9);
  EXPECT_NEAR(twoGateError_mm(0.5 * reach, 20_MHz, 0.1), 0.0, 1e-9);
  // d (S₂ + a)/(1 + 2a): at a quarter of the reach with a = 0.1, (0.35/1.2 − 0.25) · reach.
  EXPECT_NEAR(twoGateError_mm(0.25 * reach, 20_MHz, 0.1), 1e3 * reach * (0.35 / 1.2 - 0.25), 1e-9);
}

}  // namespace
}  // namespace toftwin::published
