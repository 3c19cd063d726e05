// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <toftwin/units.h>

namespace toftwin::sim {

/// A pixel's phases at several frequencies made into one length.
struct Unwrapped {
  double range_m = 0.0;
  /// How far the phases are from agreeing, radians: the root of the summed squares (Kinect v2) or
  /// the root mean square (general) of their deviations from what the length says.
  double deviation_rad = 0.0;
};

/// How a Kinect v2's decoder joins its three frequencies in the ratio 10 : 2 : 15 (80, 16, 120
/// MHz), from phases in cycles [0, 1), after the algorithm in libfreenect2's depth processors:
///  1. 16 MHz says which cycle of 80 MHz it is, within the 15 units that 16 MHz spans (a unit is
///  half the
///     wavelength of 240 MHz, 625 mm);
///  2. the parity of the 120 MHz cycle, 2 units long, says whether it is the first or the second
///  15;
///  3. 80 MHz then says which cycle of 120 MHz it is;
///  4. range = 30 units · (sum of the three unwrapped phases in cycles) / 27.
/// Each frequency has the same weight per cycle: one radian of error at any of them is 110.5 mm.
/// The deviation is the distance of the three unwrapped phases from the line (10, 2, 15) on which
/// consistent triples lie.
Unwrapped unwrapKinectV2(double cycles_80, double cycles_16, double cycles_120, double unit_m);

/// Joins phases at frequencies in whole-number ratios. Tries every cycle of the highest frequency
/// within the common period c / (2 gcd), takes for each the nearest cycles of the others, and keeps
/// the one whose weighted spread is smallest; the result is their weighted mean. The variance of a
/// phase being ∝ 1/A², the weight of frequency i is (Aᵢ / λᵢ)², λᵢ = c / 2fᵢ. One frequency: no
/// choice.
class Unwrapper {
 public:
  /// Frequencies are taken to whole kilohertz. `speed_of_light` in m/s: what the device assumes.
  Unwrapper(std::span<const Frequency> frequencies, double speed_of_light);

  /// From phases in cycles [0, 1) and amplitudes, in the order of the frequencies.
  [[nodiscard]] Unwrapped operator()(std::span<const double> cycles,
                                     std::span<const double> amplitudes) const;

  /// The range after which all phases repeat.
  [[nodiscard]] Length unambiguousRange() const { return unambiguous_range_m_ * metre; }

 private:
  std::vector<double> period_m_, per_m_;  // λᵢ, 1/λᵢ
  std::size_t highest_ = 0;
  int candidates_ = 1;
  double unambiguous_range_m_ = 0.0;
};

}  // namespace toftwin::sim
