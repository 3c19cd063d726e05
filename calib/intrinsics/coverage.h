// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calib/intrinsics/detect.h"
#include "calib/intrinsics/estimate.h"

namespace toftwin::intrinsics {

/// Where in the image boards were seen.
class ImageCover {
 public:
  static constexpr int kAcross = 32, kDown = 24;
  ImageCover(const Target& target, ImageSize size) : target_(target), size_(size) {}
  /// The area between a view's corners and half a square around them.
  void add(const Sighting& sighting);
  [[nodiscard]] bool isCovered(int column, int row) const { return cells_[index(column, row)]; }
  [[nodiscard]] Pixel centre(int column, int row) const;
  [[nodiscard]] double share() const;  ///< of the image, 0 … 1
  /// Those of nine parts of the image of which less than such a share is covered: "top left", "centre", …
  [[nodiscard]] std::vector<std::string> missing(double least = 0.5) const;
  /// left, top, right, bottom of all corners.
  [[nodiscard]] std::array<double, 4> box() const { return box_; }

 private:
  static std::size_t index(int column, int row) {
    return static_cast<std::size_t>(row) * kAcross + static_cast<std::size_t>(column);
  }
  Target target_;
  ImageSize size_;
  std::array<bool, static_cast<std::size_t>(kAcross) * kDown> cells_{};
  std::array<double, 4> box_{1e9, 1e9, -1e9, -1e9};
};

/// `share`, 0 … 1, in whole per cent: what is not yet reached is not told as if it was (84.6 % of 85).
int wholePercent(double share);

/// What views lack for a good calibration, in words that tell a person what to do next.
struct Guidance {
  std::size_t views = 0;
  double covered = 0.0;                      ///< share of the image
  std::vector<std::string> missing{};        ///< empty: enough
  std::optional<double> worst_error_px{};    ///< standard error of the lens anywhere in the image, if known
  [[nodiscard]] bool isEnough() const { return missing.empty(); }
};
struct GuidanceGoals {
  std::size_t views = 12;
  double covered = 0.85;
  double tilt_deg = 20.0;        ///< with each of the four edges of the board nearest
  double distance_ratio = 1.4;   ///< of the farthest view to the nearest
  double worst_error_px = 0.5;
};
/// `estimate`: of the views so far, if there is one.
Guidance guide(const Target& target, const std::vector<Sighting>& sightings, ImageSize size,
               const Estimate* estimate, const GuidanceGoals& goals = {});

}  // namespace toftwin::intrinsics
