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
/// so that Sₖ = B + A cos(φ − θₖ) gives p = A e^(−iφ): the convention of Light's phasors. Needs N ≥ 3.
void demodulateRow(const Samples& samples, const Steps& steps, std::size_t frequency, int y,
                   std::complex<float>* phasors);

/// The mean charge of a row's pixels over all frequencies and steps, taps added: the unmodulated part.
void unmodulatedRow(const Samples& samples, int y, float* charge);

/// How far the samples contradict each other, in electrons, the largest over the frequencies. For an even
/// number of steps the alternating sum (2/N) |Σₖ (−1)ᵏ Sₖ| and, with two taps, (2/N) |Σₖ Sₖ| are zero
/// for every scene and every odd waveform; motion, interference and tap errors make them grow.
/// Zero for an odd number of steps with one tap, where no such sum exists.
void asymmetryRow(const Samples& samples, int y, float* electrons);

}  // namespace toftwin::sim
