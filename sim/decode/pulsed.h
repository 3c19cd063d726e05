// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/decode/decode.h"

namespace toftwin::sim {

/// Range of the gate charges of a pulsed camera: samples of one frequency, whose steps are the
/// gates. With the ambient gate's charge a, 0 without that gate, and d_max = c T / 2:
///     short_long:  short s, long l:   ratio = 1 − (s − a) / (l − 2a),        returned charge l −
///     2a two_gate:    Q₁, Q₂:            ratio = (Q₂ − a) / (Q₁ + Q₂ − 2a),     returned charge Q₁
///     + Q₂ − 2a range = d_max · ratio, or what the factory's table gives for the ratio
/// Amplitude is the returned charge; there are no phasors. Ambient is a, without that gate the mean
/// of the gates. A ratio outside 0 … 1 is out of range. Called by decode().
RangeImage decodePulsed(const Samples& samples, const DecodeSettings& settings,
                        const DecodeRays& rays);

}  // namespace toftwin::sim
