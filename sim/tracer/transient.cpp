// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/transient.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/images/rows.h"
#include "sim/tracer/path.h"
#include "sim/tracer/shade.h"

namespace toftwin::sim {
namespace {

/// So many rows of pixels are traced before somebody is told.
constexpr int kRowsOfBand = 16;

/// The lanes' sums of each bin go to the block's pixels that lie in the image.
void store(const Block& block, const BlockSums& sums, Transient& transient) {
  const int samples = block.shape.samples;
  for (int pixel = 0; pixel < block.shape.pixels(); ++pixel) {
    const int u = block.x + pixel % block.shape.width, v = block.y + pixel / block.shape.width;
    if (u >= transient.outside.width() || v >= transient.outside.height()) continue;
    const auto first = static_cast<std::size_t>(pixel * samples),
               last = first + static_cast<std::size_t>(samples);
    double count = 0.0;
    for (std::size_t lane = first; lane < last; ++lane) count += sums.samples[lane];
    for (std::size_t b = 0; b < sums.of_packet.bins.size(); ++b) {
      double sum = 0.0;
      for (std::size_t lane = first; lane < last; ++lane) sum += sums.of_packet.bins[b][lane];
      Image<float>& image = b < transient.radiance.size() ? transient.radiance[b] : transient.outside;
      image(u, v) = static_cast<float>(sum / count);
    }
  }
}

}  // namespace

std::complex<double> Transient::phasor(Frequency f, int x, int y) const {
  std::complex<double> sum;
  const double k = 2.0 * std::numbers::pi * f.in(hertz) / kSpeedOfLight_m_per_s;
  for (std::size_t i = 0; i < radiance.size(); ++i) {
    const double length = bins.first.in(metre) + (static_cast<double>(i) + 0.5) * bins.width.in(metre);
    sum += std::polar(static_cast<double>(radiance[i](x, y)), -k * length);
  }
  return sum;
}

void addToBins(const TransientBins& bins, const DirectLight& light, LaneSums& sums) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (light.valid[i] == 0) continue;
    const double bin = std::floor((light.length[i] - bins.first.in(metre)) / bins.width.in(metre));
    const bool is_inside = bin >= 0.0 && bin < static_cast<double>(bins.count);
    const std::size_t at = is_inside ? static_cast<std::size_t>(bin) : sums.bins.size() - 1;
    sums.bins[at][i] += static_cast<double>(light.weight[i]);
  }
}

Transient traceTransient(const Scene& scene, const TraceRequest& request, const TransientBins& bins,
                         const std::function<bool(int)>& tell) {
  checkRequest(request);
  if (bins.count < 1 || !(bins.width > Length{}) || !std::isfinite(bins.first.in(metre))) {
    throw std::invalid_argument{"traceTransient: there must be at least one bin, wider than 0"};
  }
  if (request.region_width != 0) throw std::invalid_argument{"traceTransient: the whole image only"};
  const int width = request.camera.width, height = request.camera.height;
  Transient transient{
      bins, {static_cast<std::size_t>(bins.count), Image<float>{width, height}}, Image<float>{width, height}};
  Tracing tracing{scene.impl(), request, nullptr};
  tracing.bins = bins;
  const BlockShape shape = BlockShape::forSamples(request.samples_per_pixel);
  const int columns = (width - 1) / shape.width + 1, rows = (height - 1) / shape.height + 1;
  const auto traceBlocks = [&](int begin, int end) {
    const FlushDenormals flush;
    BlockSums sums{request};
    Block block;
    for (int i = begin; i != end; ++i) {
      prepareBlock(tracing, shape, i % columns * shape.width, i / columns * shape.height, block);
      clearSums(sums);
      sums.of_packet.bins.assign(static_cast<std::size_t>(bins.count) + 1, Lanes<double>{});
      traceBlock(tracing, block, 0, request.samples_per_pixel, sums);
      store(block, sums, transient);
    }
  };
  const int in_band = kRowsOfBand / shape.height;  // rows of blocks
  for (int first = 0; first < rows; first += in_band) {
    const int last = std::min(rows, first + in_band), before = first * columns;
    inParallel((last - first) * columns, 1,
               [&](int begin, int end) { traceBlocks(before + begin, before + end); });
    if (tell && !tell(std::min(height, last * shape.height))) break;
  }
  return transient;
}

}  // namespace toftwin::sim
