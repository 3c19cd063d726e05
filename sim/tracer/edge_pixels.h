// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "sim/tracer/block_means.h"
#include "sim/tracer/shared_paths.h"

namespace toftwin::sim {

/// Across an edge, of a surface or of a shadow, direct light is what a pixel is least sure of: a sliver that covers a
/// sixteenth of it is met by one of sixteen samples, or by none. There, direct light alone, which costs a ray and one to
/// each emitter, takes so many times the samples of all other light, with random numbers of its own.
inline constexpr int kEdgeSamples = 16;

/// −1 where the pixel's corners are lit otherwise than each other, so that an edge runs through it: one that crosses the
/// pixel straight leaves a corner on its other side. (What ends or bends within the pixel may be missed; of a footprint
/// that is wider than the pixel, what lies beside it.) What the corners see does not depend on the samples, so that
/// taking more of them there has no bias.
std::array<Lanes<int>, Tile::kBlocks> edgesOf(const Tracing& tracing, const Tile& tile);

/// Direct light of the block's edges, by kEdgeSamples times so many samples, and its variance are added to `means`,
/// which are those of all other light.
void addEdges(const Tracing& tracing, const Block& block, const Lanes<int>& edges, int samples, BlockMeans& means);

}  // namespace toftwin::sim
