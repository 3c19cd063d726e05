// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <vector>

#include "sim/images/samples.h"

namespace toftwin::sim {

/// The phase steps' cosines and sines: θₖ = 2πk/N.
struct Steps {
  explicit Steps(int count);
  std::vector<float> cosine, sine;
};

/// Demodulates one frequency of one pixel row by row: the discrete Fourier coefficient
///     p = (2/N) Σₖ Sₖ e^(−iθₖ),   Sₖ = tap 0 − tap 1 (two taps) or tap 0 (one)
/// so that Sₖ = B + A cos(φ − θₖ) gives p = A e^(−iφ): the convention of Light's phasors. Needs N
/// ≥ 3.
void demodulateRow(const Samples& samples, const Steps& steps, std::size_t frequency, int y,
                   std::complex<float>* phasors);

/// φ/2π in [0, 1) and A of phasors A e^(−iφ), `zero_cycles` taken off the former. The arc tangent
/// is Abramowitz & Stegun's 4.4.49: within 2e-8 rad, so that the error is float's rounding.
void polarRow(const std::complex<float>* phasors, std::size_t count, float zero_cycles,
              float* cycles, float* amplitudes);

/// The mean charge of a row's pixels over all frequencies and steps, taps added: the unmodulated
/// part.
void unmodulatedRow(const Samples& samples, int y, float* charge);

/// How far the samples contradict each other, in electrons, the largest over the frequencies. For
/// an even number of steps the alternating sum (2/N) |Σₖ (−1)ᵏ Sₖ| and, with two taps, (2/N) |Σₖ
/// Sₖ| are zero for every scene and every odd waveform; motion, interference and tap errors make
/// them grow. Zero for an odd number of steps with one tap, where no such sum exists.
void asymmetryRow(const Samples& samples, int y, float* electrons);

}  // namespace toftwin::sim
