// SPDX-License-Identifier: Apache-2.0
#include "tests/tracer/furnace.h"

#include <iostream>

namespace toftwin::sim::testing {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kInstrumented = true;  // looks for other mistakes, and has no time for millions of paths
#else
constexpr bool kInstrumented = false;
#endif

constexpr double kGoal = 1e-4;

/// |P̂ − P| / |P| ≤ 1e-4 + 3.5 √2 σ / |P|, where σ is that of a component. A mean of 1024 independent pixels
/// is normal; either component lies beyond 3.5 σ in 0.05 % of correct results, and then 1e-4 is still free.
/// `sharp` frequencies, from the lowest, must have σ ≤ 3e-5 |P|, so that a mistake of 2.5e-4 shows.
void expectClosedForm(const Furnace& furnace, int samples_per_pixel, std::size_t sharp) {
  TraceRequest request = requestFor(32, 32, 32.0, {16_MHz, 80_MHz, 120_MHz});
  request.samples_per_pixel = kInstrumented ? std::max(1, samples_per_pixel / 32) : samples_per_pixel;
  request.max_surfaces = furnace.surfaces;
  const Light light = trace(furnace.scene(), request);
  for (std::size_t f = 0; f < 3; ++f) {
    const Complex exact = furnace.phasor(light.frequencies[f]);
    const PixelMean mean = meanOfPixels(light, f);
    const double off = std::abs(mean.phasor - exact) / std::abs(exact), sigma = mean.sigma / std::abs(exact);
    std::cout << "albedo " << furnace.albedo << ", " << furnace.surfaces << " surfaces, "
              << light.frequencies[f].in(megahertz) << " MHz: off by " << off << ", sigma " << sigma << "\n";
    EXPECT_LT(off, kGoal + 3.5 * std::sqrt(2.0) * sigma)
        << "albedo " << furnace.albedo << ", " << furnace.surfaces << " surfaces, frequency " << f;
    if (f < sharp && !kInstrumented) {
      EXPECT_LT(sigma, 3e-5) << "too noisy to show a mistake of 2.5e-4";
    }
  }
}

/// The first two bounces are sampled so evenly that next to nothing of the noise is left.
TEST(IntegratingSphere, GivesTheClosedFormOfFewBounces) {
  for (const double albedo : {0.5, 0.8}) {
    for (const int surfaces : {1, 2}) expectClosedForm({albedo, surfaces}, 256, 3);
    expectClosedForm({albedo, 5}, 256, 0);
  }
}

/// Deeper bounces are plain random numbers: how far σ gets within a second depends on the albedo.
TEST(IntegratingSphere, GivesTheClosedFormOfAllBounces) {
  expectClosedForm({.albedo = 0.2}, 4096, 3);
  expectClosedForm({.albedo = 0.5}, 4096, 1);
  expectClosedForm({.albedo = 0.8}, 1024, 0);
}

}  // namespace
}  // namespace toftwin::sim::testing
