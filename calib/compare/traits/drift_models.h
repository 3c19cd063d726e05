// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// What a model with parameters p says at a time.
using DriftShape = std::function<double(std::span<const double> p, double t)>;

/// A model of the series, ready to be fitted. Times are relative to the series' length, so that numbers are
/// of order 1.
struct DriftCandidate {
  DriftModel kind = DriftModel::Constant;
  DriftShape shape{};
  std::vector<double> start{};
  double cost = 0.0;  ///< parameters, as BIC counts them
  std::vector<double> sigma{};  ///< of each row, whose values are over theirs; empty: all are alike

  [[nodiscard]] Model over(Column t) const {
    return [this, t](std::span<const double> p, std::size_t i) {
      return shape(p, t[i]) / (sigma.empty() ? 1.0 : sigma[i]);
    };
  }
};

constexpr std::size_t kDriftModels = 6;
using DriftCandidates = std::array<DriftCandidate, kDriftModels>;
/// All models, with where to begin and where steps are, of a series whose times go from 0 to 1.
DriftCandidates driftCandidates(Column t, Column y);
/// Nothing where the series has no such model, or it does not converge.
std::optional<Fit> fitOf(const DriftCandidate& candidate, Column t, Column y);
/// Exponentials that are over before the second row or outlast the series twenty times are none.
bool isPlausible(const DriftCandidate& candidate, const Fit& fit, Column t);

}  // namespace toftwin::compare
