// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <toftwin/units.h>

#include "sim/decode/decode.h"
#include "sim/images/light.h"
#include "sim/images/samples.h"
#include "sim/tracer/trace.h"

namespace toftwin::sim {

/// A pulse and the gates that the pixel opens for it. The pulse is a rectangle of `width` from t =
/// 0 on that went through an RC low pass of time constant `rise`. Gates:
///     short_long:  short [0, T], long [0, 2T]
///     two_gate:    first [0, T], second [T, 2T]
/// and, if there is one, an ambient gate as wide as T when no light was sent.
struct Pulse {
  PulseScheme scheme = PulseScheme::ShortLong;
  Duration width = 30_ns;
  Duration rise = 0_ns;
  bool has_ambient_gate = true;

  /// Share of a pulse's charge that arrives before `time` when it was sent at 0 and took no time.
  [[nodiscard]] double arrivedBefore(Duration time) const;
  /// The same for a gate when the pulse comes back after `delay`. Gate 0, 1 in the order above.
  [[nodiscard]] double gateShare(int gate, Duration delay) const;
  [[nodiscard]] int gates() const { return has_ambient_gate ? 3 : 2; }
  /// How wide a gate is, in pulse widths.
  [[nodiscard]] double gateWidth(int gate) const;
};

/// What the tracer must add up for it.
PathFunctions gateFunctionsOf(const Pulse& pulse);

/// Collects the gates' charges, noise-free, as the steps of one frequency of 0 Hz:
///     Q_k = g · ( Σ_paths w · share_k + A · open · width_k )
/// with g electrons per radiance over the exposure, the ambient radiance A, and `open` the share of
/// the exposure for which a gate as wide as the pulse is open.
Samples collectGates(const Light& light, const Pulse& pulse, double electrons_per_radiance,
                     double open_share);

/// DecodeSettings::pulse_ranges_m: the range at which the noise-free pixel shows the ratio i/(knots
/// − 1) of a single return, for every i. What a factory measures when it moves a target away.
std::vector<double> rangesOfRatios(const Pulse& pulse, int knots);

}  // namespace toftwin::sim
