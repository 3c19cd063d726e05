// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include "sim/effects/effects.h"

namespace toftwin::discover::bench {

/// What is hidden: `off` does nothing, and all that differs from it in `on` is made as strong as is wanted.
struct Hidden {
  sim::AnyEffect off, on;
};

/// An effect as no default has it. What does something by itself is of random strength, in units of what shows as much
/// by itself as `lambda` says (a table's numbers are of one size), and of random sign, where it may be negative. What only shapes that — times, lengths,
/// widths — is 0.4 to 2.5 times its default, or, where it may be negative, up to three times as much to either side; a
/// place, one of those from half to twice the default; a temperature, up to 15 °C off. What a camera file says of the camera, and the number of a
/// device's own pattern, which no search could guess, stay.
Hidden drawn(const sim::AnyEffect& defaults, double lambda,
             const std::function<double(const sim::AnyEffect&)>& lambda_of, std::uint64_t seed);

}  // namespace toftwin::discover::bench
