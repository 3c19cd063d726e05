// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/evidence.h"

#include <algorithm>
#include <cmath>

#include <toftwin/nan.h>

namespace toftwin::loop {
namespace {

/// A spacing is common if at least this share of neighbouring different values is no nearer.
constexpr double kCommon = 0.1;

Eigen::VectorXd valuesOf(const Evidence& evidence, const terms::Factor& factor) {
  if (factor.basis == terms::Basis::Level) {
    const Covariate* names = evidence.find(factor.of.parts.front().covariate);
    if (!names) return Eigen::VectorXd::Constant(evidence.rows(), kNaN);
    const auto at = std::ranges::find(names->words, factor.level);
    const auto index = static_cast<double>(at - names->words.begin());
    return (names->x.array() == index).cast<double>();
  }
  Eigen::VectorXd x = Eigen::VectorXd::Zero(evidence.rows());
  for (const auto& part : factor.of.parts) {
    const Covariate* covariate = evidence.find(part.covariate);
    if (!covariate) return Eigen::VectorXd::Constant(evidence.rows(), kNaN);
    x += part.weight * covariate->x;
  }
  return x.unaryExpr([&](double at) { return terms::valueOf(factor, at); });
}

}  // namespace

void describe(Covariate& covariate) {
  std::vector<double> all;
  for (const double x : covariate.x)
    if (std::isfinite(x)) all.push_back(x);
  std::ranges::sort(all);
  covariate.quantiles_.assign(201, 0.0);
  covariate.sorted.clear();
  if (all.empty()) {
    covariate.sorted = {0.0};
    return;
  }
  for (std::size_t i = 0; i <= 200; ++i) covariate.quantiles_[i] = all[(all.size() - 1) * i / 200];
  covariate.sorted = all;
  covariate.sorted.erase(std::ranges::unique(covariate.sorted).begin(), covariate.sorted.end());
  std::vector<double> steps;
  for (std::size_t i = 1; i < covariate.sorted.size(); ++i)
    steps.push_back(covariate.sorted[i] - covariate.sorted[i - 1]);
  std::ranges::sort(steps);
  covariate.spacing = steps.empty() ? 0.0 : steps[static_cast<std::size_t>(kCommon * static_cast<double>(steps.size()))];
}

const Covariate* Evidence::find(std::string_view name) const {
  const auto at = std::ranges::find(covariates, name, &Covariate::name);
  return at == covariates.end() ? nullptr : &*at;
}

Evidence rowsOf(const Evidence& all, std::span<const Eigen::Index> rows) {
  Evidence part = all;
  const auto take = [&](const Eigen::VectorXd& from) {
    if (from.size() == 0) return from;
    Eigen::VectorXd to(static_cast<Eigen::Index>(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i) to[static_cast<Eigen::Index>(i)] = from[rows[i]];
    return to;
  };
  part.y = take(all.y), part.sigma = take(all.sigma), part.reference = take(all.reference);
  part.group.clear(), part.block.clear();
  for (const Eigen::Index row : rows) {
    part.group.push_back(all.group[static_cast<std::size_t>(row)]);
    if (!all.block.empty()) part.block.push_back(all.block[static_cast<std::size_t>(row)]);
  }
  for (Covariate& covariate : part.covariates) {
    covariate.x = take(covariate.x);
    describe(covariate);
  }
  return part;
}

std::vector<Eigen::Index> thinned(Eigen::Index rows, Eigen::Index most) {
  const Eigen::Index every = rows <= most ? 1 : rows / most + 1;
  std::vector<Eigen::Index> some;
  for (Eigen::Index i = 0; i < rows; i += 1 + (i * 2654435761LL >> 7) % (2 * every - 1)) some.push_back(i);
  return some;
}

void block(Evidence& evidence, Eigen::Index length, int most) {
  const Eigen::Index n = evidence.rows();
  const Eigen::Index least = std::max<Eigen::Index>(length, (n + most - 1) / most);
  evidence.block.assign(static_cast<std::size_t>(n), 0);
  int current = -1;
  Eigen::Index in_block = least;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(i);
    const bool begins_group = i > 0 && evidence.group[row] != evidence.group[row - 1];
    if (in_block >= least || begins_group) ++current, in_block = 0;
    evidence.block[row] = current;
    ++in_block;
  }
  evidence.blocks = current + 1;
  // Where groups change from row to row, a block of each run of equal groups would be too short to be one.
  if (evidence.blocks > 2 * most) {
    for (Eigen::Index i = 0; i < n; ++i) evidence.block[static_cast<std::size_t>(i)] = static_cast<int>(i / least);
    evidence.blocks = static_cast<int>((n + least - 1) / least);
  }
}

Eigen::VectorXd columnOf(const Evidence& evidence, const Product& product) {
  Eigen::VectorXd column = Eigen::VectorXd::Ones(evidence.rows());
  for (const terms::Factor& factor : product) column.array() *= valuesOf(evidence, factor).array();
  return column;
}

Eigen::MatrixXd columnsOf(const Evidence& evidence, std::span<const Product> products) {
  Eigen::MatrixXd columns(evidence.rows(), static_cast<Eigen::Index>(products.size()));
  for (std::size_t i = 0; i < products.size(); ++i)
    columns.col(static_cast<Eigen::Index>(i)) = columnOf(evidence, products[i]);
  return columns;
}

}  // namespace toftwin::loop
