// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <span>
#include <vector>

#include <toftwin/image.h>

namespace toftwin::plan {

/// A lens that spreads a share of all light evenly over the image: what it adds to each pixel is the mean
/// phasor of what the camera sees, V_f = mean A e^(−ik_f r), k_f = 4πf/c, from its own ranges (along the ray,
/// m) and amplitudes.
class Veil {
 public:
  /// Pixels without a range or an amplitude add nothing.
  Veil(const Image<float>& range_m, const Image<float>& amplitude, std::span<const double> frequency_hz);
  /// By how much a small veil of 1 moves each frequency's range of a pixel, mm: −Im(V_f e^(ik_f r) / A) /
  /// k_f.
  [[nodiscard]] std::vector<double> slopes_mm(double range_m, double amplitude) const;

 private:
  std::vector<double> radians_per_m_{};
  std::vector<std::complex<double>> light_{};
};

}  // namespace toftwin::plan
