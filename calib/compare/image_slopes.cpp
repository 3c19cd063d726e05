// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/image_slopes.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/compare/report.h"
#include "calib/compare/statistics.h"
#include "calib/linear/linear.h"

namespace toftwin::compare {

std::optional<std::array<double, 2>> imageSlopes_mm(const PoseComparison& images) {
  const Image<float> difference_mm = comparedDifference_mm(images);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Array2d low = Eigen::Array2d::Constant(1.0), high = -low;
  for (int y = 0; y < difference_mm.height(); ++y) {
    for (int x = 0; x < difference_mm.width(); ++x) {
      const auto d = static_cast<double>(difference_mm(x, y));
      if (!std::isfinite(d)) continue;
      const Eigen::Array2d at{(x + 0.5) / difference_mm.width() - 0.5, (y + 0.5) / difference_mm.height() - 0.5};
      const Eigen::Vector3d row{1.0, at[0], at[1]};
      normal += row * row.transpose(), moment += row * d;
      low = low.min(at), high = high.max(at);
    }
  }
  constexpr double kLeastSpan = 0.5;
  if (!((high - low).minCoeff() >= kLeastSpan)) return std::nullopt;
  const Eigen::Vector3d plane = linear::Ldlt{normal}.solve(moment);
  return std::array{plane[1], plane[2]};
}

Tilt::Tilt(const std::vector<PoseComparison>& poses) {
  std::array<Running, 2> ways;
  for (const PoseComparison& one : poses) {
    const auto slopes = imageSlopes_mm(one);
    for (std::size_t way = 0; slopes && way < ways.size(); ++way) ways[way].add((*slopes)[way]);
  }
  for (std::size_t way = 0; way < ways.size(); ++way) slope_mm_[way] = ways[way].mean();
}

double Tilt::edge_mm() const { return 0.5 * std::max(std::abs(slope_mm_[0]), std::abs(slope_mm_[1])); }

std::string Tilt::words(double noise_mm) const {
  constexpr std::array kWays{"from the left edge of the image to the right", "from the top of the image to the bottom"};
  std::string words;
  for (std::size_t way = 0; way < kWays.size(); ++way) {
    if (!(0.5 * std::abs(slope_mm_[way]) > noise_mm)) continue;
    words += fmt::format("{}{} it goes by {} mm", words.empty() ? "; " : ", and ", kWays[way],
                         shown(slope_mm_[way], 1));
  }
  return words;
}

}  // namespace toftwin::compare
