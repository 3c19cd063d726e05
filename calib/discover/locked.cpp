// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/locked.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "calib/discover/estimate.h"

namespace toftwin::discover {
namespace {

using Eigen::Index;

/// Sessions that were never seen: their offset is theirs, and is taken from them before and after alike. It
/// is their median: one row far off would shift all others by its share of a mean.
void removeUnseenOffsets(const TableSource& source, const TableData& rows, std::vector<double>& values) {
  const std::set<int> seen(source.data().session.begin(), source.data().session.end());
  std::map<int, std::vector<double>> unseen;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!seen.contains(rows.session[i])) unseen[rows.session[i]].push_back(values[i]);
  std::map<int, double> offsets;
  for (const auto& [session, all] : unseen) offsets[session] = compare::quantile(all, 0.5);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (const auto offset = offsets.find(rows.session[i]); offset != offsets.end())
      values[i] -= offset->second;
}

/// Deviation of each row: as estimated where rows like it were seen.
std::vector<double> sigmaOf(const TableSource& source, const TableData& rows) {
  const auto& noise = source.noise();
  if (noise.grows_with.empty() && rows.sigma.empty()) return std::vector<double>(rows.rows(), noise.typical);
  std::vector<double> sigma;
  if (!noise.grows_with.empty()) {
    const auto named = [&](const TableData& data) -> const std::vector<double>& {
      return std::ranges::find(data.covariates, noise.grows_with, &TableCovariate::name)->values;
    };
    const auto &known = named(source.data()), &here = named(rows);
    std::vector<std::pair<double, double>> order;
    for (std::size_t i = 0; i < known.size(); ++i) order.emplace_back(known[i], noise.sigma[i]);
    std::ranges::sort(order);
    for (const double x : here) {
      const auto at = std::ranges::lower_bound(order, std::pair{x, 0.0});
      sigma.push_back(noise.scatter * (at == order.end() ? order.back().second : at->second));
    }
    return sigma;
  }
  double ratio = 0.0;
  for (std::size_t i = 0; i < source.data().rows(); ++i)
    ratio += noise.sigma[i] / source.data().sigma[i] / static_cast<double>(source.data().rows());
  for (const double s : rows.sigma) sigma.push_back(noise.scatter * ratio * s);
  return sigma;
}

double lag1(const std::vector<double>& values, const std::vector<int>& session) {
  double products = 0.0, squares = 0.0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (session[i] != session[i - 1]) continue;
    products += values[i] * values[i - 1], squares += values[i] * values[i];
  }
  return squares > 0.0 ? products / squares : 0.0;
}

/// Rows beyond five robust deviations before and after alike: bumped, wrapped or of another surface. One that
/// only the model has put there is the model's.
std::vector<bool> farOff(const std::vector<double>& before, const std::vector<double>& after) {
  constexpr double kFar = 5.0;
  const auto rulerOf = [](std::vector<double> values) {
    for (double& value : values) value = std::abs(value);
    return std::max(1.0, 1.4826 * compare::quantile(values, 0.5));  // rounded values may be equal in most
  };
  const double before_ruler = rulerOf(before), after_ruler = rulerOf(after);
  std::vector<bool> is_far;
  for (std::size_t i = 0; i < before.size(); ++i)
    is_far.push_back(std::abs(before[i]) > kFar * before_ruler && std::abs(after[i]) > kFar * after_ruler);
  return is_far;
}

struct ChiSquares {
  double before = 0.0, after = 0.0, rows = 0.0;
};

double removedOf(const ChiSquares& sums) {
  const double explainable = sums.before - sums.rows;
  return explainable > 0.0 ? (sums.before - sums.after) / explainable : std::nan("");
}

/// Blocks of rows that follow each other are drawn with replacement.
void addInterval(const std::vector<ChiSquares>& blocks, Judged& judged) {
  std::mt19937_64 random{20'260'101};
  std::vector<double> draws;
  for (int d = 0; d < 500; ++d) {
    ChiSquares sums;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const ChiSquares& one = blocks[random() % blocks.size()];
      sums.before += one.before, sums.after += one.after, sums.rows += one.rows;
    }
    const double removed = removedOf(sums);
    if (std::isfinite(removed)) draws.push_back(removed);
  }
  judged.removed_low = compare::quantile(draws, 0.025), judged.removed_high = compare::quantile(draws, 0.975);
}

}  // namespace

std::vector<Estimate> fitNuisances(const TableSource& source, std::span<const double> scales) {
  std::vector<Effect> none;
  return estimate(source, scales, none);
}

std::vector<double> predicted(const TableSource& source, const TableData& rows,
                              const std::vector<Estimate>& nuisances, const std::vector<Effect>& effects) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Index>(rows.rows()));
  std::size_t next = 0;
  for (const auto& [group, columns] : source.nuisanceColumns(rows))
    for (Index c = 0; c < columns.cols(); ++c) sum += nuisances[next++].value * columns.col(c);
  for (const Effect& effect : effects) {
    const Eigen::MatrixXd columns = columnsOf(rows, termsOf(effect));
    for (Index c = 0; c < columns.cols(); ++c)
      sum += effect.coefficient[static_cast<std::size_t>(c)] * columns.col(c);
  }
  return {sum.begin(), sum.end()};
}

Judged judgeLocked(const TableSource& source, const TableData& locked, const std::vector<Estimate>& plain,
                   const Finding& finding) {
  Judged judged;
  judged.rows = locked.rows();
  if (locked.rows() == 0) return judged;
  const auto sigma = sigmaOf(source, locked);
  const auto before = predicted(source, locked, plain, {});
  const auto after = predicted(source, locked, finding.nuisances, finding.effects);
  for (std::size_t i = 0; i < locked.rows(); ++i) {
    judged.before_value.push_back(locked.error[i] - before[i]);
    judged.after_value.push_back(locked.error[i] - after[i]);
  }
  removeUnseenOffsets(source, locked, judged.before_value);
  removeUnseenOffsets(source, locked, judged.after_value);
  judged.before = compare::summarise(judged.before_value),
  judged.after = compare::summarise(judged.after_value);
  const std::size_t size = std::max<std::size_t>(1, locked.rows() / 40);
  std::vector<ChiSquares> blocks;
  ChiSquares all;
  std::vector<double> standard_before, standard_after;
  for (std::size_t i = 0; i < locked.rows(); ++i) {
    standard_before.push_back(judged.before_value[i] / sigma[i]);
    standard_after.push_back(judged.after_value[i] / sigma[i]);
  }
  const std::vector<bool> is_far = farOff(standard_before, standard_after);
  judged.far_off = static_cast<std::size_t>(std::ranges::count(is_far, true));
  for (std::size_t i = 0; i < locked.rows(); ++i) {
    if (i % size == 0) blocks.emplace_back();
    if (is_far[i]) continue;
    const double z0 = standard_before[i], z1 = standard_after[i];
    for (ChiSquares* sums : {&blocks.back(), &all})
      sums->before += z0 * z0, sums->after += z1 * z1, sums->rows += 1.0;
  }
  judged.captures = blocks.size();
  judged.explainable = all.before - all.rows,
  judged.explainable_error = std::sqrt(2.0 * std::max(all.rows, 1.0));
  judged.removed = removedOf(all);
  judged.noise_before = all.before / std::max(all.rows, 1.0),
  judged.noise_after = all.after / std::max(all.rows, 1.0);
  addInterval(blocks, judged);
  judged.lag1_before = lag1(judged.before_value, locked.session);
  judged.lag1_after = lag1(judged.after_value, locked.session);
  return judged;
}

}  // namespace toftwin::discover
