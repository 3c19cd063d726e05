// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/cross_validation.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace toftwin::discover {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Sums over the captures that are fitted in a fold.
struct Training {
  MatrixXd gram;
  VectorXd moment;
};

std::vector<Training> trainingSums(const Marginal& marginal, const std::vector<int>& fold, int folds,
                                   const Columns& columns) {
  std::vector<Training> sums(static_cast<std::size_t>(folds),
                             {marginal.gram(columns, columns), marginal.moment(columns)});
  for (std::size_t c = 0; c < marginal.captures.size(); ++c) {
    Training& without = sums[static_cast<std::size_t>(fold[c])];
    without.gram -= marginal.captures[c].gram(columns, columns);
    without.moment -= marginal.captures[c].moment(columns);
  }
  return sums;
}

VectorXd solve(const Marginal& marginal, const Training& training, const Columns& columns) {
  MatrixXd gram = training.gram;
  gram.diagonal() += marginal.precision(columns);
  // A coefficient that the fitted captures do not know stays at nothing instead of anywhere: a thousandth of
  // a typical column's weight.
  gram.diagonal() += 1e-6 * MatrixXd(marginal.gram(columns, columns)).diagonal();
  return pseudoInverse(gram, 1e-8).inverse * training.moment;
}

}  // namespace

std::vector<int> foldsOf(const Marginal& marginal, int folds) {
  std::map<std::string, int> next;
  int started = 0;
  std::vector<int> fold;
  for (const CaptureEvidence& capture : marginal.captures) {
    // Blocks start at different folds, so that many blocks of one capture do not all fall into the first.
    const auto [at, is_new] = next.try_emplace(capture.block, started);
    if (is_new) ++started;
    fold.push_back(at->second++ % folds);
  }
  return fold;
}

std::vector<double> heldOut(const Marginal& marginal, const Columns& columns, int folds) {
  const std::vector<int> fold = foldsOf(marginal, folds);
  std::vector<VectorXd> value;
  for (const Training& training : trainingSums(marginal, fold, folds, columns))
    value.push_back(solve(marginal, training, columns));
  std::vector<double> left(marginal.captures.size());
  for (std::size_t c = 0; c < left.size(); ++c)
    left[c] = energyLeft(marginal.captures[c], columns, value[static_cast<std::size_t>(fold[c])]);
  return left;
}

Gain gainOf(const std::vector<double>& before, std::vector<double> after) {
  Gain gain{0, 0.0, std::move(after)};
  for (std::size_t c = 0; c < before.size(); ++c) {
    gain.by_capture[c] = before[c] - gain.by_capture[c];
    gain.total += gain.by_capture[c];
  }
  return gain;
}

std::vector<Gain> crossValidate(const Marginal& marginal, const Columns& model,
                                const std::vector<std::size_t>& groups, int folds) {
  const std::vector<double> before = heldOut(marginal, model, folds);
  std::vector<Gain> gains;
  for (const std::size_t group : groups) {
    Columns columns = model;
    append(columns, marginal.groups[group]);
    gains.push_back(gainOf(before, heldOut(marginal, columns, folds)));
    gains.back().group = group;
  }
  return gains;
}

Difference difference(const Gain& a, const Gain& b) {
  Difference out;
  const auto n = static_cast<double>(a.by_capture.size());
  for (std::size_t c = 0; c < a.by_capture.size(); ++c) out.mean += a.by_capture[c] - b.by_capture[c];
  double squares = 0.0;
  for (std::size_t c = 0; c < a.by_capture.size(); ++c) {
    const double off = a.by_capture[c] - b.by_capture[c] - out.mean / n;
    squares += off * off;
  }
  if (n > 1.0) out.error = std::sqrt(squares * n / (n - 1.0));
  return out;
}

Difference against0(const Gain& gain) {
  return difference(gain, {gain.group, 0.0, std::vector<double>(gain.by_capture.size())});
}

bool holds(const Gain& gain) {
  constexpr double kEnough = 100.0;  // ten standard errors, squared
  const double price = against0(gain).mean - gain.total;
  Gain capped = gain;
  for (double& one : capped.by_capture) one = std::min(one, kEnough);
  for (const Gain& judged : {gain, capped}) {
    Difference all = against0(judged);
    all.mean -= price;
    if (all.mean > 2.0 * all.error) return true;
    if (all.mean > std::sqrt(3.0) * all.error && all.mean > 2.0 * 2.0 * std::sqrt(std::max(0.0, all.mean))) return true;
  }
  return false;
}

bool isMoreBy(double enough, const Gain& more, const Gain& less) {
  Gain by{.total = more.total - less.total};
  for (std::size_t c = 0; c < more.by_capture.size(); ++c)
    by.by_capture.push_back(more.by_capture[c] - less.by_capture[c]);
  return holds(by) && by.total >= enough;
}

}  // namespace toftwin::discover
