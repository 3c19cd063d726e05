// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/edge_pixels.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "sim/images/rows.h"
#include "sim/tracer/hit.h"

namespace toftwin::sim {
namespace {

constexpr int kCornerBlocks = 3;  ///< a side: nine corners lie in three blocks of four
/// Tells the edges' random numbers from those of all other light, which goes on from the same pixels.
constexpr std::uint32_t kEdgeSalt = 0x2545f491u;

constexpr int kSide = Tile::kSide, kBlockSide = Tile::kBlockShape.width;

/// What a place sends towards the camera.
struct Seen {
  std::complex<float> phasor;  ///< of the highest frequency
  float steady;
  float lit;  ///< what arrives there, so to speak: `steady` by the albedo; negative where there is no surface
};
using SeenCorners = std::array<const Seen*, 4>;  ///< of a pixel

/// Adds direct light of sixteen paths from the camera on; those that meet nothing are no longer valid.
void traceDirect(const Tracing& tracing, Packet& packet, Hits& hits, LaneSums& sums) {
  constexpr bool is_coherent = true;
  RTCRayHit16 rays;
  Lanes<float> unused{};
  intersect(tracing, packet, rays, is_coherent);
  endMissed(0.0f, rays, packet, unused);
  if (!isAny(packet.valid)) return;
  findHits(tracing.scene, packet, rays, hits);
  gatherDirectLight(tracing, packet, hits, 0, is_coherent, sums);
}

/// What is seen at the top left corners of a block's pixels, in or beside the image.
void seeCorners(const Tracing& tracing, int x, int y, LaneSums& sums, std::array<Seen, kLaneCount>& seen) {
  Block block;
  prepareBlock(tracing, Tile::kBlockShape, x, y, block);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    PixelRays& rays = block.rays;
    rays.x[i] -= 0.5 * (rays.x_by_u[i] + rays.x_by_v[i]);
    rays.y[i] -= 0.5 * (rays.y_by_u[i] + rays.y_by_v[i]);
    block.is_inside[i] = -1;
  }
  Packet packet;
  const Block own = pilotOf(block);  // places on an emitter that is no point
  preparePacket(tracing, own, packet);
  startInTheMiddle(tracing, own, packet);
  clearSums(sums);
  Hits hits;
  traceDirect(tracing, packet, hits, sums);
  const std::size_t term = tracing.highest() * static_cast<std::size_t>(tracing.request.harmonics);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float steady = sums.steady[i];
    seen[i].phasor = term < sums.re.size() ? std::complex{sums.re[term][i], sums.im[term][i]} : steady;
    seen[i].steady = steady;
    seen[i].lit = packet.valid[i] == 0 ? -1.0f : steady > 0.0f ? steady / hits.albedo[i] : 0.0f;
  }
}

/// All samples of the lane's pixel, in packets of sixteen; `samples` of all of its light.
void traceEdge(const Tracing& tracing, const Block& block, std::size_t lane, int samples, BlockSums& sums) {
  constexpr int kBatches = 16;  // or more: their spread says something
  constexpr int kMost = std::numeric_limits<int>::max() / kEdgeSamples;
  constexpr int kMostPackets = 64;  // summed up in single precision
  const BlockShape shape;
  const int all = kEdgeSamples * std::min(samples, kMost);
  const int batch = std::clamp(all / (kBatches * shape.samples), 1, kMostPackets) * shape.samples;
  const int width = block.shape.width;
  Block pixel;
  prepareBlock(tracing, shape, block.x + static_cast<int>(lane) % width, block.y + static_cast<int>(lane) / width, pixel);
  const PixelKey key = salted({block.key_a[lane], block.key_b[lane]}, kEdgeSalt);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    pixel.key_a[i] = key.a;
    pixel.key_b[i] = key.b;
  }
  clearSums(sums);
  Packet packet;
  Hits hits;
  for (int first = 0; first < all; first += batch) {
    const int last = std::min(all, first + batch);
    clearSums(sums.of_packet);
    for (int sample = first; sample < last; sample += shape.samples) {
      preparePacket(tracing, pixel, packet);
      startAtPlaces(tracing, pixel, sample, last, packet);
      traceDirect(tracing, packet, hits, sums.of_packet);
    }
    foldTogether(static_cast<std::size_t>(tracing.request.harmonics), last - first, sums);
  }
}

bool differ(const SeenCorners& corners) {
  constexpr float kAlike = 0.25f;  // of the brightest: what a slanted or distant surface may vary by
  float brightest = 0.0f, most = 0.0f;
  for (const Seen* one : corners) {
    brightest = std::max(brightest, one->steady);
    for (const Seen* other : corners)
      most = std::max({most, std::abs(one->phasor - other->phasor), std::abs(one->steady - other->steady)});
  }
  return most > kAlike * brightest;
}

/// Of a tile's pixels, beside that of one as bright as the tile's brightest corner: the mean of 1 / |light|².
struct RangeVariance {
  double sum = 0.0;
  int pixels = 0;

  /// Direct light anywhere between the corners' least and most, as an edge or a slope leaves it: with even odds the mean
  /// of 1 / light² is one over their product.
  void add(const SeenCorners& corners, float brightest) {
    constexpr double kIndirect = 0.125;  // of direct light: what other surfaces add everywhere, as in rooms
    double least = brightest, most = -1.0;
    for (const Seen* corner : corners) {
      if (corner->lit < 0.0f) continue;
      least = std::min(least, static_cast<double>(corner->lit));
      most = std::max(most, static_cast<double>(corner->lit));
    }
    if (!(most >= 0.0 && brightest > 0.0f)) return;
    const auto light = [&](double lit) { return (lit / double{brightest} + kIndirect) / (1.0 + kIndirect); };
    sum += 1.0 / (light(least) * light(most));
    ++pixels;
  }
  /// Nine at the most.
  [[nodiscard]] int times() const { return pixels == 0 ? 1 : static_cast<int>(std::lround(std::sqrt(sum / pixels))); }
};

}  // namespace

void lookAtCorners(const Tracing& tracing, Tile& tile) {
  tile.edges = {};
  tile.times = 1;
  if (tracing.request.pixel_extent == 0.0) return;
  LaneSums sums{tracing.turns_per_metre.size() * static_cast<std::size_t>(tracing.request.harmonics)};
  const int left = tile.blocks[0].x, top = tile.blocks[0].y;
  std::array<std::array<Seen, kLaneCount>, kCornerBlocks * kCornerBlocks> seen;
  for (int b = 0; b < kCornerBlocks * kCornerBlocks; ++b) {
    seeCorners(tracing, left + b % kCornerBlocks * kBlockSide, top + b / kCornerBlocks * kBlockSide, sums,
               seen[static_cast<std::size_t>(b)]);
  }
  const auto at = [&](int column, int row) {
    return &seen[static_cast<std::size_t>(row / kBlockSide * kCornerBlocks + column / kBlockSide)]
                [static_cast<std::size_t>(row % kBlockSide * kBlockSide + column % kBlockSide)];
  };
  float brightest = 0.0f;
  for (int i = 0; i < (kSide + 1) * (kSide + 1); ++i)
    brightest = std::max(brightest, at(i % (kSide + 1), i / (kSide + 1))->lit);
  RangeVariance variance;
  for (std::size_t b = 0; b < tile.edges.size(); ++b) {
    const Block& block = tile.blocks[b];
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      if (block.is_inside[i] == 0) continue;
      const int column = block.x - left + static_cast<int>(i) % kBlockSide,
                row = block.y - top + static_cast<int>(i) / kBlockSide;
      const SeenCorners corners{at(column, row), at(column + 1, row), at(column, row + 1), at(column + 1, row + 1)};
      tile.edges[b][i] = differ(corners) ? -1 : 0;
      variance.add(corners, brightest);
    }
  }
  tile.times = variance.times();
}

void addEdges(const Tracing& tracing, const Block& block, const Lanes<int>& edges, int samples, BlockMeans& means) {
  constexpr int kWorthSharing = 64;  // samples: a pixel's work for a thread
  const auto addLanes = [&](int begin, int end) {
    const FlushDenormals flush;
    BlockSums sums{tracing.request};
    BlockMeans own = means;
    for (auto lane = static_cast<std::size_t>(begin); lane < static_cast<std::size_t>(end); ++lane) {
      if (edges[lane] == 0) continue;
      traceEdge(tracing, block, lane, samples, sums);
      takeMeans(sums, tracing.request.harmonics, own);
      means.steady[lane] += own.steady[0];
      for (std::size_t term = 0; term < means.phasors.size(); ++term) means.phasors[term][lane] += own.phasors[term][0];
      for (std::size_t f = 0; f < means.variance.size(); ++f) means.variance[f][lane] += own.variance[f][0];
    }
  };
  if (samples > kWorthSharing)
    inParallel(static_cast<int>(kLaneCount), 1, addLanes);
  else
    addLanes(0, static_cast<int>(kLaneCount));
}

}  // namespace toftwin::sim
