// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>

#include "sim/images/range.h"

namespace toftwin::drivers::simulator {

/// Filters over what the camera has decoded, as a device's firmware has them: none until somebody sets one.
struct FilterSettings {
  enum class Spatial { None, Median, Mean, Bilateral };
  enum class Temporal { None, Mean, Exponential };
  Spatial spatial = Spatial::None;
  int reach = 1;  ///< of the spatial filter: a window of 2 reach + 1 pixels across
  Temporal temporal = Temporal::None;
  int images = 2;  ///< of the temporal mean
  bool of_range = true, of_amplitude = true;

  [[nodiscard]] bool areOn() const {
    return (spatial != Spatial::None || temporal != Temporal::None) && (of_range || of_amplitude);
  }
  bool operator==(const FilterSettings&) const = default;
};

/// First over the image, then over the frames. Pixels that are invalid stay so, and count nowhere.
///   median, bilateral    the effects of that name (sim/effects), the bilateral one with 30 mm; of amplitudes
///   a Gaussian mean                 r′ = Σ r / n over the window temporal mean        r′ = Σ r / n over this
///   frame and those before, `images` together exponential          the effect temporal_filter with its usual
///   numbers; of amplitudes without its jump
class ImageFilters {
 public:
  void apply(const FilterSettings& settings, sim::RangeImage& image);
  /// The next frame has none before it.
  void forget() { before_.clear(); }

 private:
  std::deque<sim::RangeImage>
      before_;  ///< as they were before the temporal mean, or after the exponential one
};

}  // namespace toftwin::drivers::simulator
