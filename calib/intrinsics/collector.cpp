// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/collector.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace toftwin::intrinsics {

namespace {

/// Where corners that both views show are in `a` and in `b`; they are in the order of their index.
std::vector<std::pair<Pixel, Pixel>> cornersOfBoth(const Sighting& a, const Sighting& b) {
  std::vector<std::pair<Pixel, Pixel>> both;
  std::size_t j = 0;
  for (const Corner& corner : a.corners) {
    while (j < b.corners.size() && b.corners[j].index < corner.index) ++j;
    if (j == b.corners.size() || b.corners[j].index != corner.index) continue;
    both.emplace_back(corner.at, b.corners[j].at);
  }
  return both;
}

/// How much of its size in the image the board changed its shape by: what corners moved by less their mean, over their
/// distance from their middle. A tilt of 20° in place is 0.032 to 0.084 (8 x 5 corners of 50 mm at 0.45 to 2 m), one
/// of 10° 0.009 to 0.04, however few pixels that is.
double reshapedBy(const Sighting& a, const Sighting& b) {
  const auto both = cornersOfBoth(a, b);
  Pixel middle{}, shift{};
  for (const auto& [from, to] : both) {
    middle.u += from.u, middle.v += from.v;
    shift.u += to.u - from.u, shift.v += to.v - from.v;
  }
  const auto n = static_cast<double>(both.size());
  double moved = 0.0, size = 0.0;
  for (const auto& [from, to] : both) {
    moved += std::hypot(to.u - from.u - shift.u / n, to.v - from.v - shift.v / n);
    size += std::hypot(from.u - middle.u / n, from.v - middle.v / n);
  }
  return size > 0.0 ? moved / size : 0.0;
}

std::size_t hashOf(const Image<float>& image) {
  const std::span<const float> pixels = image.pixels();
  return std::hash<std::string_view>{}({reinterpret_cast<const char*>(pixels.data()), pixels.size_bytes()});
}

}  // namespace

double movedBy(const Sighting& a, const Sighting& b) {
  double sum = 0.0;
  const auto both = cornersOfBoth(a, b);
  for (const auto& [from, to] : both) sum += std::hypot(to.u - from.u, to.v - from.v);
  return both.empty() ? HUGE_VAL : sum / static_cast<double>(both.size());
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

Sighting Collector::look(const NamedImage& image) {
  const auto [first, is_new] = names_.try_emplace(hashOf(image.brightness), image.name);
  if (!is_new) {
    Sighting same;
    same.rejection = Rejection::SameImage;
    same.detail = "the same image as " + first->second;
    return same;
  }
  Sighting sighting = findBoard(image.brightness, target_, options_);
  if (!sighting.isUsed()) return sighting;
  for (const Sighting& other : sightings_) {
    const double moved = other.isUsed() ? movedBy(other, sighting) : HUGE_VAL;
    if (!(moved < kStill_px)) continue;
    sighting.rejection = Rejection::LikeAnother;
    sighting.detail = fmt::format(
        "the board was held still: its corners are {:.2f} px (mean) from where they are in {}", moved, other.name);
    break;
  }
  return sighting;
}

Result<Sighting> Collector::add(const NamedImage& image) {
  Sighting sighting = look(image);
  sighting.name = image.name;
  if (auto kept = add(sighting, {image.brightness.width(), image.brightness.height()}); !kept) {
    return kept.error();
  }
  return sighting;
}

bool Collector::isLikeAnother(const Sighting& sighting) const {
  const double least = 0.02 * std::hypot(size_.width, size_.height);
  constexpr double kReshaped = 0.03;
  return std::ranges::any_of(sightings_, [&](const Sighting& other) {
    return other.isUsed() && movedBy(sighting, other) < least && reshapedBy(other, sighting) < kReshaped;
  });
}

}  // namespace toftwin::intrinsics
