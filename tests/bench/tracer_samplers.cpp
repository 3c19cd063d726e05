// SPDX-License-Identifier: Apache-2.0
// Efficiency of the samplers: one over variance of the range × processor seconds, beside plain random numbers
// at equal settings. All samplers have the same mean (the tests see to that), so the spread over seeds is the
// error.
//
// Camera: the Kinect v2's lens, with a light of its cone (45° half-angle) 45 mm beside the lens; 80 MHz
// decides. Of its image 48 patches of 8 × 8 pixels, spread evenly, are traced. Pixels without light don't
// count.
#include "tests/bench/tracer.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdlib>
#include <numbers>
#include <vector>

#include "sim/tracer/trace.h"

namespace toftwin::bench {
namespace {

using namespace toftwin::sim;

constexpr int kSeeds = 8, kPatch = 8;

TraceRequest request(int surfaces, int samples) {
  TraceRequest request;
  request.camera = {.width = 512,
                    .height = 424,
                    .fx = 365.456,
                    .fy = 365.456,
                    .cx = 254.88,
                    .cy = 205.40,
                    .distortion = {0.0905, -0.268, 0.0, 0.0, 0.0951},
                    .calibration_id = {}};
  EmitterSpec light;
  light.position_m = {0.045, 0.0, 0.0};
  light.half_angle = 45.0 * degree;
  request.emitters = {light};
  request.frequencies = {80_MHz, 16_MHz, 120_MHz};
  request.samples_per_pixel = samples;
  request.max_surfaces = surfaces;
  return request;
}

struct Measured {
  double seconds = 0.0;
  std::vector<double> variance_m2;  ///< of the range, pixel by pixel
};

/// The patches' light with each seed.
Measured measure(const Scene& scene, TraceRequest what) {
  Measured measured;
  const double per_radian = kSpeedOfLight_m_per_s / (4.0 * std::numbers::pi * what.frequencies[0].in(hertz));
  what.region_width = what.region_height = kPatch;
  for (int patch = 0; patch < 48; ++patch) {
    what.region_x = 32 + patch % 8 * 64 - 8;
    what.region_y = 32 + patch / 8 * 72 - 8;
    std::vector<Light> lights;
    const double start = threadProcessorMs();
    for (int seed = 0; seed < kSeeds; ++seed) {
      what.seed = static_cast<std::uint64_t>(seed) + 1;
      lights.push_back(trace(scene, what));
    }
    measured.seconds += 1e-3 * (threadProcessorMs() - start) / kSeeds;
    for (int p = 0; p < kPatch * kPatch; ++p) {
      std::complex<double> sum;
      double squares = 0.0;
      for (const Light& light : lights) {
        const std::complex<double> z{light.phasors[0](p % kPatch, p / kPatch)};
        sum += z;
        squares += std::norm(z);
      }
      const double spread = (squares - std::norm(sum) / kSeeds) / (2.0 * (kSeeds - 1));
      const double amplitude = std::norm(sum) / (kSeeds * kSeeds);
      if (amplitude > 0.0) measured.variance_m2.push_back(spread / amplitude * per_radian * per_radian);
    }
  }
  return measured;
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

/// By the pixels' mean variance: of the shared sampler, a number for each row.
std::vector<double> compareIn(const char* name, const Scene& scene) {
  std::vector<double> efficiencies;
  for (const int surfaces : {2, 16}) {
    for (const int samples : {16, 64}) {
      double plain_median = 0.0, plain_mean = 0.0;
      for (const auto& [sampler, word] :
           {std::pair{Sampler::Plain, "plain"}, std::pair{Sampler::Even, "even"},
            std::pair{Sampler::Shared, "shared"}}) {
        TraceRequest what = request(surfaces, samples);
        what.sampler = sampler;
        const Measured measured = measure(scene, what);
        const double middle = median(measured.variance_m2), whole = mean(measured.variance_m2);
        if (sampler == Sampler::Plain)
          plain_median = middle * measured.seconds, plain_mean = whole * measured.seconds;
        fmt::print("| {} | {} | {} | {} | {:.3f} | {:.3f} | {:.3f} | {:.1f} | {:.1f} |\n", name, surfaces,
                   samples, word, measured.seconds, std::sqrt(middle) * 1e3, std::sqrt(whole) * 1e3,
                   plain_median / (middle * measured.seconds), plain_mean / (whole * measured.seconds));
        if (sampler == Sampler::Shared) efficiencies.push_back(plain_mean / (whole * measured.seconds));
      }
    }
  }
  return efficiencies;
}

}  // namespace

Bars compareSamplers(const Scene& room) {
  const tbb::global_control one_thread{tbb::global_control::max_allowed_parallelism, 1};
  fmt::print(
      "\nOne thread; 48 patches of 8 x 8 pixels; sigma of the range at 80 MHz over {} seeds; efficiency is "
      "that of\n"
      "1 / (sigma^2 x seconds) relative to plain random numbers, by the pixels' median and mean sigma^2\n\n",
      kSeeds);
  fmt::print(
      "| scene | surfaces | samples | sampler | s | median [mm] | rms [mm] | efficiency, median | rms |\n");
  fmt::print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  const auto loaded = [](const char* file) {
    return orGiveUp(Scene::load(std::string{TOFTWIN_SCENES} + "/" + file));
  };
  std::vector<double> all;
  for (const auto& [name, scene] : {std::pair{"room", room}, std::pair{"corner", loaded("corner.toml")},
                                    std::pair{"desk", loaded("desk.toml")},
                                    std::pair{"box before wall", loaded("box_before_wall.toml")}}) {
    for (const double efficiency : compareIn(name, scene)) all.push_back(efficiency);
  }
  const double least = *std::ranges::min_element(all), middle = median(all);
  const auto enough = std::ranges::count_if(all, [](double efficiency) { return efficiency >= 10.0; });
  return {{fmt::format("error² × processor time of the unbiased mode, of plain random numbers: median of {}", all.size()),
           fmt::format("{:.0f} times better", middle), "≥ 10 times", middle >= 10.0},
          {"the same, least of them", fmt::format("{:.1f} times better; 10 in {}", least, enough), "≥ 10 times",
           least >= 10.0}};
}

}  // namespace toftwin::bench
