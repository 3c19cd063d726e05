// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/block_means.h"

namespace toftwin::sim {

/// A pixel with very many samples is cut into pieces of this many, so that threads can share it; a tile of
/// pixels likewise. The pieces' sums are added in order: the result does not depend on who did which.
inline constexpr int kSamplesPerPiece = 4096;

/// Traces the region by tiles whose pixels share their paths.
void traceTiles(const Tracing& tracing, const Region& region, Light& light);

}  // namespace toftwin::sim
