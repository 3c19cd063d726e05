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

/// Looks at the corners of the tile's pixels for how samples are best spent, and sets the tile's `edges` and `times`.
/// What the corners see does not depend on the samples, so that taking more of them has no bias.
///
/// An edge: the pixel's corners are lit otherwise than each other. One that crosses the pixel straight leaves a
/// corner on its other side. (What ends or bends within the pixel may be missed; of a footprint that is wider than
/// the pixel, what lies beside it.)
///
/// How many times the samples: light of other surfaces is about as noisy all over the tile, so that the variance of
/// a pixel's range goes with one over the square of its light, and the least mean of all tiles' variances for their
/// work comes from samples in proportion to the root of each one's (Neyman 1934).
void lookAtCorners(const Tracing& tracing, Tile& tile);

/// Direct light of the block's edges, by kEdgeSamples times so many samples, and its variance are added to `means`,
/// which are those of all other light.
void addEdges(const Tracing& tracing, const Block& block, const Lanes<int>& edges, int samples, BlockMeans& means);

}  // namespace toftwin::sim
