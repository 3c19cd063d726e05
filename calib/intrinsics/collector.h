// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>
#include <vector>

#include "calib/intrinsics/brightness.h"
#include "calib/intrinsics/coverage.h"
#include "calib/intrinsics/detect.h"

namespace toftwin::intrinsics {

/// Gathers views of one camera, one image after the other.
class Collector {
 public:
  explicit Collector(Target target, DetectOptions options = {})
      : target_(std::move(target)), options_(options) {}

  /// Looks for the board and keeps what was seen. Rejected, for views are counted as independent: an image whose
  /// pixels are those of an earlier one, and one in which the board was held still since another that counts. An
  /// Error if the image has another size than those before.
  Result<Sighting> add(const NamedImage& image);
  /// Keeps what was found elsewhere in an image of that size.
  Result<> add(Sighting sighting, ImageSize size);
  /// Whether a view shows the board nearly where one of those kept does: it adds little.
  [[nodiscard]] bool isLikeAnother(const Sighting& sighting) const;

  [[nodiscard]] const Target& target() const { return target_; }
  [[nodiscard]] const DetectOptions& options() const { return options_; }
  [[nodiscard]] ImageSize size() const { return size_; }
  [[nodiscard]] const std::vector<Sighting>& sightings() const { return sightings_; }

 private:
  Target target_;
  DetectOptions options_;
  ImageSize size_{};
  std::vector<Sighting> sightings_;
  std::unordered_map<std::size_t, std::string> names_;  ///< of images, by the hash of their pixels

  [[nodiscard]] Sighting look(const NamedImage& image);
};

/// Two views between which the board moved by less are of one that was held still.
inline constexpr double kStill_px = 0.5;

/// How far the board moved between two views, mean over the corners seen in both; infinite if there are none.
double movedBy(const Sighting& a, const Sighting& b);

}  // namespace toftwin::intrinsics
