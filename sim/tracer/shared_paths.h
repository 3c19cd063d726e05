// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "sim/tracer/path.h"

namespace toftwin::sim {

/// 8 × 8 neighbouring pixels that use each other's paths (after Bekaert, Sbert & Halton 2002). The path
/// that pixel j sends from its first surface x_j on to y_j is connected to the first surfaces x_i of all
/// pixels of the tile by one shadow ray each. With the density of a diffuse bounce from x_i to y,
///   p_i(y) = V(x_i, y) cos θ_i cos θ_y / (π |x_i − y|²),
/// and the radiance L that leaves y_j towards x_i, pixel i gets, by the balance heuristic over all pixels,
///   Σ_j  albedo_i · shape_i · p_i(y_j) / Σ_k p_k(y_j) · L(y_j → x_i).
/// The weight of a path is at most 1 and there are no singularities; what the pixels' own paths cost once
/// serves sixty-four. Where neighbours see other surfaces, p_i says so: nothing is blurred.
struct Tile {
  static constexpr int kSide = 8, kBlocks = 4, kPixels = kSide * kSide;
  static constexpr BlockShape kBlockShape{.width = 4, .height = 4, .samples = 1};
  std::array<Block, kBlocks> blocks;
  std::array<Lanes<int>, kBlocks> edges;  ///< −1 where direct light is gathered by itself (edge_pixels.h)
  int times;  ///< the request's samples are taken so many times where light is uneven (edge_pixels.h)
  PixelKey key;  ///< of all random numbers after the first surface: they are spread evenly over the tile
};
using TileSums = std::vector<BlockSums>;  ///< of each block

/// Whether the request's paths can be shared: matt surfaces, phasors, more than direct light.
bool canShare(const Scene::Impl& scene, const TraceRequest& request);

/// The tile whose top left pixel is (x, y).
void prepareTile(const Tracing& tracing, int x, int y, Tile& tile);
/// Traces samples [first, last) of every pixel of the tile, in batches of so many, whose spread is the
/// variance; of edges without their direct light.
void traceTile(const Tracing& tracing, const Tile& tile, int first, int last, int batch, TileSums& sums);

}  // namespace toftwin::sim
