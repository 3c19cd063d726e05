// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/reference_device/device/datasheet.h"
#include "tests/reference_device/device/dice.h"
#include "tests/reference_device/device/light.h"

namespace toftwin::reference {

/// Electrons in the two taps of each raw exposure.
struct Charges {
  std::size_t frequencies = 0, steps = 0, pixels = 0;
  std::vector<double> taps;         ///< [((frequency · steps + step) · 2 + tap) · pixels + pixel]
  std::vector<std::uint8_t> flags;  ///< saturated
  double& tap(std::size_t f, std::size_t k, std::size_t t, std::size_t pixel) {
    return taps[((f * steps + k) * 2 + t) * pixels + pixel];
  }
  [[nodiscard]] double difference(std::size_t f, std::size_t k, std::size_t pixel) const {
    const std::size_t first = (f * steps + k) * 2 * pixels + pixel;
    return taps[first] - taps[first + pixels];
  }
};

/// What the device makes of them.
struct Measured {
  int width = 0, height = 0;
  std::vector<float> range_m, amplitude, ambient;
  std::vector<std::uint8_t> flags;
  std::vector<std::complex<float>> phasors;  ///< [frequency · pixels + pixel]
};

/// Mean charges. Step k of N delays the reference by θ_k = 2πk/N:
///     tap 0, 1 = ½ g t ( L + A ± m Re Σ_n ĉ_n P_n e^(i n θ_k) )
/// with `exposure_scale` times the sheet's exposures and light of `ambient_w_per_m2` on all that is seen.
Charges collect(const Light& light, const Datasheet& sheet, double exposure_scale, double ambient_w_per_m2);

/// Photons, read noise and full wells, as far as they are declared. Without dice the charges stay means, but
/// are cut.
void readOut(Charges& charges, const Datasheet& sheet, Dice* dice);

/// p = (2/N) Σ_k S_k e^(−iθ_k), φ = −arg p less the waveforms' own delay; with several frequencies the range
/// on which they agree best within their common period, weighted by (amplitude · frequency)².
Measured decode(const Charges& charges, const Datasheet& sheet);

}  // namespace toftwin::reference
