// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Dense>

#include "calib/discover/campaign/captures/campaign.h"
#include "calib/discover/campaign/captures/reading.h"

namespace toftwin::discover {

/// What of a pixel is compared: its range, and the logarithm of its amplitude, which ties the pose
/// down.
enum class Channel { Range, LogAmplitude };
inline constexpr std::size_t kChannels = 2;
inline constexpr auto kRange = static_cast<std::size_t>(Channel::Range),
                      kLog = static_cast<std::size_t>(Channel::LogAmplitude);

/// How an image is divided into cells.
struct CellGrid {
  int cell_width = 1, cell_height = 1;
  int columns = 0, rows = 0;
  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
};

/// Which pixels of a capture count, summed up into cells whose pixels lie below each other, so that
/// patterns of columns stay. A cell's value is  Σ w x / √Σ w  with w = 1/variance: noise of
/// variance 1, whatever the cell.
class Cells {
 public:
  static constexpr int kMostCells = 2000;
  Cells() = default;
  /// `most`: so many cells; enough to tell shapes, few enough that all columns fit into memory.
  Cells(const MeasuredCapture& capture, const TracedCapture& traced, const Reading& declared,
        int most = kMostCells);
  /// Cells of an image of this size.
  [[nodiscard]] static CellGrid gridOf(int width, int height, int most = kMostCells);

  [[nodiscard]] std::size_t size() const { return cells_.size(); }
  /// Where a cell lies in the grid of all cells that there could be, row after row: the same in all
  /// captures of a camera.
  [[nodiscard]] std::size_t placeOf(std::size_t cell) const { return places_[cell]; }
  [[nodiscard]] const CellGrid& grid() const { return grid_; }
  [[nodiscard]] bool has(Channel channel) const { return !weight_[at(channel)].empty(); }
  /// The image as whitened cells; NaN counts as 0.
  [[nodiscard]] Eigen::VectorXf whitened(Channel channel, const Image<float>& image) const;
  /// Plain means over the cells' pixels.
  [[nodiscard]] Eigen::VectorXf means(const Image<float>& image) const;
  /// √Σ w of each cell: what a number that is the same for all its pixels is multiplied with.
  [[nodiscard]] const Eigen::VectorXf& rootWeights(Channel channel) const {
    return root_[at(channel)];
  }

 private:
  static std::size_t at(Channel channel) { return static_cast<std::size_t>(channel); }
  std::vector<std::vector<std::uint32_t>> cells_;     ///< numbers of their pixels
  std::vector<std::size_t> places_;                   ///< of the cells in the grid
  CellGrid grid_;
  std::array<std::vector<float>, kChannels> weight_;  ///< by pixel
  std::array<Eigen::VectorXf, kChannels> root_;
};

}  // namespace toftwin::discover
