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
    return;
  }
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

/// Means and variances of one pixel of a block go to (x, y) of the images.
void store(const BlockSums& sums, std::size_t pixel, int x, int y, Light& light) {
  const double n = sums.pixels[pixel].samples;
  light.steady(x, y) = static_cast<float>(sums.pixels[pixel].steady / n);
  light.ambient(x, y) = static_cast<float>(sums.pixels[pixel].ambient / n);
  const std::size_t terms = light.phasors.size(), frequencies = light.frequencies.size();
  for (std::size_t term = 0; term < terms; ++term) {
    light.phasors[term](x, y) = std::complex<float>{sums.phasors[pixel * terms + term] / n};
  }
  for (std::size_t f = 0; f < light.variance.size(); ++f) {
    const std::complex<double> sum = sums.phasors[pixel * terms + f * (terms / frequencies)];
    const double spread = std::max(0.0, sums.squares[pixel * frequencies + f] - std::norm(sum) / n);
    light.variance[f](x, y) = static_cast<float>(spread / (2.0 * n * (n - 1.0)));
  }
}

void storeBlock(const Block& block, const BlockSums& sums, const std::array<TruthPixel, kLaneCount>& truth,
                const Region& region, Light& light) {
  for (int p = 0; p < block.shape.pixels(); ++p) {
    const int u = block.x + p % block.shape.width - region.x, v = block.y + p / block.shape.width - region.y;
    if (u < 0 || v < 0 || u >= region.width || v >= region.height) continue;
    const auto pixel = static_cast<std::size_t>(p);
    store(sums, pixel, u, v, light);
    light.truth.range_m(u, v) = truth[pixel].range_m;
    light.truth.albedo(u, v) = truth[pixel].albedo;
    light.truth.normal(u, v) = truth[pixel].normal;
  }
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
    BlockSums sums{shape.pixels(), request.frequencies.size(), request.harmonics};
    for (int i = begin; i != end; ++i) {
      const Block block{tracing, shape, (first_column + i % columns) * shape.width, (first_row + i / columns) * shape.height};
      sumBlock(tracing, block, sums);
      storeBlock(block, sums, traceTruth(tracing, block), region, light);
    }
  });
  return light;
}

Light trace(const Scene& scene, const TraceRequest& request) { return traceLogged(scene, request, nullptr); }

}  // namespace toftwin::sim
