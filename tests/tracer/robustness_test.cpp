// SPDX-License-Identifier: Apache-2.0
// Rays that start on surfaces: nothing leaks out of closed rooms, nothing shadows itself; and the
// image is the same however the work is divided.
#include <tbb/global_control.h>

#include <cstring>

#include "sim/tracer/random.h"
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {
namespace {

/// A closed room whose walls shine with Le and reflect ρ: every path of N surfaces brings exactly
/// Le (1 − ρᴺ)/(1 − ρ), whatever way it takes, as long as it stays inside. One ray in a million that
/// gets out through an edge or starts behind a wall takes up to 1 of 4.7 from its pixel.
std::string furnace(Vec3d at, double rotation_deg, double size, const std::string& more) {
  const auto n = [](double v) { return std::to_string(v); };
  return "[[material]]\nname = 'm'\nalbedo = 0.8\nemission_w_per_m2_sr = 1\n[[object]]\nshape = 'box'\nsize_m = [" +
         n(4 * size) + ", " + n(2.5 * size) + ", " + n(5 * size) + "]\nposition_m = [" + n(at.x) + ", " + n(at.y) + ", " +
         n(at.z) + "]\neuler_deg = [" + n(rotation_deg) + ", " + n(2 * rotation_deg) + ", " + n(3 * rotation_deg) +
         "]\nmaterial = 'm'\n" + more;
}

void expectFurnace(const std::string& toml, Vec3d camera_at) {
  TraceRequest request = requestFor(48, 48, 20.0, {80_MHz});
  request.world_from_camera.translation_m = camera_at;
  request.samples_per_pixel = 32;
  request.pixel_extent = 1.0;
  request.max_surfaces = 10;  // 0.8⁹ = 0.134: no roulette, so no noise at all
  const Light light = trace(sceneOf(toml), request);
  const double exact = (1.0 - std::pow(0.8, 10)) / 0.2;
  for (std::size_t p = 0; p < light.ambient.size(); ++p) {
    ASSERT_NEAR(static_cast<double>(light.ambient[p]), exact, 3e-6 * exact) << "pixel " << p;
  }
}

TEST(Furnace, KeepsAllItsLight) {
  expectFurnace(furnace({}, 0.0, 1.0, ""), {0.3, 0.2, -0.4});
  expectFurnace(furnace({}, 17.0, 1.0, ""), {0.3, 0.2, -0.4});
}
TEST(Furnace, KeepsAllItsLightFarFromTheOriginAndWhenVerySmallOrLarge) {
  const std::string anchor = "[[object]]\nshape = 'sphere'\nradius_m = 0.1\nmaterial = 'm'\n";
  expectFurnace(furnace({100.0, -50.0, 80.0}, 17.0, 1.0, anchor), {100.3, -49.8, 79.6});
  expectFurnace(furnace({}, 11.0, 0.01, ""), {0.003, 0.002, -0.004});
  expectFurnace(furnace({}, 11.0, 100.0, ""), {30.0, 20.0, -40.0});
}
TEST(Furnace, KeepsAllItsLightAroundBodies) {
  expectFurnace(furnace({}, 5.0, 1.0,
                        "[[object]]\nshape = 'sphere'\nradius_m = 0.4\nposition_m = [0.5, 0, 1]\nmaterial = 'm'\n"
                        "[[object]]\nshape = 'cylinder'\nradius_m = 0.3\nheight_m = 0.7\nposition_m = [-0.7, 0, 1]\n"
                        "euler_deg = [70, 20, 0]\nmaterial = 'm'\n"
                        "[[object]]\nshape = 'disc'\nradius_m = 0.3\nposition_m = [0, -0.5, 1]\neuler_deg = [30, 20, 0]\nmaterial = 'm'\n"),
                {0.0, 0.2, -0.4});
}

/// Direct light inside a sphere from its middle is the same everywhere, ρI/πR²: a pixel that shadows
/// itself is black, one that starts outside too.
TEST(SelfShadow, NoPixelOfALitSurfaceIsDark) {
  for (const double at : {0.0, 1000.0}) {
    const std::string anchor = at == 0.0 ? "" : "[[object]]\nshape = 'disc'\nradius_m = 0.1\nmaterial = 'm'\n";
    const std::string place = std::to_string(at);
    const Scene scene = sceneOf("[[material]]\nname = 'm'\nalbedo = 0.5\n[[object]]\nshape = 'sphere'\nradius_m = 2\n"
                                "position_m = [" + place + ", 0, " + place + "]\nmaterial = 'm'\n" + anchor);
    TraceRequest request = requestFor(160, 160, 40.0, {80_MHz});
    request.world_from_camera.translation_m = {at, 0.0, at};
    const Light light = trace(scene, request);
    for (const float steady : light.steady.pixels()) ASSERT_NEAR(static_cast<double>(steady), 0.5 / kPi / 4.0, 1e-6);
  }
}

Scene busyScene() {
  return sceneOf(furnace({}, 5.0, 1.0,
                         "[[object]]\nshape = 'sphere'\nradius_m = 0.4\nposition_m = [0.5, 0, 1]\nmaterial = 'm'\n"
                         "[[object]]\nshape = 'box'\nsize_m = [0.5, 0.5, 0.5]\nposition_m = [-0.5, 0, 1]\nmaterial = 'm'\n"));
}

TraceRequest busyRequest(int samples) {
  TraceRequest request = requestFor(37, 29, 25.0, {80_MHz, 16_MHz});
  request.camera.distortion = {0.09, -0.27, 1e-4, -2e-4, 0.1};
  request.emitters[0].radius = 1_cm;
  request.harmonics = 3;
  request.samples_per_pixel = samples;
  request.max_surfaces = 5;
  request.pixel_extent = 1.0;
  request.seed = 7;
  return request;
}

template <class T>
void expectSameBytes(const Image<T>& a, const Image<T>& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.pixels().data(), b.pixels().data(), a.size() * sizeof(T)), 0);
}

void expectSameBytes(const Light& a, const Light& b) {
  for (std::size_t i = 0; i < a.phasors.size(); ++i) expectSameBytes(a.phasors[i], b.phasors[i]);
  for (std::size_t i = 0; i < a.variance.size(); ++i) expectSameBytes(a.variance[i], b.variance[i]);
  expectSameBytes(a.steady, b.steady);
  expectSameBytes(a.ambient, b.ambient);
  expectSameBytes(a.truth.range_m, b.truth.range_m);
  expectSameBytes(a.truth.normal, b.truth.normal);
}

/// Samples enough for several pieces, of one pixel or tile; and where a pilot says how many.
std::vector<TraceRequest> requestsOfAllKinds() {
  std::vector<TraceRequest> requests;
  for (const int samples : {1, 3, 40, 9000}) requests.push_back(busyRequest(samples));
  for (const int samples : {1, 3, 40, 200}) {
    requests.push_back(busyRequest(samples));
    requests.back().sampler = Sampler::Shared;
  }
  for (const std::size_t most : {3, 7}) {
    TraceRequest& large = requests[most];
    large.region_x = 5, large.region_y = 6, large.region_width = large.region_height = 2;
    TraceRequest piloted = busyRequest(200);
    piloted.sampler = large.sampler;
    piloted.wanted_noise = 30_mm;
    requests.push_back(piloted);
  }
  return requests;
}

TEST(Determinism, OneAndFourThreadsGiveTheSameBytes) {
  const Scene scene = busyScene();
  for (const TraceRequest& request : requestsOfAllKinds()) {
    const auto traceWith = [&](std::size_t threads) {
      const tbb::global_control limit{tbb::global_control::max_allowed_parallelism, threads};
      return trace(scene, request);
    };
    expectSameBytes(traceWith(1), traceWith(4));
  }
}

template <class T>
Image<T> crop(const Image<T>& image, const TraceRequest& region) {
  Image<T> part(region.region_width, region.region_height);
  for (int y = 0; y < part.height(); ++y) {
    for (int x = 0; x < part.width(); ++x) part(x, y) = image(x + region.region_x, y + region.region_y);
  }
  return part;
}

TEST(Determinism, ARegionIsACropOfTheWhole) {
  const Scene scene = busyScene();
  std::vector<TraceRequest> requests = requestsOfAllKinds();
  for (const int samples : {2, 5, 8}) requests.push_back(busyRequest(samples));
  for (TraceRequest request : requests) {
    if (request.region_width != 0) continue;
    const Light whole = trace(scene, request);
    request.region_x = 7;
    request.region_y = 3;
    request.region_width = 19;
    request.region_height = 26;
    const Light part = trace(scene, request);
    for (std::size_t i = 0; i < whole.phasors.size(); ++i) expectSameBytes(crop(whole.phasors[i], request), part.phasors[i]);
    expectSameBytes(crop(whole.steady, request), part.steady);
    expectSameBytes(crop(whole.ambient, request), part.ambient);
    expectSameBytes(crop(whole.truth.range_m, request), part.truth.range_m);
  }
}

TEST(Determinism, AnotherSeedGivesAnotherImage) {
  const Scene scene = busyScene();
  TraceRequest request = busyRequest(4);
  const Light one = trace(scene, request);
  request.seed = 8;
  EXPECT_NE(one.steady, trace(scene, request).steady);
}

/// Spread of one pixel's phasor over many seeds, and the mean of the variances that the tracer states.
struct Spread {
  double actual, stated;
};
Spread spreadOverSeeds(TraceRequest request, int seeds) {
  const Scene scene = busyScene();
  request.region_x = 18;
  request.region_y = 14;
  request.region_width = request.region_height = 1;
  std::vector<Complex> means;
  Complex mean;
  Spread spread{};
  for (int seed = 0; seed < seeds; ++seed) {
    request.seed = static_cast<std::uint64_t>(seed);
    const Light light = trace(scene, request);
    means.push_back(phasorAt(light, 0, 0, 0));
    mean += means.back() / double(seeds);
    spread.stated += static_cast<double>(light.variance[0](0, 0)) / seeds;
  }
  for (const Complex& z : means) spread.actual += std::norm(z - mean) / (2.0 * (seeds - 1));
  return spread;
}

/// The stated variance is that of independent samples, and even samples do better: it is an upper
/// bound. The variance of 400 complex draws has a relative standard deviation of √(2/800): 5 σ.
TEST(Variance, IsNeverLessThanTheSpreadOverSeeds) {
  for (const int samples : {2, 32}) {
    const Spread spread = spreadOverSeeds(busyRequest(samples), 400);
    EXPECT_LT(spread.actual / spread.stated, 1.0 + 5.0 * std::sqrt(2.0 / 800)) << samples;
    EXPECT_GT(spread.actual / spread.stated, 0.2) << samples;
  }
}

/// With one bounce, 256 even samples are worth more than twice as many independent ones.
TEST(Variance, EvenSamplesAreWorthMoreThanIndependentOnes) {
  TraceRequest request = busyRequest(256);
  request.max_surfaces = 2;
  const Spread spread = spreadOverSeeds(request, 200);
  EXPECT_LT(spread.actual / spread.stated, 0.5);
}

/// A (0,2)-sequence: 2ᵏ samples put exactly one into each of the 2ᵏ boxes of every shape 2⁻ᵃ × 2⁻ᵇ, a + b = k.
TEST(Sampling, FillsEveryElementaryBoxOnce) {
  for (std::uint32_t key = 1; key < 20; ++key) {
    for (const int k : {1, 4, 8}) {
      for (int a = 0; a <= k; ++a) {
        std::vector<int> count(std::size_t{1} << k);
        for (std::uint32_t i = 0; i < count.size(); ++i) {
          const RandomPair at = randomPair(pixelKey(seedKey(1), key, 0), i, key);
          const auto x = static_cast<std::size_t>(std::ldexp(at.u, a)), y = static_cast<std::size_t>(std::ldexp(at.v, k - a));
          ++count[(y << a) + x];
        }
        ASSERT_THAT(count, ::testing::Each(1)) << key << " " << k << " " << a;
      }
    }
  }
}

/// Over pixels each sample is uniform, and two dimensions of a path know nothing of each other: mean 1/2,
/// covariance 0, with the standard errors of n draws (1/√12n and 1/12√n): 5 σ.
TEST(Sampling, IsUniformAndUncorrelatedAcrossDimensions) {
  const int n = 40'000;
  for (const std::uint32_t index : {0u, 5u}) {
    double u = 0.0, v = 0.0, uv = 0.0, between = 0.0;
    for (int pixel = 0; pixel < n; ++pixel) {
      const PixelKey key = pixelKey(seedKey(3), static_cast<std::uint32_t>(pixel % 512), static_cast<std::uint32_t>(pixel / 512));
      const RandomPair a = randomPair(key, index, 1), b = randomPair(key, index, 2);
      const auto a_u = static_cast<double>(a.u), a_v = static_cast<double>(a.v), b_u = static_cast<double>(b.u);
      u += a_u / n;
      v += a_v / n;
      uv += (a_u - 0.5) * (a_v - 0.5) / n;
      between += (a_u - 0.5) * (b_u - 0.5) / n;
    }
    EXPECT_NEAR(u, 0.5, 5.0 / std::sqrt(12.0 * n));
    EXPECT_NEAR(v, 0.5, 5.0 / std::sqrt(12.0 * n));
    EXPECT_NEAR(uv, 0.0, 5.0 / (12.0 * std::sqrt(n)));
    EXPECT_NEAR(between, 0.0, 5.0 / (12.0 * std::sqrt(n)));
  }
}

/// Requests that no correct program makes are refused before anything is read or written.
TEST(Request, ThatMakesNoSenseIsRefused) {
  const Scene scene = busyScene();
  const auto refused = [&](auto change) {
    TraceRequest request = busyRequest(1);
    change(request);
    EXPECT_THROW(trace(scene, request), std::invalid_argument);
  };
  refused([](TraceRequest& r) { r.camera.width = 0; });
  refused([](TraceRequest& r) { r.camera.fx = 0.0; });
  refused([](TraceRequest& r) { r.camera.fy = std::nan(""); });
  refused([](TraceRequest& r) { r.samples_per_pixel = 0; });
  refused([](TraceRequest& r) { r.max_surfaces = 0; });
  refused([](TraceRequest& r) { r.harmonics = 0; });
  refused([](TraceRequest& r) { r.region_width = 1 << 30, r.region_height = 5, r.region_x = 36; });
  refused([](TraceRequest& r) { r.region_width = 5, r.region_height = 5, r.region_x = -1; });
  refused([](TraceRequest& r) { r.world_from_camera.translation_m.x = std::nan(""); });
  refused([](TraceRequest& r) { r.frequencies = {Frequency{std::nan(""), megahertz}}; });
}

}  // namespace
}  // namespace toftwin::sim::testing
