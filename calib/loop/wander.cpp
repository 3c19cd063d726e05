// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/wander.h"

#include <algorithm>
#include <cmath>

namespace toftwin::loop {
namespace {

/// What is known of the process at one row.
struct State {
  double mean = 0.0, variance = 0.0;
};

State forgotten(const Wander& wander) { return {0.0, wander.slow}; }
State next(const State& now, const Wander& w) {
  return {w.keeps * now.mean, w.keeps * w.keeps * now.variance + w.slow * (1.0 - w.keeps * w.keeps)};
}
State seen(const State& before, double residual, const Wander& w) {
  const double gain = before.variance / (before.variance + w.white);
  return {before.mean + gain * (residual - before.mean), (1.0 - gain) * before.variance};
}

double logLikelihood(const Eigen::VectorXd& residual, const std::vector<int>& group, const Wander& w) {
  double sum = 0.0;
  State state = forgotten(w);
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    state = i == 0 || group[at] != group[at - 1] ? forgotten(w) : next(state, w);
    const double variance = state.variance + w.white, miss = residual[i] - state.mean;
    sum -= 0.5 * (miss * miss / variance + std::log(variance));
    state = seen(state, residual[i], w);
  }
  return sum;
}

/// What each row should be by the rows before its block, going in one direction.
std::vector<State> byOneSide(const Eigen::VectorXd& residual, const std::vector<int>& group, const std::vector<int>& block, const Wander& w, bool forwards) {
  const Eigen::Index n = residual.size();
  std::vector<State> known(static_cast<std::size_t>(n));
  State before_block = forgotten(w), all = before_block;
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto at = static_cast<std::size_t>(forwards ? k : n - 1 - k);
    const std::size_t last = forwards ? at - 1 : at + 1;
    const bool begins = k == 0 || group[at] != group[last];
    // `all` has seen every row so far; `before_block` none of this row's block.
    if (begins) all = before_block = forgotten(w);
    else if (block[at] != block[last]) all = before_block = next(all, w);
    else all = next(all, w), before_block = next(before_block, w);
    known[at] = before_block;
    all = seen(all, residual[static_cast<Eigen::Index>(at)], w);
  }
  return known;
}

}  // namespace

Wander fitWander(const Eigen::VectorXd& residual, const std::vector<int>& group) {
  const double variance = std::max(1e-300, residual.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, residual.size())));
  Wander best{.slow = 0.0, .keeps = 0.0, .white = variance};
  double most = logLikelihood(residual, group, best);
  for (const double keeps : {0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995}) {
    for (const double share : {0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 0.95}) {
      const Wander one{.slow = share * variance, .keeps = keeps, .white = (1.0 - share) * variance};
      const double likelihood = logLikelihood(residual, group, one);
      if (likelihood > most) most = likelihood, best = one;
    }
  }
  best.likelihood = most;
  return best;
}

Eigen::VectorXd predictBlocks(const Eigen::VectorXd& residual, const std::vector<int>& group, const std::vector<int>& block, const Wander& wander) {
  Eigen::VectorXd predicted = Eigen::VectorXd::Zero(residual.size());
  if (!(wander.slow > 0.0)) return predicted;
  const auto before = byOneSide(residual, group, block, wander, true), after = byOneSide(residual, group, block, wander, false);
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    // Both sides know the process's own distribution, which counts once: information adds.
    const State& a = before[static_cast<std::size_t>(i)];
    const State& b = after[static_cast<std::size_t>(i)];
    const double information = 1.0 / a.variance + 1.0 / b.variance - 1.0 / wander.slow;
    predicted[i] = (a.mean / a.variance + b.mean / b.variance) / std::max(1e-300, information);
  }
  return predicted;
}

}  // namespace toftwin::loop
