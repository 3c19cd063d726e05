// SPDX-License-Identifier: Apache-2.0
// The samplers: all have the same mean, the shared one among them whatever its pixels see; the noise that
// they state is the noise that they have; other frames have other noise.
#include <algorithm>
#include <array>
#include <numeric>

#include "tests/tracer/corner.h"
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {
namespace {

/// Matt and rough surfaces, some of which shine, under an even sky; edges, a sphere, and a wall with a slot.
Scene variedScene() {
  return sceneOf(R"(
    [ambient]
    radiance_w_per_m2_sr = 0.05
    [[material]]
    name = "white"
    albedo = 0.8
    [[material]]
    name = "rough"
    model = "oren-nayar"
    albedo = 0.7
    sigma_deg = 35
    [[material]]
    name = "lamp"
    albedo = 0.3
    emission_w_per_m2_sr = 0.2
    [[object]]
    shape = "rectangle"
    size_m = [3, 2, 0]
    position_m = [0, 0, 1.6]
    material = "rough"
    [[object]]
    shape = "rectangle"
    size_m = [3, 2, 0]
    position_m = [0, 0.5, 1]
    euler_deg = [90, 0, 0]
    material = "white"
    [[object]]
    shape = "box"
    size_m = [0.3, 0.5, 0.3]
    position_m = [-0.2, 0.2, 1.2]
    euler_deg = [0, 30, 0]
    material = "rough"
    [[object]]
    shape = "sphere"
    radius_m = 0.2
    position_m = [0.3, 0.25, 1.1]
    material = "lamp"
  )");
}

TraceRequest variedRequest() {
  TraceRequest request = requestFor(24, 16, 18.0, {80_MHz, 20_MHz});
  request.emitters = {
      EmitterSpec{.position_m = {0.05, 0.0, 0.0}, .power_w = 2.0, .half_angle = 60.0 * degree},
      EmitterSpec{.position_m = {-0.3, -0.2, 0.1}, .radius = 2_cm, .power_w = 1.0}};
  request.harmonics = 2;
  request.pixel_extent = 1.0;
  request.max_surfaces = 5;
  return request;
}

/// What one frame of an image amounts to, as numbers to compare: phasors, steady and ambient light of each
/// tile.
std::vector<double> summary(const Light& light) {
  std::vector<double> values;
  const auto add = [&](const auto& pixelOf) {
    for (int top = 0; top < light.height(); top += 4) {
      for (int left = 0; left < light.width(); left += 4) {
        double sum = 0.0;
        for (int p = 0; p < 16; ++p) sum += static_cast<double>(pixelOf(left + p % 4, top + p / 4));
        values.push_back(sum / 16.0);
      }
    }
  };
  for (const auto& phasor : light.phasors) {
    add([&](int x, int y) { return phasor(x, y).real(); });
    add([&](int x, int y) { return phasor(x, y).imag(); });
  }
  add([&](int x, int y) { return light.steady(x, y); });
  add([&](int x, int y) { return light.ambient(x, y); });
  return values;
}

struct Spread {
  std::vector<double> mean, variance;  ///< of the mean
};
Spread spreadOver(const Scene& scene, TraceRequest request, int seeds) {
  Spread spread;
  std::vector<double> squares;
  for (int seed = 0; seed < seeds; ++seed) {
    request.seed = static_cast<std::uint64_t>(seed) + 1000;
    const std::vector<double> values = summary(trace(scene, request));
    spread.mean.resize(values.size());
    squares.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      spread.mean[i] += values[i], squares[i] += values[i] * values[i];
  }
  for (std::size_t i = 0; i < squares.size(); ++i) {
    spread.mean[i] /= seeds;
    spread.variance.push_back((squares[i] / seeds - spread.mean[i] * spread.mean[i]) / (seeds - 1));
  }
  return spread;
}

/// Each of 24 parts of the image in each of its ten quantities, by the spread over seeds. Two means of 40
/// each differ by t with about 60 degrees of freedom; of 240 values one beyond 5.5 comes by chance in 5000
/// such tests.
TEST(Sampler, AllHaveTheSameMean) {
  const Scene scene = variedScene();
  TraceRequest request = variedRequest();
  for (const int surfaces : {2, 5}) {
    request.max_surfaces = surfaces;
    request.sampler = Sampler::Even;
    request.samples_per_pixel = 96;
    const Spread even = spreadOver(scene, request, 40);
    for (const Sampler sampler : {Sampler::Plain, Sampler::Shared}) {
      request.sampler = sampler;
      request.samples_per_pixel = sampler == Sampler::Plain ? 96 : 16;
      const Spread other = spreadOver(scene, request, 40);
      double worst = 0.0, square = 0.0;
      for (std::size_t i = 0; i < even.mean.size(); ++i) {
        const double z = (other.mean[i] - even.mean[i]) / std::sqrt(even.variance[i] + other.variance[i]);
        worst = std::max(worst, std::abs(z));
        square += z * z / static_cast<double>(even.mean.size());
      }
      EXPECT_LT(worst, 5.5) << surfaces << " surfaces, sampler " << static_cast<int>(sampler);
      std::cout << surfaces << " surfaces, sampler " << static_cast<int>(sampler) << ": worst " << worst
                << ", mean square " << square << "\n";
    }
  }
}

/// How far ranges at 80 MHz lie from their mean over seeds, pixel by pixel, and what the tracer said of that.
struct Noise {
  double actual_m2 = 0.0, stated_m2 = 0.0;  ///< means over pixels
  double covered = 0.0,
         covered_error = 0.0;  ///< share within two stated standard deviations, its standard error
};
Noise noiseOf(const Scene& scene, TraceRequest request, int seeds) {
  std::vector<Light> lights;
  for (int seed = 0; seed < seeds; ++seed) {
    request.seed = static_cast<std::uint64_t>(seed) + 5000;
    lights.push_back(trace(scene, request));
  }
  const auto pixels = lights[0].steady.size();
  const double k2 = 2.0 * wavenumber(80_MHz);
  Noise noise;
  std::vector<double> covered(lights.size());
  for (std::size_t p = 0; p < pixels; ++p) {
    Complex mean;
    for (const Light& light : lights) mean += Complex{light.phasors[0][p]} / double(seeds);
    for (std::size_t s = 0; s < lights.size(); ++s) {
      const Complex z{lights[s].phasors[0][p]};
      const double error = std::arg(z * std::conj(mean)) / k2;
      const double stated = static_cast<double>(lights[s].variance[0][p]) / std::norm(z) / (k2 * k2);
      noise.actual_m2 += error * error / (seeds - 1) / static_cast<double>(pixels);
      noise.stated_m2 += stated / seeds / static_cast<double>(pixels);
      covered[s] += (error * error < 4.0 * stated ? 1.0 : 0.0) / static_cast<double>(pixels);
    }
  }
  for (const double share : covered) noise.covered += share / seeds;
  for (const double share : covered) noise.covered_error += std::pow(share - noise.covered, 2);
  noise.covered_error = std::sqrt(noise.covered_error / seeds / (seeds - 1));
  return noise;
}

TraceRequest noisyRequest(int samples) {
  TraceRequest request = variedRequest();
  request.frequencies = {80_MHz};
  request.harmonics = 1;
  request.sampler = Sampler::Shared;
  request.samples_per_pixel = samples;
  return request;
}

/// A plate's edges before a wall, and their shadow on it, at a slant: some of the pixels that they cross have a sliver of
/// one side only. Sixteen times as many samples of direct light, evenly spread, leave less than a sixteenth of the
/// variance that even samples of each pixel by itself have. The pixels are chosen by other seeds than they are judged by;
/// the test prints how many times less it is, which is more than twice what it asks for.
TEST(SharedSampler, KnowsPixelsAcrossEdgesByMoreDirectLight) {
  const Scene scene = sceneOf(R"(
    [[material]]
    name = "grey"
    albedo = 0.1
    [[object]]
    shape = "rectangle"
    size_m = [4, 4, 0]
    position_m = [0, 0, 2]
    material = "grey"
    [[object]]
    shape = "rectangle"
    size_m = [0.4, 0.3, 0]
    position_m = [0.02, 0, 1.5]
    euler_deg = [0, 0, 17]
    material = "grey"
  )");
  TraceRequest request = requestFor(48, 32, 60.0, {80_MHz});
  request.emitters = {EmitterSpec{.position_m = {0.2, 0.1, 0.0}, .half_angle = 60.0 * degree}};
  request.pixel_extent = 1.0;
  request.max_surfaces = 2;
  request.samples_per_pixel = 16;
  const auto variances = [&](Sampler sampler, std::uint64_t first_seed) {
    std::vector<double> of_pixels(48 * 32), squares(of_pixels.size());
    std::vector<Complex> means(of_pixels.size());
    constexpr int kSeeds = 24;
    request.sampler = sampler;
    for (int seed = 0; seed < kSeeds; ++seed) {
      request.seed = first_seed + static_cast<std::uint64_t>(seed);
      const Light light = trace(scene, request);
      for (std::size_t p = 0; p < means.size(); ++p) {
        means[p] += Complex{light.phasors[0][p]} / double(kSeeds);
        squares[p] += std::norm(Complex{light.phasors[0][p]}) / kSeeds;
      }
    }
    for (std::size_t p = 0; p < means.size(); ++p)
      of_pixels[p] = (squares[p] - std::norm(means[p])) * kSeeds / (kSeeds - 1.0);
    return of_pixels;
  };
  const std::vector<double> choosing = variances(Sampler::Even, 8000), even = variances(Sampler::Even, 9000),
                            shared = variances(Sampler::Shared, 9000);
  const double most = *std::ranges::max_element(choosing);
  double of_even = 0.0, of_shared = 0.0;
  int edges = 0;
  for (std::size_t p = 0; p < even.size(); ++p) {
    if (choosing[p] < 0.1 * most) continue;
    ++edges, of_even += even[p], of_shared += shared[p];
  }
  ASSERT_GT(edges, 40);
  EXPECT_GT(of_even, 16.0 * of_shared) << edges << " pixels";
  std::cout << edges << " pixels across edges: " << of_even / of_shared << " times less variance\n";
}

/// A tile with the edge of a shadow in it: three columns of pixels lit, one across the edge, four dark but for light
/// from other surfaces. By lookAtCorners() that is √((3 · 8 · 1 + 8 · 9 + 4 · 8 · 81) / 64), six times the samples,
/// and a sixth of the variance. Where a pixel is its central ray alone nothing is looked at: next to that, a
/// millionth of a pixel more sees the same places with the samples that its corners ask for. Each of 24 seeds states
/// a variance by 15 degrees of freedom or more, which the dark pixels of a tile have in common at worst: the standard
/// deviation of their ratio is √(4 / (24 · 15)), 11 %, and four is three of them below six. The tile beside it, lit
/// all over, takes as many samples as ever.
TEST(SharedSampler, TakesMoreSamplesWhereLightIsUneven) {
  const Scene scene = sceneOf(R"(
    [[material]]
    name = "white"
    albedo = 0.7
    [[object]]
    shape = "rectangle"
    size_m = [4, 4, 0]
    position_m = [0, 0, 2]
    material = "white"
    [[object]]
    shape = "rectangle"
    size_m = [4, 4, 0]
    position_m = [0, 0.5, 1]
    euler_deg = [90, 0, 0]
    material = "white"
    [[object]]
    shape = "rectangle"
    size_m = [0.4, 0.4, 0]
    position_m = [0.74375, 0, 1]
    material = "white"
  )");
  TraceRequest request = requestFor(16, 8, 80.0, {80_MHz});
  request.emitters = {EmitterSpec{.position_m = {1.0, 0.0, 0.0}, .half_angle = 80.0 * degree}};
  request.max_surfaces = 3;
  request.samples_per_pixel = 64;
  request.sampler = Sampler::Shared;
  const auto variances = [&](double extent) {
    std::pair<double, double> of_lit_and_dark;
    request.pixel_extent = extent;
    for (int seed = 0; seed < 24; ++seed) {
      request.seed = 7000 + static_cast<std::uint64_t>(seed);
      const Light light = trace(scene, request);
      for (int i = 0; i < 32; ++i) {
        of_lit_and_dark.first += static_cast<double>(light.variance[0](i % 4, i / 4));
        of_lit_and_dark.second += static_cast<double>(light.variance[0](12 + i % 4, i / 4));
      }
    }
    return of_lit_and_dark;
  };
  const auto usual = variances(0.0), looked = variances(1e-6);
  ASSERT_GT(usual.second, 0.0);
  EXPECT_GT(usual.second, 4.0 * looked.second);
  EXPECT_NEAR(usual.first / looked.first, 1.0, 0.33);
  std::cout << "beside a shadow " << usual.second / looked.second << " times less variance, where all is lit "
            << usual.first / looked.first << "\n";
}

/// The spread of sixteen batches says how far the mean may be off: within two standard deviations of that
/// kind lie 93.6 % (Student's distribution, 15 degrees of freedom), and as batches together are more even
/// than apart, it is rather more. But a statement that covers everything says nothing.
TEST(SharedSampler, StatesItsNoise) {
  const int seeds = 60;
  const Noise noise = noiseOf(variedScene(), noisyRequest(48), seeds);
  EXPECT_GT(noise.covered, 0.936 - 3.0 * noise.covered_error);
  EXPECT_LT(noise.covered, 0.98);
  EXPECT_LT(noise.actual_m2, noise.stated_m2);
  std::cout << "stated " << std::sqrt(noise.stated_m2) * 1e3 << " mm, actual "
            << std::sqrt(noise.actual_m2) * 1e3 << " mm; within two: " << noise.covered << " +- "
            << noise.covered_error << "\n";
}

/// Where 10 mm are wanted, there are less than 10, but not as little as the most samples leave, and what is
/// stated then is true again: the pilot's samples don't count.
TEST(WantedNoise, IsReachedWithoutTakingAllSamples) {
  const Scene scene = variedScene();
  TraceRequest request = noisyRequest(256);
  const Noise least = noiseOf(scene, request, 12);
  request.wanted_noise = 10_mm;
  const Noise noise = noiseOf(scene, request, 40);
  EXPECT_LT(std::sqrt(noise.actual_m2), 10e-3);
  EXPECT_GT(noise.actual_m2, 2.0 * least.actual_m2);
  EXPECT_GT(noise.covered, 0.936 - 3.0 * noise.covered_error);
  request.wanted_noise = 1_um;  // out of reach: as many as there may be
  request.samples_per_pixel = 64;
  Light all = trace(scene, request);
  request.wanted_noise = {};
  EXPECT_EQ(all.phasors[0], trace(scene, request).phasors[0]);
}

/// A tile that takes more samples because its pilot met something bright would be too bright in the mean if the pilot's
/// were samples of its own. As AllHaveTheSameMean: 240 means, 5.5 standard errors.
TEST(WantedNoise, DoesNotMakeTheMeanAnother) {
  const Scene scene = variedScene();
  TraceRequest request = variedRequest();
  request.max_surfaces = 2;
  request.sampler = Sampler::Even;
  request.samples_per_pixel = 96;
  const Spread even = spreadOver(scene, request, 40);
  request.sampler = Sampler::Shared;
  request.samples_per_pixel = 128;
  request.wanted_noise = 10_mm;
  const Spread wanted = spreadOver(scene, request, 80);
  double worst = 0.0;
  for (std::size_t i = 0; i < even.mean.size(); ++i)
    worst = std::max(worst, std::abs(wanted.mean[i] - even.mean[i]) / std::sqrt(even.variance[i] + wanted.variance[i]));
  EXPECT_LT(worst, 5.5);
  std::cout << "worst " << worst << "\n";
}

/// One pixel alone knows its noise less well: from a pilot of 64 samples.
TEST(WantedNoise, WorksWithoutSharing) {
  const Scene scene = variedScene();
  TraceRequest request = noisyRequest(1024);
  request.sampler = Sampler::Even;
  request.wanted_noise = 10_mm;
  const Noise noise = noiseOf(scene, request, 12);
  EXPECT_LT(std::sqrt(noise.actual_m2), 10e-3);
  EXPECT_GT(std::sqrt(noise.actual_m2), 2e-3);
}

/// What frames have in common in their noise. Each frame's error is that of one sample, from the mean of all;
/// over n independent tiles the correlation of independent errors has the standard deviation 1/√n, less if
/// pixels of a tile differ: n = 200 · 256 pairs of tiles and five standard deviations.
TEST(Frames, HaveNoiseOfTheirOwn) {
  TraceRequest request = requestFor(128, 128, 110.0, {80_MHz});
  request.max_surfaces = 2;
  request.pixel_extent = 1.0;
  const Scene scene = variedScene();
  for (const Sampler sampler : {Sampler::Even, Sampler::Shared}) {
    request.sampler = sampler;
    const int frames = sampler == Sampler::Shared ? 201 : 21;
    std::vector<Image<std::complex<float>>> light;
    for (int frame = 0; frame < frames; ++frame) {
      // As View numbers the frames of a simulated camera and its exposures.
      request.seed = 1 + static_cast<std::uint64_t>(frame + 1) * 0x9e3779b97f4a7c15u;
      light.push_back(trace(scene, request).phasors[0]);
    }
    double products = 0.0, squares = 0.0;
    for (std::size_t p = 0; p < light[0].size(); ++p) {
      Complex mean;
      for (const auto& frame : light) mean += Complex{frame[p]} / double(frames);
      double variance = 0.0, product = 0.0;
      for (std::size_t f = 0; f < light.size(); ++f) variance += std::norm(Complex{light[f][p]} - mean);
      if (!(variance > 1e-8 * std::norm(mean))) continue;  // no multipath there
      for (std::size_t f = 1; f < light.size(); ++f) {
        product += (std::conj(Complex{light[f - 1][p]} - mean) * (Complex{light[f][p]} - mean)).real();
      }
      // Both relative to the pixel's variance; a mean of n frames takes 1/n off the products.
      products += product / variance + 1.0 / frames;
      squares += 1.0;
    }
    const double pairs = (frames - 1.0) * (sampler == Sampler::Shared ? 256 : squares),
                 correlation = products / squares;
    std::cout << "sampler " << static_cast<int>(sampler) << ": correlation " << correlation
              << " of successive frames\n";
    EXPECT_LT(std::abs(correlation), std::min(0.01, 5.0 / std::sqrt(pairs)));
  }
}

}  // namespace
}  // namespace toftwin::sim::testing
