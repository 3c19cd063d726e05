// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/trace_tiles.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "sim/images/rows.h"
#include "sim/tracer/edge_pixels.h"
#include "sim/tracer/shared_paths.h"

namespace toftwin::sim {
namespace {

/// Samples of one batch: sixteen batches or more, so that their spread says something, that divide a piece.
/// Within a batch samples are even; the spread between batches can only overstate the noise of all, which are
/// even, too.
int batchOf(int samples, int piece) {
  return std::min(piece, static_cast<int>(std::bit_floor(static_cast<unsigned>(std::max(1, samples / 16)))));
}

/// Traces so many samples of the tile's pixels into `sums`.
void sumTile(const Tracing& tracing, const Tile& tile, int samples, TileSums& sums) {
  constexpr int kPiece = kSamplesPerPiece / Tile::kPixels;
  const int pieces = (samples + kPiece - 1) / kPiece, batch = batchOf(samples, kPiece);
  for (BlockSums& block : sums) clearSums(block);
  if (pieces == 1) return traceTile(tracing, tile, 0, samples, batch, sums);
  std::vector<TileSums> parts(static_cast<std::size_t>(pieces), sums);
  inParallel(pieces, 1, [&](int begin, int end) {
    const FlushDenormals flush;
    for (int piece = begin; piece != end; ++piece) {
      const int first = piece * kPiece;
      traceTile(tracing, tile, first, std::min(samples, first + kPiece), batch,
                parts[static_cast<std::size_t>(piece)]);
    }
  });
  for (const TileSums& part : parts) {
    for (std::size_t b = 0; b < sums.size(); ++b) addSums(part[b], sums[b]);
  }
}

/// Of a block that took so many samples.
void takeMeans(const Tracing& tracing, const Tile& tile, std::size_t b, const BlockSums& sums, int samples,
               BlockMeans& means) {
  takeMeans(sums, tracing.request.harmonics, means);
  if (isAny(tile.edges[b])) addEdges(tracing, tile.blocks[b], tile.edges[b], samples, means);
}

/// How many samples the tile's pixels take: those of the request as many times as the light asks for, or fewer for a
/// wanted noise. trace.cpp has the same for a block.
int samplesFor(const Tracing& tracing, const Tile& tile, TileSums& sums, BlockMeans& means) {
  constexpr int kPilot = 16;
  constexpr int kMost = std::numeric_limits<int>::max();
  const int most = tile.times * std::min(tracing.request.samples_per_pixel, kMost / tile.times);
  if (!(tracing.request.wanted_noise > Length{}) || most <= kPilot) return most;
  Tile pilot = tile;
  for (Block& block : pilot.blocks) block = pilotOf(block);
  pilot.key = {pilot.blocks[0].key_a[0], pilot.blocks[0].key_b[0]};
  sumTile(tracing, pilot, kPilot, sums);
  NoiseCount noise;
  for (std::size_t b = 0; b < sums.size(); ++b) {
    takeMeans(tracing, pilot, b, sums[b], kPilot, means);
    countNoise(tracing, Tile::kBlockShape, sums[b], means, noise);
  }
  return samplesFor(tracing.request.wanted_noise, noise, kPilot, most);
}

/// Whether any of the block's pixels lies in the region.
bool isWithin(const Block& block, const Region& region) {
  return block.x < region.x + region.width && block.x + block.shape.width > region.x &&
         block.y < region.y + region.height && block.y + block.shape.height > region.y;
}

}  // namespace

void traceTiles(const Tracing& tracing, const Region& region, Light& light) {
  constexpr int kSide = Tile::kSide;
  const int first_column = region.x / kSide, first_row = region.y / kSide;
  const int columns = (region.x + region.width - 1) / kSide - first_column + 1;
  const int rows = (region.y + region.height - 1) / kSide - first_row + 1;
  inParallel(columns * rows, 1, [&](int begin, int end) {
    const FlushDenormals flush;
    TileSums sums(Tile::kBlocks, BlockSums{tracing.request});
    Tile tile;
    TruthLanes truth;
    BlockMeans means{light};
    for (int i = begin; i != end; ++i) {
      prepareTile(tracing, (first_column + i % columns) * kSide, (first_row + i / columns) * kSide, tile);
      const int samples = samplesFor(tracing, tile, sums, means);
      sumTile(tracing, tile, samples, sums);
      for (std::size_t b = 0; b < sums.size(); ++b) {
        if (!isWithin(tile.blocks[b], region)) continue;
        takeMeans(tracing, tile, b, sums[b], samples, means);
        traceTruth(tracing, tile.blocks[b], truth);
        storeBlock(tile.blocks[b], region, means, truth, light);
      }
    }
  });
}

}  // namespace toftwin::sim
