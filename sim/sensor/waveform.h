// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>

#include <toftwin/units.h>

namespace toftwin::sim {

/// One period of a signal, as its Fourier coefficients with mean 1:
///     e(t) = Σₙ eₙ e^(i n ω t),  e₀ = 1,  e₋ₙ = eₙ*
struct Waveform {
  enum class Shape {
    Sine,         ///< 1 + cos ωt
    Square,       ///< on for `duty` of the period, centred on t = 0
    ClippedSine,  ///< 1 + cos ωt cut at ±`clip`, scaled back to ±1
    Impulse       ///< one flash per period: correlating with it leaves the other signal as it is
  };
  Shape shape = Shape::Sine;
  double duty = 0.5;
  double clip = 0.75;
  Duration rise = 0_ns;  ///< time constant of an RC low pass that the signal goes through

  /// eₙ at modulation frequency `fundamental`, n ≥ 1.
  [[nodiscard]] std::complex<double> coefficient(int n, Frequency fundamental) const;
};

}  // namespace toftwin::sim
