// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/trace.h"

#include <fmt/format.h>
#include <xmmintrin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "sim/images/rows.h"
#include "sim/tracer/path.h"

namespace toftwin::sim {
namespace {

/// Denormal numbers count as zero while this lives, on this thread: Embree asks for it.
class FlushDenormals {
 public:
  FlushDenormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | kFlushToZero | kDenormalsAreZero); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;
  ~FlushDenormals() { _mm_setcsr(before_); }

 private:
  static constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
  unsigned before_;
};

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

/// A request that makes no sense is the calling program's mistake.
void check(const TraceRequest& request) {
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
  require(request.samples_per_pixel >= 1, "samples_per_pixel must be at least 1");
  require(request.max_surfaces >= 1, "max_surfaces must be at least 1");
  require(request.pixel_extent >= 0.0, "pixel_extent must not be negative");
  require(region.width > 0 && region.height > 0 && region.x >= 0 && region.y >= 0 &&
              region.width <= camera.width - region.x && region.height <= camera.height - region.y,
          "the region must lie inside the image");
}

Light emptyLight(const TraceRequest& request, const Region& region) {
  const int w = region.width, h = region.height;
  Light light;
  light.frequencies = request.frequencies;
  light.harmonics = request.harmonics;
  light.phasors.assign(request.frequencies.size() * static_cast<std::size_t>(request.harmonics),
                       Image<std::complex<float>>(w, h));
  light.steady = Image<float>(w, h);
  light.ambient = Image<float>(w, h);
  if (request.samples_per_pixel > 1) light.variance.assign(request.frequencies.size(), Image<float>(w, h));
  light.truth = {Image<float>(w, h), Image<Vec3f>(w, h), Image<float>(w, h)};
  return light;
}

/// Traces all samples of the block's pixels into `sums`.
void sumBlock(const Tracing& tracing, const Block& block, BlockSums& sums) {
  const int samples = tracing.request.samples_per_pixel;
  const int pieces = (samples + kSamplesPerPiece - 1) / kSamplesPerPiece;
  sums.clear();
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
    for (const BlockSums& part : parts) sums += part;
  }
  sums.gather(block.shape);
}

/// Where the pixels of a block go in an image of the region.
struct Placement {
  Placement(const Block& block, const Region& region)
      : shape(block.shape),
        u(block.x - region.x),
        v(block.y - region.y),
        first_column(std::max(0, -u)),
        last_column(std::min(shape.width, region.width - u)),
        first_row(std::max(0, -v)),
        last_row(std::min(shape.height, region.height - v)) {}

  /// Calls `value(lane)` for the first lane of each pixel within the region and stores what it returns.
  template <class T, class Value>
  void store(Image<T>& image, const Value& value) const {
    for (int row = first_row; row < last_row; ++row) {
      T* to = &image(u + first_column, v + row);
      for (int column = first_column; column < last_column; ++column) {
        *to++ = value(static_cast<std::size_t>((row * shape.width + column) * shape.samples));
      }
    }
  }

  BlockShape shape;
  int u, v;
  int first_column, last_column, first_row, last_row;
};

/// Means and variances of the block's pixels go to the images.
void storeBlock(const Placement& at, const BlockSums& sums, const TruthLanes& truth, Light& light) {
  const auto mean = [&](const Lanes<double>& sum, std::size_t i) { return static_cast<float>(sum[i] / sums.samples[i]); };
  at.store(light.steady, [&](std::size_t i) { return mean(sums.steady, i); });
  at.store(light.ambient, [&](std::size_t i) { return mean(sums.ambient, i); });
  for (std::size_t term = 0; term < light.phasors.size(); ++term) {
    const Lanes<double>&re = sums.re[term], &im = sums.im[term];
    at.store(light.phasors[term], [&](std::size_t i) { return std::complex<float>{mean(re, i), mean(im, i)}; });
  }
  for (std::size_t f = 0; f < light.variance.size(); ++f) {
    const std::size_t term = f * static_cast<std::size_t>(light.harmonics);
    at.store(light.variance[f], [&](std::size_t i) {
      const double n = sums.samples[i], re = sums.re[term][i], im = sums.im[term][i];
      const double spread = std::max(0.0, sums.squares[f][i] - (re * re + im * im) / n);
      return static_cast<float>(spread / (2.0 * n * (n - 1.0)));
    });
  }
  at.store(light.truth.range_m, [&](std::size_t i) { return truth.range_m[i]; });
  at.store(light.truth.albedo, [&](std::size_t i) { return truth.albedo[i]; });
  at.store(light.truth.normal, [&](std::size_t i) { return Vec3f{truth.normal.x[i], truth.normal.y[i], truth.normal.z[i]}; });
}

}  // namespace

Light traceLogged(const Scene& scene, const TraceRequest& request, RayLog* log) {
  check(request);
  const Region region = regionOf(request);
  const Tracing tracing{scene.impl(), request, log};
  const BlockShape shape = BlockShape::forSamples(request.samples_per_pixel);
  Light light = emptyLight(request, region);
  const int first_column = region.x / shape.width, first_row = region.y / shape.height;
  const int columns = (region.x + region.width - 1) / shape.width - first_column + 1;
  const int rows = (region.y + region.height - 1) / shape.height - first_row + 1;
  inParallel(columns * rows, 1, [&](int begin, int end) {
    const FlushDenormals flush;
    BlockSums sums{request};
    Block block;
    TruthLanes truth;
    for (int i = begin; i != end; ++i) {
      prepareBlock(tracing, shape, (first_column + i % columns) * shape.width, (first_row + i / columns) * shape.height, block);
      sumBlock(tracing, block, sums);
      traceTruth(tracing, block, truth);
      storeBlock({block, region}, sums, truth, light);
    }
  });
  return light;
}

Light trace(const Scene& scene, const TraceRequest& request) { return traceLogged(scene, request, nullptr); }

}  // namespace toftwin::sim
