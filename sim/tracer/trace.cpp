// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sim/images/rows.h"
#include "sim/tracer/path.h"

namespace toftwin::sim {
namespace {

/// A pixel with very many samples is cut into pieces of this many, so that threads can share it. The
/// pieces' sums are added in order: the result does not depend on who did which.
constexpr int kSamplesPerPiece = 4096;

struct Region {
  int x, y, width, height;
};

Region regionOf(const TraceRequest& request) {
  if (request.region_width == 0) return {0, 0, request.camera.width, request.camera.height};
  return {request.region_x, request.region_y, request.region_width, request.region_height};
}

}  // namespace

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

/// Traces all samples of the block's pixels into `sums`.
void sumBlock(const Tracing& tracing, const Block& block, BlockSums& sums) {
  const int samples = tracing.request.samples_per_pixel;
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

/// Means of a block's pixels as the images hold them, pixel by pixel.
struct BlockMeans {
  explicit BlockMeans(const Light& light) : phasors(light.phasors.size()), variance(light.variance.size()) {}

  Lanes<float> steady, ambient;
  std::vector<Lanes<std::complex<float>>> phasors;
  std::vector<Lanes<float>> variance;
};

/// Adds up the lanes of each pixel and moves the sum to the lane of the pixel's number.
void addUpPixels(int samples, Lanes<double>& lanes) {
  const auto step = static_cast<std::size_t>(samples);
  for (std::size_t width = 1; width < step; width *= 2) {
    for (std::size_t i = 0; i < kLaneCount; i += 2 * width) lanes[i] += lanes[i + width];
  }
  for (std::size_t pixel = 1; pixel < kLaneCount / step; ++pixel) lanes[pixel] = lanes[pixel * step];
}

void addUpPixels(const BlockShape& shape, BlockSums& sums) {
  if (shape.samples == 1) return;
  for (Lanes<double>* lanes : {&sums.steady, &sums.ambient, &sums.samples}) addUpPixels(shape.samples, *lanes);
  for (auto* terms : {&sums.re, &sums.im, &sums.squares}) {
    for (Lanes<double>& lanes : *terms) addUpPixels(shape.samples, lanes);
  }
}

TOFTWIN_VECTOR
void takeMeans(const BlockSums& sums, int harmonics, BlockMeans& means) {
  Lanes<double> per_sample;
  for (std::size_t i = 0; i < kLaneCount; ++i) per_sample[i] = 1.0 / sums.samples[i];
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    means.steady[i] = static_cast<float>(sums.steady[i] * per_sample[i]);
    means.ambient[i] = static_cast<float>(sums.ambient[i] * per_sample[i]);
  }
  for (std::size_t term = 0; term < means.phasors.size(); ++term) {
    const Lanes<double>&re = sums.re[term], &im = sums.im[term];
    float* out = reinterpret_cast<float*>(means.phasors[term].v);  // a complex number is an array of two
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      out[2 * i] = static_cast<float>(re[i] * per_sample[i]);
      out[2 * i + 1] = static_cast<float>(im[i] * per_sample[i]);
    }
  }
  for (std::size_t f = 0; f < means.variance.size(); ++f) {
    const std::size_t term = f * static_cast<std::size_t>(harmonics);
    const Lanes<double>&re = sums.re[term], &im = sums.im[term], &squares = sums.squares[f];
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const double n = sums.samples[i], spread = squares[i] - (re[i] * re[i] + im[i] * im[i]) * per_sample[i];
      means.variance[f][i] = static_cast<float>((spread > 0.0 ? spread : 0.0) / (2.0 * n * (n - 1.0)));
    }
  }
}

/// The same of the only samples.
TOFTWIN_VECTOR
void takeMeans(const LaneSums& lanes, BlockMeans& means) {
  means.steady = lanes.steady;
  means.ambient = lanes.ambient;
  for (std::size_t term = 0; term < means.phasors.size(); ++term) {
    const Lanes<float>&re = lanes.re[term], &im = lanes.im[term];
    float* out = reinterpret_cast<float*>(means.phasors[term].v);
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      out[2 * i] = re[i];
      out[2 * i + 1] = im[i];
    }
  }
}

/// Traces the block and takes the means of its pixels.
void traceMeans(const Tracing& tracing, const Block& block, BlockSums& sums, BlockMeans& means) {
  if (tracing.request.samples_per_pixel == 1) {
    traceOnce(tracing, block, sums.of_packet);
    takeMeans(sums.of_packet, means);
    return;
  }
  sumBlock(tracing, block, sums);
  addUpPixels(block.shape, sums);
  takeMeans(sums, tracing.request.harmonics, means);
}

/// Where the pixels of a block go in an image of the region.
struct Placement {
  Placement(const Block& block, const Region& region)
      : width(block.shape.width),
        u(block.x - region.x),
        v(block.y - region.y),
        first_column(std::max(0, -u)),
        columns(std::min(width, region.width - u) - first_column),
        first_row(std::max(0, -v)),
        last_row(std::min(block.shape.height, region.height - v)) {}

  template <class T>
  void store(const T* values, Image<T>& image) const {
    for (int row = first_row; row < last_row; ++row) {
      const T* from = values + row * width + first_column;
      T* to = &image(u + first_column, v + row);
      if (columns == 4) {  // mostly, and then without a loop
        for (int column = 0; column < 4; ++column) to[column] = from[column];
      } else {
        std::copy_n(from, columns, to);
      }
    }
  }

  int width;
  int u, v;
  int first_column, columns, first_row, last_row;
};

void storeBlock(const Placement& at, const BlockMeans& means, const TruthLanes& truth, Light& light) {
  at.store(means.steady.v, light.steady);
  at.store(means.ambient.v, light.ambient);
  for (std::size_t term = 0; term < light.phasors.size(); ++term) at.store(means.phasors[term].v, light.phasors[term]);
  for (std::size_t f = 0; f < light.variance.size(); ++f) at.store(means.variance[f].v, light.variance[f]);
  at.store(truth.range_m.v, light.truth.range_m);
  at.store(truth.albedo.v, light.truth.albedo);
  at.store(truth.normal.v, light.truth.normal);
}

}  // namespace

Light traceLogged(const Scene& scene, const TraceRequest& request, RayLog* log, Light recycled) {
  checkRequest(request);
  const Region region = regionOf(request);
  const Tracing tracing{scene.impl(), request, log};
  const BlockShape shape = BlockShape::forSamples(request.samples_per_pixel);
  Light light = lightFor(request, region, std::move(recycled));
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
      storeBlock({block, region}, means, truth, light);
    }
  });
  return light;
}

Light trace(const Scene& scene, const TraceRequest& request, Light recycled) {
  return traceLogged(scene, request, nullptr, std::move(recycled));
}

}  // namespace toftwin::sim
