// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "sim/tracer/scene.h"
#include "tests/bench/measured.h"

namespace toftwin::bench {

/// Rays per second beside Embree alone on the same rays.
Bars compareWithEmbree(const sim::Scene& room);
/// How much noise each sampler leaves after how much processor time, in `room`, the corner, the desk and
/// before a box.
Bars compareSamplers(const sim::Scene& room);
/// How far the tracer is from the closed form of a furnace, an integrating sphere with all bounces, where the
/// tests have no time to see 1e-4: of each albedo more and more paths until σ ≤ 3e-5 |P| at each frequency,
/// or `limit` of processor time is gone.
Bars furnace(std::chrono::duration<double> limit);

}  // namespace toftwin::bench
