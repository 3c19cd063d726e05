// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/search/places.h"

#include <algorithm>

#include "calib/linear/linear.h"

namespace toftwin::discover {
namespace {

double middleOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// What is common to all, as the middle one of what each capture says by itself: half of them may be wrong.
Eigen::VectorXd middleOf(const Marginal& marginal, const Columns& columns) {
  std::vector<std::vector<double>> said(columns.size());
  for (const CaptureEvidence& one : marginal.captures) {
    const Eigen::MatrixXd gram = one.gram(columns, columns);
    const Eigen::VectorXd by_itself = pseudoInverse(gram).inverse * one.moment(columns);
    for (std::size_t i = 0; i < columns.size(); ++i)
      if (gram.diagonal()[static_cast<Eigen::Index>(i)] > 0.0)
        said[i].push_back(by_itself[static_cast<Eigen::Index>(i)]);
  }
  Eigen::VectorXd common = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i)
    if (!said[i].empty()) common[static_cast<Eigen::Index>(i)] = middleOf(std::move(said[i]));
  return common;
}

/// χ² per row of each capture, if that is common to all.
std::vector<double> errorsAt(const Marginal& marginal, const Columns& columns, const Eigen::VectorXd& common) {
  std::vector<double> errors;
  for (const CaptureEvidence& one : marginal.captures)
    errors.push_back(std::max(0.0, energyLeft(one, columns, common)) / std::max(1.0, one.rows));
  return errors;
}

Place placeBy(const CaptureEvidence& one, const Eigen::VectorXd& common) {
  constexpr Eigen::Index kOwn = 6, kFirst = 2;  // pose and light, behind offset and gain
  const Eigen::MatrixXd own = one.gram.block<kOwn, kOwn>(kFirst, kFirst);
  const linear::Ldlt with_prior{own + Eigen::MatrixXd::Identity(kOwn, kOwn)};  // prior deviations of 1
  const Eigen::MatrixXd seen = with_prior.solveEach(own);
  const Eigen::VectorXd off =
      with_prior.solve(one.moment.segment<kOwn>(kFirst) - one.gram.block<kOwn, 2>(kFirst, 0) * common);
  Place place;
  for (std::size_t way = 0; way < place.off.size(); ++way) {
    const auto at = static_cast<Eigen::Index>(way);
    place.off[way] = off[at], place.seen[way] = seen(at, at);
  }
  return place;
}

}  // namespace

Evidence weighed(Evidence evidence, const std::vector<double>& weights) {
  for (std::size_t c = 0; c < weights.size(); ++c) {
    CaptureEvidence& one = evidence.captures[c];
    one.gram *= weights[c], one.moment *= weights[c], one.energy *= weights[c];
  }
  return evidence;
}

std::vector<double> temperOf(const Evidence& evidence, std::span<const double> scales) {
  constexpr double kMost = 2.0;
  constexpr int kTimes = 4;
  const Marginal as_stated = marginalise(evidence, scales);
  const Columns columns = nuisanceColumns(as_stated);
  std::vector<double> weights(evidence.captures.size(), 1.0);
  Eigen::VectorXd common = middleOf(as_stated, columns);
  for (int k = 0; k < kTimes && !weights.empty(); ++k) {
    const std::vector<double> errors = errorsAt(as_stated, columns, common);
    const double most = kMost * middleOf(errors);
    for (std::size_t c = 0; c < errors.size(); ++c) weights[c] = errors[c] > most ? most / errors[c] : 1.0;
    common = fit(marginalise(weighed(evidence, weights), scales), columns).coefficient;
  }
  return weights;
}

Eigen::VectorXd commonOf(const Evidence& evidence, std::span<const double> scales) {
  const Marginal marginal = marginalise(weighed(evidence, temperOf(evidence, scales)), scales);
  return fit(marginal, nuisanceColumns(marginal)).coefficient;
}

std::vector<Place> placesAt(const Evidence& evidence, const Eigen::VectorXd& common) {
  std::vector<Place> places;
  for (const CaptureEvidence& one : evidence.captures) places.push_back(placeBy(one, common));
  return places;
}

std::vector<Place> placesBy(const Evidence& evidence, std::span<const double> scales) {
  return placesAt(evidence, commonOf(evidence, scales));
}

}  // namespace toftwin::discover
