// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/score.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include <tbb/parallel_for.h>

#include "calib/linear/linear.h"

namespace toftwin::loop {
namespace {

/// Pairs are looked through among at most so many covariates.
constexpr std::size_t kPaired = 12;

Eigen::MatrixXd drawSigns(int blocks, int draws, std::uint64_t seed) {
  std::mt19937_64 random{seed};
  Eigen::MatrixXd signs(blocks, draws);
  for (Eigen::Index j = 0; j < signs.cols(); ++j)
    for (Eigen::Index i = 0; i < signs.rows(); ++i) signs(i, j) = (random() & 1U) != 0 ? 1.0 : -1.0;
  return signs;
}

/// χ² of k degrees of freedom as a normal deviate [Wilson, Hilferty 1931].
double deviateOf(double chi_square, double k) {
  return (std::cbrt(std::max(0.0, chi_square) / k) - (1.0 - 2.0 / (9.0 * k))) / std::sqrt(2.0 / (9.0 * k));
}

/// What is the same for all families.
struct Screening {
  const Evidence& evidence;
  const Projection projection;
  Eigen::VectorXd left;   ///< projected residual, in units of its own deviation
  Eigen::MatrixXd signs;  ///< blocks × draws

  /// Deviates of one shape: the data's first, then the draws'.
  [[nodiscard]] Eigen::VectorXd deviates(const std::vector<Product>& columns) const;
};

Eigen::VectorXd Screening::deviates(const std::vector<Product>& products) const {
  Eigen::MatrixXd x = columnsOf(evidence, products);
  if (!x.allFinite()) return {};
  const Eigen::VectorXd before = (x.rowwise() - x.colwise().mean()).colwise().norm();
  x = projection(std::move(x));
  Eigen::MatrixXd moments = Eigen::MatrixXd::Zero(x.cols(), evidence.blocks);
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    moments.col(evidence.block[static_cast<std::size_t>(i)]) += left[i] * x.row(i).transpose();
  const auto pairs = linear::eigenpairs(x.transpose() * x);
  const double least = std::max(1e-9 * pairs.values.maxCoeff(), 1e-12 * before.squaredNorm());
  Eigen::Index rank = 0;
  Eigen::MatrixXd whitened(x.cols(), x.cols());
  for (Eigen::Index i = 0; i < pairs.values.size(); ++i)
    if (pairs.values[i] > least && pairs.values[i] > 1e-300)
      whitened.row(rank++) = pairs.vectors.col(i).transpose() / std::sqrt(pairs.values[i]);
  if (rank == 0) return {};
  // More numbers than a third of the blocks fit any signs.
  if (3 * rank > evidence.blocks) return {};
  const Eigen::MatrixXd scores = whitened.topRows(rank) * moments;
  Eigen::VectorXd out(1 + signs.cols());
  const auto k = static_cast<double>(rank);
  out[0] = deviateOf(scores.rowwise().sum().squaredNorm(), k);
  const Eigen::MatrixXd drawn = scores * signs;
  for (Eigen::Index j = 0; j < drawn.cols(); ++j) out[1 + j] = deviateOf(drawn.col(j).squaredNorm(), k);
  return out;
}

/// Blocks that hold several times the energy of most count as those do: signs of two or three blocks that hold nearly all of it
/// say nothing, and those of the others would not be heard.
void evenOut(Eigen::VectorXd& left, const Evidence& evidence) {
  std::vector<double> energy(static_cast<std::size_t>(evidence.blocks), 0.0), rows(energy.size(), 0.0);
  for (Eigen::Index i = 0; i < left.size(); ++i) {
    const auto block = static_cast<std::size_t>(evidence.block[static_cast<std::size_t>(i)]);
    energy[block] += left[i] * left[i], rows[block] += 1.0;
  }
  for (std::size_t b = 0; b < energy.size(); ++b) energy[b] /= std::max(1.0, rows[b]);
  const double usual = 2.0 * median(energy);
  for (Eigen::Index i = 0; i < left.size(); ++i) {
    const double own = energy[static_cast<std::size_t>(evidence.block[static_cast<std::size_t>(i)])];
    if (own > usual && usual > 0.0) left[i] *= std::sqrt(usual / own);
  }
}

/// The family at its best inner numbers: of the data, and of each draw by itself.
struct Best {
  Score score;
  Eigen::VectorXd deviates;
};
bool best(const Screening& screening, const Family& family, const std::vector<const Covariate*>& arguments, std::span<const Hint> hints, Best& best) {
  best.deviates.resize(0);
  for (const Inner& inner : gridOf(family, arguments, hints)) {
    const Eigen::VectorXd deviates = screening.deviates(family.make(arguments, inner));
    if (deviates.size() == 0) continue;
    if (best.deviates.size() == 0 || deviates[0] > best.deviates[0]) best.score.inner = inner;
    if (best.deviates.size() == 0) best.deviates = deviates;
    else best.deviates = best.deviates.cwiseMax(deviates);
  }
  if (best.deviates.size() == 0) return false;
  const auto null = best.deviates.tail(best.deviates.size() - 1);
  const double mean = null.mean();
  const double deviation = std::sqrt((null.array() - mean).square().mean());
  best.deviates = (best.deviates.array() - mean) / std::max(1e-6, deviation);
  best.score.family = &family, best.score.deviate = best.deviates[0];
  best.score.covariates.clear();
  for (const Covariate* c : arguments) best.score.covariates.push_back(c->name);
  return true;
}

}  // namespace

Scores screen(const Evidence& evidence, const Eigen::VectorXd& residual, const Eigen::VectorXd& weight,
              const Eigen::MatrixXd& model, Order order, std::span<const Hint> hints, int draws, std::uint64_t seed) {
  Screening screening{.evidence = evidence, .projection = Projection{evidence, weight, model},
                      .left = {}, .signs = drawSigns(evidence.blocks, draws, seed)};
  screening.left = screening.projection(residual);
  // Blocks of a row or two have no energy of their own that rows' weights have not bounded.
  if (evidence.rows() >= 4 * evidence.blocks) evenOut(screening.left, evidence);
  const double freedom = std::max(1.0, static_cast<double>(residual.size() - screening.projection.rank()));
  const double scale = std::sqrt(screening.left.squaredNorm() / freedom);
  if (!(scale > 0.0)) return {};
  screening.left /= scale;

  Scores scores;
  Eigen::VectorXd largest = Eigen::VectorXd::Constant(1 + draws, -1e300);
  struct Task {
    const Family* family;
    std::vector<const Covariate*> arguments;
    std::optional<Best> found{};
  };
  std::vector<Task> tasks;
  const auto look = [&](const Family& family, std::vector<const Covariate*> arguments) {
    // What is known to be there may be larger or smaller with another covariate.
    const bool is_hinted = family.first && std::ranges::any_of(hints, [&](const Hint& hint) { return hint.family == family.first->name && hint.covariate == arguments[0]->name; });
    if ((family.screens || (is_hinted && !family.name.ends_with(" alone"))) && family.applies(arguments)) tasks.push_back({&family, std::move(arguments)});
  };
  std::vector<const Covariate*> usable;
  for (const Covariate& c : evidence.covariates)
    if (c.varies_within_groups && !c.is_group_name && c.sorted.size() > 1) usable.push_back(&c);
  if (usable.size() > kPaired && order == Order::Together) usable.resize(kPaired);
  for (const Family& family : families()) {
    if (family.arguments != (order == Order::Alone ? 1 : 2)) continue;
    const bool is_symmetric = family.name == "straight line times line" || family.name == "curve times curve" || family.name == "checker";
    for (std::size_t i = 0; i < usable.size(); ++i) {
      if (order == Order::Alone) look(family, {usable[i]});
      for (std::size_t j = is_symmetric ? i + 1 : 0; order == Order::Together && j < usable.size(); ++j)
        if (i != j) look(family, {usable[i], usable[j]});
    }
  }
  tbb::parallel_for(std::size_t{0}, tasks.size(), [&](std::size_t i) {
    Best found;
    if (best(screening, *tasks[i].family, tasks[i].arguments, hints, found)) tasks[i].found = std::move(found);
  });
  for (Task& task : tasks) {
    if (!task.found) continue;
    largest = largest.cwiseMax(task.found->deviates);
    scores.all.push_back(std::move(task.found->score));
  }
  std::ranges::stable_sort(scores.all, [](const Score& a, const Score& b) { return a.deviate > b.deviate; });
  if (scores.all.empty()) return scores;
  const auto null = largest.tail(draws);
  scores.p = (1.0 + static_cast<double>((null.array() >= largest[0]).count())) / (1.0 + draws);
  return scores;
}

}  // namespace toftwin::loop
