// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/waves.h"

#include <fmt/format.h>
#include <toftwin/units.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace toftwin::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kSameWave = 1e-3;     ///< over 8 m of a wave of 0.3 m, 0.2 rad
constexpr double kMostOfItself = 0.5;  ///< more of a wave as large, and it may be that one

bool areTheSame(const Wave& a, const Wave& b) { return std::abs(a.per_m - b.per_m) < kSameWave * b.per_m; }

/// cos and sin of each, side by side.
MatrixXd partsOf(const std::vector<Wave>& waves, Column distance_m) {
  MatrixXd parts(static_cast<Index>(distance_m.size()), static_cast<Index>(2 * waves.size()));
  for (Index w = 0; w < parts.cols() / 2; ++w) {
    const double per_m = waves[static_cast<std::size_t>(w)].per_m;
    for (Index i = 0; i < parts.rows(); ++i) {
      const double phase = per_m * distance_m[static_cast<std::size_t>(i)];
      parts(i, 2 * w) = std::cos(phase), parts(i, 2 * w + 1) = std::sin(phase);
    }
  }
  return parts;
}

}  // namespace

std::vector<Wave> wavesOf(std::span<const double> frequency_hz, std::span<const int> orders) {
  std::vector<Wave> waves;
  for (const double f : frequency_hz) {
    for (const int k : orders) {
      const Wave one{2.0 * std::numbers::pi * k * 2.0 * f / kSpeedOfLight_m_per_s,
                     fmt::format("{:.6g} MHz, {} per period", f * 1e-6, k)};
      const auto same =
          std::ranges::find_if(waves, [&](const Wave& there) { return areTheSame(there, one); });
      if (same == waves.end())
        waves.push_back(one);
      else
        same->name += " = " + one.name;  // 3 of 80 MHz and 2 of 120 MHz are one wave
    }
  }
  return waves;
}

std::vector<std::string> doubtsOf(const std::vector<Wave>& fitted, const std::vector<Wave>& left_out,
                                  Column distance_m) {
  std::vector<Wave> others;
  for (const Wave& one : left_out) {
    if (std::ranges::none_of(fitted, [&](const Wave& there) { return areTheSame(there, one); }))
      others.push_back(one);
  }
  std::vector<std::string> doubts(fitted.size());
  const auto n = static_cast<Index>(distance_m.size()), waves = static_cast<Index>(2 * fitted.size());
  if (others.empty()) return doubts;
  if (n < waves + 2) {  // fewer than it takes to fit them: nothing can be said for them
    std::ranges::fill(
        doubts, fmt::format("it may be a wave of {}: {} rows do not tell them", others.front().name, n));
    return doubts;
  }
  MatrixXd model(n, 2 + waves);
  model.col(0).setOnes(), model.rightCols(waves) = partsOf(fitted, distance_m);
  for (Index i = 0; i < n; ++i) model(i, 1) = distance_m[static_cast<std::size_t>(i)];
  const MatrixXd shown = model.colPivHouseholderQr().solve(partsOf(others, distance_m));
  for (std::size_t w = 0; w < fitted.size(); ++w) {
    double most = kMostOfItself;
    for (std::size_t k = 0; k < others.size(); ++k) {
      // Of all phases the one that does most: the 2 × 2 block's largest singular value.
      const Eigen::Matrix2d block =
          shown.block<2, 2>(static_cast<Index>(2 + 2 * w), static_cast<Index>(2 * k));
      const double share = std::sqrt(
          (block.transpose() * block).eval().selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff());
      if (!(share > most)) continue;
      most = share;
      doubts[w] = fmt::format(
          "it may be a wave of {}, which these distances do not tell, and of which {:.2g} would show as it",
          others[k].name, share);
    }
  }
  return doubts;
}

}  // namespace toftwin::compare
