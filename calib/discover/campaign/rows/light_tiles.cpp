// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/light_tiles.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/discover/campaign/rows/whitened.h"

namespace toftwin::discover {
namespace {

/// Pixels along the side of a tile, as sim::Sampler::Shared has it.
constexpr int kTile = 8;
/// Of an image; in larger ones several tiles are one, which is as uneven as they are in the mean.
constexpr int kMostTiles = 48;
constexpr int kRangeClass = 2, kAmplitudeClass = 3;  // behind those of poses and light

/// The stated variance is the mean of a phasor's two components, and either of them has twice that at most.
constexpr double kMostShare = std::numbers::sqrt2;

}  // namespace

LightTiles::LightTiles(int width, int height) {
  do {
    side_ += kTile;
    across_ = (width + side_ - 1) / side_, down_ = (height + side_ - 1) / side_;
  } while (across_ * down_ > kMostTiles);
}

std::optional<LightTiles> LightTiles::of(const std::vector<MeasuredCapture>& captures) {
  const auto stated =
      std::ranges::find_if(captures, [](const MeasuredCapture& one) { return !one.light_variance.empty(); });
  if (stated == captures.end()) return std::nullopt;
  LightTiles tiles{stated->light_variance.width(), stated->light_variance.height()};
  double stands = 0.0, places = 0.0;
  for (const MeasuredCapture& one : captures) {
    if (one.light_variance.empty()) continue;
    const auto of_place = static_cast<double>(one.light_stands);
    const double share = of_place / static_cast<double>(one.light_captures);
    stands += share, places += share / of_place;
  }
  tiles.alike_ = std::sqrt(stands / places);
  return tiles;
}

std::vector<Group> LightTiles::groups(std::size_t first) const {
  std::vector<Group> groups(2);
  for (Group& group : groups) {
    group.kind = Kind::PerCapture, group.count = count();
    group.most_scale = kMostShare, group.alike = alike_;
  }
  groups[0].name = "light of tiles: range", groups[0].first = first, groups[0].scale_class = kRangeClass;
  groups[1].name = "light of tiles: amplitude", groups[1].first = first + count();
  groups[1].scale_class = kAmplitudeClass;
  return groups;
}

void LightTiles::put(const Cells& cells, const MeasuredCapture& capture, std::size_t first,
                     std::span<Eigen::MatrixXf> by_channel) const {
  if (capture.light_variance.empty()) return;
  // A stand's captures are one: they draw it once.
  const float times = std::sqrt(static_cast<float>(capture.light_stands) / static_cast<float>(capture.light_captures)) /
                      static_cast<float>(side_ / kTile);
  for (const auto& [channel, variance, begin] :
       {std::tuple{Channel::Range, &capture.light_variance_m2, first},
        std::tuple{Channel::LogAmplitude, &capture.light_variance, first + count()}}) {
    if (!cells.has(channel)) continue;
    std::vector<Image<float>> deviation(count(), Image<float>(variance->width(), variance->height()));
    for (int y = 0; y < variance->height(); ++y)
      for (int x = 0; x < variance->width(); ++x)
        deviation[tileOf(x, y)](x, y) = times * std::sqrt((*variance)(x, y));
    for (std::size_t tile = 0; tile < count(); ++tile)
      by_channel[static_cast<std::size_t>(channel)].col(static_cast<Eigen::Index>(begin + tile)) =
          cells.whitened(channel, deviation[tile]);
  }
}

}  // namespace toftwin::discover
