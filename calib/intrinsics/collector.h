// SPDX-License-Identifier: Apache-2.0
#pragma once

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

  /// Looks for the board and keeps what was seen. An Error if the image has another size than those before.
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
};

/// How far the board moved between two views, mean over the corners seen in both; infinite if there are none.
double movedBy(const Sighting& a, const Sighting& b);

}  // namespace toftwin::intrinsics
