// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <map>

namespace toftwin::plan {

/// A wall's errors in steps of 25 mm of range, pixel by pixel. Over a wide wall ranges differ by much of a wave,
/// and within a cell of many pixels they may, too, so that a mean over the image or over cells would be too
/// small by sin(ks)/(ks) of waves e^{ikd}, 2s the span. Over a step of 25 mm, 0.5 % is lost of a wave of 0.47 m.
class RangeSteps {
 public:
  struct Step {
    double range_m = 0.0, error_mm = 0.0, pixels = 0.0;  ///< sums over the pixels; how many they are
  };

  void add(double range_m, double error_mm) {
    if (!std::isfinite(range_m) || !std::isfinite(error_mm)) return;
    Step& step = steps_[std::lround(range_m / kStep_m)];
    step.range_m += range_m, step.error_mm += error_mm, ++step.pixels, ++pixels_;
  }
  void add(const RangeSteps& others) {
    for (const auto& [number, step] : others.steps_) {
      Step& own = steps_[number];
      own.range_m += step.range_m, own.error_mm += step.error_mm, own.pixels += step.pixels;
    }
    pixels_ += others.pixels_;
  }
  [[nodiscard]] const std::map<long, Step>& steps() const { return steps_; }
  [[nodiscard]] double pixels() const { return pixels_; }

 private:
  static constexpr double kStep_m = 0.025;
  std::map<long, Step> steps_{};  ///< by their number from 0 on
  double pixels_ = 0.0;
};

}  // namespace toftwin::plan
