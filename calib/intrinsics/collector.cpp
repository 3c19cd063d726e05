// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/collector.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace toftwin::intrinsics {

double movedBy(const Sighting& a, const Sighting& b) {
  double sum = 0.0;
  int both = 0;
  std::size_t j = 0;  // corners are in the order of their index
  for (const Corner& corner : a.corners) {
    while (j < b.corners.size() && b.corners[j].index < corner.index) ++j;
    if (j == b.corners.size() || b.corners[j].index != corner.index) continue;
    sum += std::hypot(corner.at.u - b.corners[j].at.u, corner.at.v - b.corners[j].at.v);
    ++both;
  }
  return both > 0 ? sum / both : HUGE_VAL;
}

Result<> Collector::add(Sighting sighting, ImageSize size) {
  if (size_ != ImageSize{} && size_ != size) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} has {} x {} pixels, but {} has {} x {}: calibrate each image size by itself, for "
                             "cropping and binning make another lens",
                             sighting.name, size.width, size.height, sightings_.front().name, size_.width,
                             size_.height)};
  }
  size_ = size;
  sightings_.push_back(std::move(sighting));
  return {};
}

Result<Sighting> Collector::add(const NamedImage& image) {
  Sighting sighting = findBoard(image.brightness, target_, options_);
  sighting.name = image.name;
  if (auto kept = add(sighting, {image.brightness.width(), image.brightness.height()}); !kept) {
    return kept.error();
  }
  return sighting;
}

bool Collector::isLikeAnother(const Sighting& sighting) const {
  const double least = 0.02 * std::hypot(size_.width, size_.height);
  return std::ranges::any_of(sightings_, [&](const Sighting& other) {
    return other.isUsed() && movedBy(sighting, other) < least;
  });
}

}  // namespace toftwin::intrinsics
