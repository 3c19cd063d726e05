// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calib/compare/characteristics.h"

namespace toftwin::compare {

/// Slopes of a plane through B − A [mm from the left edge of the image to the right one, and from the top to the
/// bottom]: least squares, all pixels compared alike. None where they span less than half of the image either way.
std::optional<std::array<double, 2>> imageSlopes_mm(const PoseComparison& images);

/// The same as a mean over poses.
class Tilt {
 public:
  explicit Tilt(const std::vector<PoseComparison>& poses);
  /// By how much the edges of the image are off, one against the other.
  [[nodiscard]] double edge_mm() const;
  /// Where an edge is off by more than one reading scatters: "; from the top of the image to the bottom it goes by
  /// 10.8 mm".
  [[nodiscard]] std::string words(double noise_mm) const;

 private:
  std::array<double, 2> slope_mm_{};
};

}  // namespace toftwin::compare
