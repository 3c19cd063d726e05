// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "calib/discover/campaign/captures/campaign.h"
#include "calib/discover/evidence.h"

namespace toftwin::discover {

class Cells;

/// Squares of pixels in which a simulated camera's light may err as one. Pixels of a tile use each other's paths
/// (sim::Sampler::Shared), so that of 64 of them nearly as many err alike: what light_sigma states is one pixel's, and
/// says nothing of that. An error of each tile's range and one of its ln amplitude are therefore drawn anew for each
/// capture, beside poses; how large they are, as a share of what is stated, the captures tell.
class LightTiles {
 public:
  /// Nothing where no capture states the noise of its light.
  static std::optional<LightTiles> of(const std::vector<MeasuredCapture>& captures);

  /// Its columns begin at `first`.
  [[nodiscard]] std::vector<Group> groups(std::size_t first) const;
  [[nodiscard]] std::size_t columns() const { return 2 * count(); }
  /// The capture's own, by channel: cells × all columns. shareLightNoise must have been called.
  void put(const Cells& cells, const MeasuredCapture& capture, std::size_t first,
           std::span<Eigen::MatrixXf> by_channel) const;

 private:
  LightTiles(int width, int height);
  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_);
  }
  [[nodiscard]] std::size_t tileOf(int x, int y) const {
    return static_cast<std::size_t>(y / side_) * static_cast<std::size_t>(across_) +
           static_cast<std::size_t>(x / side_);
  }
  int side_ = 0, across_ = 0, down_ = 0;
  double alike_ = 1.0;  ///< root of how many stands are at one place, in the mean
};

}  // namespace toftwin::discover
