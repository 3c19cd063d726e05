// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/cells.h"

#include <algorithm>
#include <cmath>


namespace toftwin::discover {
namespace {

/// Noise is never taken for less: rounding, and what a model of a lens knows.
constexpr double kLeastRange_m = 2e-5, kLeastLog = 2e-4;

struct CellSize {
  int width = 1, height = 1;
};

/// Columns stay apart as long as that can be: many read-outs err by column.
CellSize cellSizeOf(int width, int height, int most) {
  CellSize size;
  const auto count = [&] {
    return ((width + size.width - 1) / size.width) * ((height + size.height - 1) / size.height);
  };
  while (count() > most) (size.height < 8 ? size.height : size.width) += 1;
  return size;
}

}  // namespace

CellGrid Cells::gridOf(int width, int height, int most) {
  const CellSize size = cellSizeOf(width, height, most);
  return {size.width, size.height, (width + size.width - 1) / size.width,
          (height + size.height - 1) / size.height};
}

Cells::Cells(const MeasuredCapture& capture, const TracedCapture& traced, const Reading& declared,
             int most) {
  const Image<float>& range_m = capture.range_m.mean;
  const int width = range_m.width(), height = range_m.height();
  const bool has_amplitude = !capture.log_amplitude.mean.empty();
  for (auto& weights : weight_) weights.assign(range_m.size(), 0.0F);
  if (!has_amplitude) weight_[at(Channel::LogAmplitude)].clear();
  std::vector<std::uint8_t> counts(range_m.size());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const float noise = capture.range_m.variance[i];
    if (!std::isfinite(range_m[i] - declared.range_m[i]) || !std::isfinite(noise) ||
        traced.is_edge[i] != 0)
      continue;
    if (std::abs(range_m[i] - declared.range_m[i]) > kGross_m) continue;
    const auto weight = [](const Repeated& of, const Image<float>& light, std::size_t pixel, float tracing,
                           double least) {
      const double of_light = light.empty() ? 0.0 : static_cast<double>(light[pixel]);
      return static_cast<float>(1.0 / (static_cast<double>(of.variance[pixel]) * of.clumping + of_light +
                                       static_cast<double>(tracing) + least * least));
    };
    if (has_amplitude) {
      const float log = capture.log_amplitude.mean[i] - declared.log_amplitude[i] +
                        capture.log_amplitude.variance[i];
      if (!std::isfinite(log)) continue;
      weight_[at(Channel::LogAmplitude)][i] =
          weight(capture.log_amplitude, capture.light_variance, i, traced.tracing_variance[i], kLeastLog);
    }
    weight_[at(Channel::Range)][i] =
        weight(capture.range_m, capture.light_variance_m2, i, traced.tracing_variance_m2[i], kLeastRange_m);
    counts[i] = 1;
  }
  grid_ = gridOf(width, height, most);
  const CellSize size{grid_.cell_width, grid_.cell_height};
  for (int top = 0; top < height; top += size.height) {
    for (int left = 0; left < width; left += size.width) {
      std::vector<std::uint32_t> cell;
      for (int y = top; y < std::min(height, top + size.height); ++y) {
        for (int x = left; x < std::min(width, left + size.width); ++x) {
          const auto i = static_cast<std::uint32_t>(y * width + x);
          if (counts[i] != 0) cell.push_back(i);
        }
      }
      if (cell.empty()) continue;
      cells_.push_back(std::move(cell));
      places_.push_back(static_cast<std::size_t>(top / size.height) * static_cast<std::size_t>(grid_.columns) +
                        static_cast<std::size_t>(left / size.width));
    }
  }
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (weight_[c].empty()) continue;
    root_[c].resize(static_cast<Eigen::Index>(cells_.size()));
    for (std::size_t k = 0; k < cells_.size(); ++k) {
      float sum = 0.0F;
      for (const std::uint32_t i : cells_[k]) sum += weight_[c][i];
      root_[c][static_cast<Eigen::Index>(k)] = std::sqrt(sum);
    }
  }
}

Eigen::VectorXf Cells::whitened(Channel channel, const Image<float>& image) const {
  const auto& weight = weight_[at(channel)];
  const auto& root = root_[at(channel)];
  Eigen::VectorXf values(static_cast<Eigen::Index>(cells_.size()));
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    float sum = 0.0F;
    for (const std::uint32_t i : cells_[k]) {
      if (std::isfinite(image[i])) sum += weight[i] * image[i];
    }
    values[static_cast<Eigen::Index>(k)] = sum / root[static_cast<Eigen::Index>(k)];
  }
  return values;
}

Eigen::VectorXf Cells::means(const Image<float>& image) const {
  Eigen::VectorXf values(static_cast<Eigen::Index>(cells_.size()));
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    float sum = 0.0F, n = 0.0F;
    for (const std::uint32_t i : cells_[k]) {
      if (std::isfinite(image[i])) sum += image[i], n += 1.0F;
    }
    values[static_cast<Eigen::Index>(k)] = n > 0.0F ? sum / n : 0.0F;
  }
  return values;
}

}  // namespace toftwin::discover
