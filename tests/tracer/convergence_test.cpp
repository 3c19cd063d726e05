// SPDX-License-Identifier: Apache-2.0
// How the error of an image falls with the samples per pixel: as N^−½ where every number is drawn by itself,
// as fast or faster where they are spread evenly or paths are shared. As phasors, not as ranges: a phase of
// few samples is biased, a mean is not.
#include <array>
#include <iostream>

#include "tests/tracer/corner.h"
#include "tests/tracer/furnace.h"

namespace toftwin::sim::testing {
namespace {

constexpr int kSeeds = 16;
constexpr int kFewest = 4, kMost = 64;  ///< samples per pixel

using Exact = std::vector<Complex>;  ///< of each pixel

/// Root mean square over the image of |P̂ − P| / |P|.
double errorOf(const Light& light, const Exact& exact) {
  double squares = 0.0;
  for (std::size_t p = 0; p < exact.size(); ++p)
    squares += std::norm(Complex{light.phasors[0][p]} - exact[p]) / std::norm(exact[p]);
  return std::sqrt(squares / static_cast<double>(exact.size()));
}

struct Convergence {
  double slope = 0.0, standard_error = 0.0;
  double first = 0.0, last = 0.0;  ///< error with the fewest and the most samples
};
/// log error over log N between the fewest and the most samples, its mean and spread over seeds.
Convergence convergenceOf(const Scene& scene, TraceRequest request, const Exact& exact) {
  std::array<double, kSeeds> slopes{};
  Convergence found;
  for (std::size_t i = 0; i < kSeeds; ++i) {
    request.seed = 100 + i;
    request.samples_per_pixel = kFewest;
    const double first = errorOf(trace(scene, request), exact);
    request.samples_per_pixel = kMost;
    const double last = errorOf(trace(scene, request), exact);
    slopes[i] = std::log(last / first) / std::log(double(kMost) / kFewest);
    found.slope += slopes[i] / kSeeds, found.first += first / kSeeds, found.last += last / kSeeds;
  }
  double squares = 0.0;
  for (const double slope : slopes) squares += std::pow(slope - found.slope, 2);
  found.standard_error = std::sqrt(squares / (kSeeds * (kSeeds - 1.0)));
  return found;
}

/// Four standard errors of sixteen slopes: exceeded by 0.1 % of correct results. A slope known to 0.02 tells
/// N^−½ from N^−0.4, which an error that does not fall any more would bring.
void expectHalfAPowerOrBetter(const char* what, const Scene& scene, TraceRequest request,
                              const Exact& exact) {
  for (const auto& [sampler, name] :
       {std::pair{Sampler::Plain, "plain"}, {Sampler::Even, "even"}, {Sampler::Shared, "shared"}}) {
    request.sampler = sampler;
    const Convergence found = convergenceOf(scene, request, exact);
    std::cout << what << ", " << name << ": slope " << found.slope << " +- " << found.standard_error
              << ", error " << found.first << " to " << found.last << "\n";
    EXPECT_LT(found.standard_error, 0.02) << what << ", " << name;
    EXPECT_LT(found.slope, -0.5 + 4.0 * found.standard_error) << what << ", " << name;
    if (sampler == Sampler::Plain) {
      EXPECT_GT(found.slope, -0.5 - 4.0 * found.standard_error) << what;
    }
  }
}

TEST(Convergence, InAFurnaceTowardsTheClosedForm) {
  const Furnace furnace{.albedo = 0.5};
  TraceRequest request = requestFor(32, 32, 32.0, {80_MHz});
  request.max_surfaces = furnace.surfaces;
  expectHalfAPowerOrBetter("furnace", furnace.scene(), request, Exact(32 * 32, furnace.phasor(80_MHz)));
}

/// The edge in the middle of the image, where light between the walls comes from nearby. Nothing is exact
/// there, so 128 times as many samples are: their own error adds 0.4 % to the last one.
TEST(Convergence, InACornerTowardsManySamples) {
  const Corner corner{
      .distance = 1.5, .wall_length = 1.0, .wall_height = 1.0, .albedo = 0.8, .shift = {}, .more = {}};
  const Scene scene = corner.scene();
  TraceRequest request = corner.lookingAt(0.0, {80_MHz});
  request.camera.width = request.camera.height = 32;
  request.camera.fx = request.camera.fy = 100.0;
  request.camera.cx = request.camera.cy = 15.5;
  request.max_surfaces = 8;
  request.samples_per_pixel = 128 * kMost;
  const Light many = trace(scene, request);
  expectHalfAPowerOrBetter("corner", scene, request,
                           {many.phasors[0].pixels().begin(), many.phasors[0].pixels().end()});
}

}  // namespace
}  // namespace toftwin::sim::testing
