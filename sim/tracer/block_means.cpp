// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/block_means.h"

#include <cmath>
#include <numbers>

namespace toftwin::sim {

Region regionOf(const TraceRequest& request) {
  if (request.region_width == 0) return {0, 0, request.camera.width, request.camera.height};
  return {request.region_x, request.region_y, request.region_width, request.region_height};
}

namespace {

void addUpPixels(int samples, Lanes<double>& lanes) {
  const auto step = static_cast<std::size_t>(samples);
  for (std::size_t width = 1; width < step; width *= 2) {
    for (std::size_t i = 0; i < kLaneCount; i += 2 * width) lanes[i] += lanes[i + width];
  }
  for (std::size_t pixel = 1; pixel < kLaneCount / step; ++pixel) lanes[pixel] = lanes[pixel * step];
}

}  // namespace

void addUpPixels(const BlockShape& shape, BlockSums& sums) {
  if (shape.samples == 1) return;
  for (Lanes<double>* lanes : {&sums.steady, &sums.ambient, &sums.samples, &sums.batches})
    addUpPixels(shape.samples, *lanes);
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
      const double spread = squares[i] - (re[i] * re[i] + im[i] * im[i]) * per_sample[i];
      const double freedom = sums.batches[i] - 1.0;
      means.variance[f][i] =
          static_cast<float>((spread > 0.0 ? spread : 0.0) / (2.0 * sums.samples[i] * freedom));
    }
  }
}

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

namespace {

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

}  // namespace

void storeBlock(const Block& block, const Region& region, const BlockMeans& means, const TruthLanes& truth,
                Light& light) {
  const Placement at{block, region};
  at.store(means.steady.v, light.steady);
  at.store(means.ambient.v, light.ambient);
  for (std::size_t term = 0; term < light.phasors.size(); ++term)
    at.store(means.phasors[term].v, light.phasors[term]);
  for (std::size_t f = 0; f < light.variance.size(); ++f) at.store(means.variance[f].v, light.variance[f]);
  at.store(truth.range_m.v, light.truth.range_m);
  at.store(truth.albedo.v, light.truth.albedo);
  at.store(truth.normal.v, light.truth.normal);
}

void countNoise(const Tracing& tracing, const BlockShape& shape, const BlockSums& sums,
                const BlockMeans& means, NoiseCount& noise) {
  const std::size_t highest = tracing.highest();
  const std::size_t term = highest * static_cast<std::size_t>(tracing.request.harmonics);
  const double per_radian = 1.0 / (4.0 * std::numbers::pi * tracing.turns_per_metre[highest]);
  constexpr double kAnything = std::numbers::pi * std::numbers::pi / 3.0;  // variance of an even phase
  for (std::size_t i = 0; i < static_cast<std::size_t>(shape.pixels()); ++i) {
    const double square = static_cast<double>(std::norm(means.phasors[term][i]));
    if (!(sums.samples[i] > 0.0) || !(square > 0.0)) continue;
    const double phase = std::min(kAnything, static_cast<double>(means.variance[highest][i]) / square);
    noise.variance_m2 += phase * per_radian * per_radian;
    ++noise.pixels;
  }
}

int samplesFor(Length wanted_noise, const NoiseCount& noise, int pilot, int most) {
  constexpr double kStep = 16.0;
  if (noise.pixels == 0) return std::min(pilot, most);
  const double wanted = wanted_noise.in(metre), mean = noise.variance_m2 / noise.pixels;
  const double needed = std::ceil(mean / (wanted * wanted) * pilot / kStep) * kStep;
  return static_cast<int>(std::clamp(needed, std::min(kStep, 1.0 * most), 1.0 * most));
}

Block pilotOf(const Block& block) {
  constexpr std::uint32_t kPilotSalt = 0x3c6ef372u;
  Block pilot = block;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const PixelKey key = salted({block.key_a[i], block.key_b[i]}, kPilotSalt);
    pilot.key_a[i] = key.a;
    pilot.key_b[i] = key.b;
  }
  return pilot;
}

}  // namespace toftwin::sim
