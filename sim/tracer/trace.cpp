// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sim/images/rows.h"
#include "sim/tracer/block_means.h"
#include "sim/tracer/path.h"
#include "sim/tracer/shared_paths.h"
#include "sim/tracer/trace_tiles.h"

namespace toftwin::sim {

void checkRequest(const TraceRequest& request) {
  const CameraInfo& camera = request.camera;
  const Region region = regionOf(request);
  const auto require = [](bool is_met, const char* what) {
    if (!is_met) throw std::invalid_argument{fmt::format("trace: {}", what)};
  };
  require(camera.width > 0 && camera.height > 0, "the camera has no pixels");
  require(camera.fx > 0.0 && camera.fy > 0.0, "the camera's focal lengths must be positive");
  for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy, request.world_from_camera.translation_m.x,
                             request.world_from_camera.translation_m.y, request.world_from_camera.translation_m.z}) {
    require(std::isfinite(value), "the camera's lens and place must be finite numbers");
  }
  for (const Frequency f : request.frequencies) require(std::isfinite(f.in(hertz)), "frequencies must be finite");
  require(request.harmonics >= 1, "harmonics must be at least 1");
  require(request.gates.empty() || (request.frequencies.empty() && request.harmonics == 1),
          "gates stand instead of frequencies, with harmonics = 1");
  for (const PathFunctions& gate : request.gates) {
    require(gate.step.in(metre) > 0.0 && gate.first.size() == gate.second.size() && gate.first.size() >= 2,
            "a gate needs a positive step and two functions of at least two knots, as many in both");
  }
  require(request.samples_per_pixel >= 1, "samples_per_pixel must be at least 1");
  require(request.max_surfaces >= 1, "max_surfaces must be at least 1");
  require(request.pixel_extent >= 0.0, "pixel_extent must not be negative");
  require(request.wanted_noise >= Length{}, "wanted_noise must not be negative");
  require(request.wanted_noise == Length{} || !request.frequencies.empty(), "wanted_noise needs frequencies: gates have no range");
  require(region.width > 0 && region.height > 0 && region.x >= 0 && region.y >= 0 &&
              region.width <= camera.width - region.x && region.height <= camera.height - region.y,
          "the region must lie inside the image");
}

namespace {

/// The image if it has this size already, with whatever it holds; else a new one.
template <class T>
void resize(Image<T>& image, int width, int height) {
  if (image.width() != width || image.height() != height) image = Image<T>(width, height);
}

/// Images for all of the request's light, every pixel of which is going to be written.
Light lightFor(const TraceRequest& request, const Region& region, Light recycled) {
  Light light = std::move(recycled);
  const auto resizeTo = [&](auto& image) { resize(image, region.width, region.height); };
  light.frequencies = request.frequencies;
  light.harmonics = request.harmonics;
  light.phasors.resize(request.frequencies.size() * static_cast<std::size_t>(request.harmonics) +
                       request.gates.size());
  light.variance.resize(request.samples_per_pixel > 1 ? request.frequencies.size() : 0);
  std::for_each(light.phasors.begin(), light.phasors.end(), resizeTo);
  std::for_each(light.variance.begin(), light.variance.end(), resizeTo);
  resizeTo(light.steady);
  resizeTo(light.ambient);
  resizeTo(light.truth.range_m);
  resizeTo(light.truth.normal);
  resizeTo(light.truth.albedo);
  return light;
}

/// Traces so many samples of the block's pixels into `sums`.
void sumBlock(const Tracing& tracing, const Block& block, int samples, BlockSums& sums) {
  const int pieces = (samples + kSamplesPerPiece - 1) / kSamplesPerPiece;
  clearSums(sums);
  if (pieces == 1) {
    traceBlock(tracing, block, 0, samples, sums);
  } else {
    std::vector<BlockSums> parts(static_cast<std::size_t>(pieces), sums);
    inParallel(pieces, 1, [&](int begin, int end) {
      const FlushDenormals flush;
      for (int piece = begin; piece != end; ++piece) {
        const int first = piece * kSamplesPerPiece;
        traceBlock(tracing, block, first, std::min(samples, first + kSamplesPerPiece), parts[static_cast<std::size_t>(piece)]);
      }
    });
    for (const BlockSums& part : parts) addSums(part, sums);
  }
}

/// How many samples the block's pixels take: all that the request allows, or what a pilot says the wanted
/// noise takes. The pilot's samples are not used again: the mean of those that follow has no bias.
int samplesFor(const Tracing& tracing, const Block& block, BlockSums& sums, BlockMeans& means) {
  constexpr int kPilot = 64;
  const int most = tracing.request.samples_per_pixel;
  if (!(tracing.request.wanted_noise > Length{}) || most <= kPilot) return most;
  sumBlock(tracing, pilotOf(block), kPilot, sums);
  addUpPixels(block.shape, sums);
  takeMeans(sums, tracing.request.harmonics, means);
  NoiseCount noise;
  countNoise(tracing, block.shape, sums, means, noise);
  return samplesFor(tracing.request.wanted_noise, noise, kPilot, most);
}

/// Traces the block and takes the means of its pixels.
void traceMeans(const Tracing& tracing, const Block& block, BlockSums& sums, BlockMeans& means) {
  if (tracing.request.samples_per_pixel == 1) {
    traceOnce(tracing, block, sums.of_packet);
    takeMeans(sums.of_packet, means);
    return;
  }
  const int samples = samplesFor(tracing, block, sums, means);
  sumBlock(tracing, block, samples, sums);
  addUpPixels(block.shape, sums);
  takeMeans(sums, tracing.request.harmonics, means);
}

}  // namespace

Light traceLogged(const Scene& scene, const TraceRequest& request, RayLog* log, Light recycled) {
  checkRequest(request);
  const Region region = regionOf(request);
  const Tracing tracing{scene.impl(), request, log};
  const BlockShape shape = BlockShape::forSamples(request.samples_per_pixel);
  Light light = lightFor(request, region, std::move(recycled));
  if (request.sampler == Sampler::Shared && canShare(tracing.scene, request)) {
    traceTiles(tracing, region, light);
    return light;
  }
  const int first_column = region.x / shape.width, first_row = region.y / shape.height;
  const int columns = (region.x + region.width - 1) / shape.width - first_column + 1;
  const int rows = (region.y + region.height - 1) / shape.height - first_row + 1;
  inParallel(columns * rows, 1, [&](int begin, int end) {
    const FlushDenormals flush;
    BlockSums sums{request};
    Block block;
    TruthLanes truth;
    BlockMeans means{light};
    for (int i = begin; i != end; ++i) {
      prepareBlock(tracing, shape, (first_column + i % columns) * shape.width, (first_row + i / columns) * shape.height, block);
      traceMeans(tracing, block, sums, means);
      traceTruth(tracing, block, truth);
      storeBlock(block, region, means, truth, light);
    }
  });
  return light;
}

Light trace(const Scene& scene, const TraceRequest& request, Light recycled) {
  return traceLogged(scene, request, nullptr, std::move(recycled));
}

}  // namespace toftwin::sim
