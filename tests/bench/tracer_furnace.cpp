// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "tests/bench/tracer.h"
#include "tests/tracer/furnace.h"

namespace toftwin::bench {
namespace {

using namespace toftwin::sim;
using namespace toftwin::sim::testing;

constexpr double kWantedSigma = 3e-5;

/// The largest of three frequencies, relative to |P|.
struct Worst {
  double off = 0.0, sigma = 0.0;
};

Worst judge(const Furnace& furnace, double limit_ms) {
  const Scene scene = furnace.scene();
  TraceRequest request = requestFor(64, 64, 64.0, {16_MHz, 80_MHz, 120_MHz});
  request.samples_per_pixel = 256;
  request.max_surfaces = furnace.surfaces;
  const double start = processorMs();
  Complex sum[3];
  double variance[3]{};  // of the sum
  double worst = 1.0;
  while (worst > kWantedSigma && processorMs() - start < limit_ms) {
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
  Worst of;
  for (std::size_t f = 0; f < 3; ++f) {
    const Complex exact = furnace.phasor(request.frequencies[f]);
    const double off = std::abs(sum[f] / runs - exact) / std::abs(exact),
                 sigma = std::sqrt(variance[f]) / runs / std::abs(exact);
    fmt::print("| {} | {:.0f} | {:.0f} | {:.1e} | {:.1e} |\n", furnace.albedo,
               request.frequencies[f].in(megahertz), runs * 64 * 64 * 256 / 1e6, off, sigma);
    of = {std::max(of.off, off), std::max(of.sigma, sigma)};
  }
  return of;
}

}  // namespace

Bars furnace(std::chrono::duration<double> limit) {
  fmt::print(
      "\nFurnace, at most {:.0f} s of processor time for each albedo:\n\n"
      "| albedo | MHz | million paths | off by | sigma |\n| --- | --- | --- | --- | --- |\n",
      limit.count());
  Bars bars;
  for (const double albedo : {0.2, 0.5, 0.8}) {
    const Worst worst = judge({.albedo = albedo}, 1e3 * limit.count());
    bars.push_back({fmt::format("furnace of albedo {}, off by (σ {:.0e})", albedo, worst.sigma),
                    fmt::format("{:.1e}", worst.off), "≤ 1e-4", worst.off <= 1e-4});
  }
  return bars;
}

}  // namespace toftwin::bench
