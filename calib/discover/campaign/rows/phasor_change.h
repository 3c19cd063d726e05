// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <functional>

#include <toftwin/image.h>

#include "calib/discover/campaign/captures/reading.h"
#include "sim/tracer/trace.h"

/// What is read, as the light's phasor, and what a change of that phasor changes of it, to first order.
namespace toftwin::discover {

using Phasors = Image<std::complex<float>>;

/// Number of the highest frequency in light that has some.
std::size_t highestOf(const sim::Light& light);

/// Light's phasor z = A exp(−iφ) of what the pixels would read, φ = 2π r/R; NaN where they read nothing.
Phasors phasorOf(const Reading& reading, double period_m);

/// The same with what is too bright to be read, in proportion to the light that falls there. `light`: one phasor of it.
Phasors withUnread(Phasors z, const Image<std::complex<float>>& light);

/// δz/z; 0 where that is not finite. `change`: δz at a pixel.
Phasors shareOf(const Phasors& z, const std::function<std::complex<float>(std::size_t)>& change);

/// δz/z as a change of what is read: δr = −(R/2π) Im(δz/z) in metres, δ ln A = Re(δz/z).
Reading changeBy(const Phasors& share, double period_m);

}  // namespace toftwin::discover
