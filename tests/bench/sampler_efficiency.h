// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/scene.h"

namespace toftwin::bench {

/// Prints how much noise each sampler leaves after how much processor time, in `room`, the corner and the
/// desk.
void compareSamplers(const sim::Scene& room);

}  // namespace toftwin::bench
