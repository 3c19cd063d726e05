// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>

#include "sim/tracer/trace.h"

namespace toftwin::sim {

/// Puts a band's rows into the light of an image of `height` rows, which is made at the first band.
void putBand(const Light& band, int first_row, int height, Light& whole);

/// The same light as trace() gives of the whole image, traced in bands of 16 rows. Before each, `goes_on` is told
/// its first row; nothing if it says no.
std::optional<Light> traceInBands(const Scene& scene, TraceRequest request,
                                  const std::function<bool(int first_row)>& goes_on);

}  // namespace toftwin::sim
