// SPDX-License-Identifier: Apache-2.0
// How far the tracer is from the closed form of a furnace, an integrating sphere with all bounces, where the
// tests have no time to see 1e-4: more and more paths until σ ≤ 3e-5 |P| at each frequency, or no time is
// left.
//   furnace_bench [SECONDS]   of each albedo; default 60
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>

#include "tests/tracer/furnace.h"

namespace {

using namespace toftwin;
using namespace toftwin::sim;
using namespace toftwin::sim::testing;

constexpr double kWantedSigma = 3e-5;

void judge(const Furnace& furnace, std::chrono::duration<double> limit) {
  const Scene scene = furnace.scene();
  TraceRequest request = requestFor(64, 64, 64.0, {16_MHz, 80_MHz, 120_MHz});
  request.samples_per_pixel = 256;
  request.max_surfaces = furnace.surfaces;
  const auto start = std::chrono::steady_clock::now();
  Complex sum[3];
  double variance[3]{};  // of the sum
  double worst = 1.0;
  while (worst > kWantedSigma && std::chrono::steady_clock::now() - start < limit) {
    ++request.seed;
    const Light light = trace(scene, request);
    worst = 0.0;
    for (std::size_t f = 0; f < 3; ++f) {
      const PixelMean mean = meanOfPixels(light, f);
      sum[f] += mean.phasor;
      variance[f] += mean.sigma * mean.sigma;
      const double runs = static_cast<double>(request.seed);
      worst =
          std::max(worst, std::sqrt(variance[f]) / runs / std::abs(furnace.phasor(request.frequencies[f])));
    }
  }
  const double runs = static_cast<double>(request.seed);
  for (std::size_t f = 0; f < 3; ++f) {
    const Complex exact = furnace.phasor(request.frequencies[f]);
    fmt::print("| {} | {:.0f} | {:.0f} | {:.1e} | {:.1e} |\n", furnace.albedo,
               request.frequencies[f].in(megahertz), runs * 64 * 64 * 256 / 1e6,
               std::abs(sum[f] / runs - exact) / std::abs(exact),
               std::sqrt(variance[f]) / runs / std::abs(exact));
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::chrono::duration<double> limit{argc > 1 ? std::atof(argv[1]) : 60.0};
  fmt::print("| albedo | MHz | million paths | off by | sigma |\n| --- | --- | --- | --- | --- |\n");
  for (const double albedo : {0.2, 0.5, 0.8}) judge({.albedo = albedo}, limit);
}
