// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <toftwin/image.h>
#include <toftwin/units.h>

namespace toftwin::sim {

/// Correlation samples in electrons: `electrons[(f * steps + k) * taps + tap]` is frequency f at
/// step k, taken with the reference delayed by 2πk/steps. A pixel with two taps collects in tap 1
/// while tap 0 does not; its sample is the difference tap 0 − tap 1. NaN marks a sample that is
/// missing. `flags` holds what is known before decoding (PixelFlag::Saturated, …) and may be empty:
/// nothing.
struct Samples {
  std::vector<Frequency> frequencies{};
  int steps = 4;
  int taps = 1;
  std::vector<Image<float>> electrons{};
  Image<std::uint8_t> flags{};

  [[nodiscard]] int width() const { return electrons.empty() ? 0 : electrons.front().width(); }
  [[nodiscard]] int height() const { return electrons.empty() ? 0 : electrons.front().height(); }
  [[nodiscard]] const Image<float>& tap(std::size_t frequency, int step, int tap_index) const {
    return electrons[index(frequency, step, tap_index)];
  }
  [[nodiscard]] Image<float>& tap(std::size_t frequency, int step, int tap_index) {
    return electrons[index(frequency, step, tap_index)];
  }

  /// Where in `electrons` a frequency's step and tap are.
  [[nodiscard]] std::size_t index(std::size_t frequency, int step, int tap_index) const {
    return (frequency * static_cast<std::size_t>(steps) + static_cast<std::size_t>(step)) *
               static_cast<std::size_t>(taps) +
           static_cast<std::size_t>(tap_index);
  }
};

}  // namespace toftwin::sim
