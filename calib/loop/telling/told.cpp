// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/telling/told.h"

#include <algorithm>
#include <cmath>

#include "calib/loop/noise.h"
#include "calib/loop/projection.h"

namespace toftwin::loop {
namespace {

/// Two effects take each other back where their sum varies by less than this share of the larger one. Of two that are equally large and
/// independent it varies by 1.4 of it, of two that are correlated by −0.75 by 0.7.
constexpr double kTakesBack = 0.7;

Eigen::VectorXd aboutMean(const Eigen::VectorXd& values) { return values.array() - values.mean(); }

Eigen::VectorXd curveOfOne(const Evidence& evidence, const Effect& effect) {
  return aboutMean(columnsOf(evidence, effect.shape.columns) * effect.coefficient);
}

bool takeBack(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return spreadOf(a + b) < kTakesBack * std::max(spreadOf(a), spreadOf(b));
}

/// Effects that take each other back, directly or by way of others.
std::vector<std::vector<std::size_t>> clustersOf(const std::vector<Eigen::VectorXd>& curves) {
  std::vector<std::size_t> cluster(curves.size());
  for (std::size_t i = 0; i < cluster.size(); ++i) cluster[i] = i;
  for (std::size_t i = 0; i < curves.size(); ++i)
    for (std::size_t j = i + 1; j < curves.size(); ++j)
      if (takeBack(curves[i], curves[j])) std::ranges::replace(cluster, std::size_t{cluster[j]}, cluster[i]);
  std::vector<std::vector<std::size_t>> all(curves.size());
  for (std::size_t i = 0; i < cluster.size(); ++i) all[cluster[i]].push_back(i);
  std::erase_if(all, [](const auto& one) { return one.size() < 2; });
  return all;
}

/// Everything that hats along these covariates say, and of two their products.
std::vector<Product> flexibleOver(const Evidence& evidence, const std::vector<std::string>& covariates) {
  std::vector<Product> products;
  const auto named = [](std::string_view name) { return std::ranges::find(families(), name, &Family::name); };
  const auto add = [&](const Family& family, Arguments arguments, const Inner& inner) {
    if (!family.applies(arguments)) return;
    auto more = family.make(arguments, inner);
    products.insert(products.end(), more.begin(), more.end());
  };
  std::vector<const Covariate*> arguments;
  for (const std::string& name : covariates) arguments.push_back(evidence.find(name));
  const double knots = std::clamp(std::floor(static_cast<double>(evidence.rows()) / 25.0), 3.0, 33.0);
  for (const Covariate*& one : arguments) {
    add(*named("curve"), {&one, 1}, {knots});
    add(*named("levels"), {&one, 1}, {});
    add(*named("straight line"), {&one, 1}, {});
  }
  if (arguments.size() == 2) add(*named("curve times curve"), arguments, {5.0});
  return products;
}

/// E(T | x): the nearest to T that goes with these covariates, its own shape among what may.
Eigen::VectorXd partOf(const Evidence& evidence, const Eigen::VectorXd& sum, const Effect& effect) {
  const Evidence one = ungrouped(evidence);
  Eigen::MatrixXd columns = sideBySide(columnsOf(one, flexibleOver(one, effect.shape.covariates)), columnsOf(one, effect.shape.columns));
  return aboutMean(sum - leastSquares(one, sum, Eigen::VectorXd::Ones(sum.size()), columns).residual);
}

/// The effects of one cluster, that first which says most of what is left.
void tellTogether(const Evidence& evidence, const std::vector<Effect>& effects, const std::vector<std::size_t>& cluster, std::vector<Told>& told) {
  Eigen::VectorXd left = Eigen::VectorXd::Zero(evidence.rows());
  for (const std::size_t i : cluster) left += told[i].curve;
  const Eigen::VectorXd sum = left;
  std::vector<std::size_t> open = cluster, order;
  while (!open.empty()) {
    std::vector<Eigen::VectorXd> parts;
    for (const std::size_t i : open) parts.push_back(partOf(evidence, left, effects[i]));
    const auto best = std::ranges::max_element(parts, {}, spreadOf) - parts.begin();
    const std::size_t chosen = open[static_cast<std::size_t>(best)];
    told[chosen].curve = parts[static_cast<std::size_t>(best)];
    left -= told[chosen].curve;
    order.push_back(chosen), open.erase(open.begin() + best);
  }
  for (const std::size_t i : cluster) told[i].with = order, told[i].sum = sum, told[i].joint = spreadOf(left);
}

}  // namespace

std::vector<Told> toldOf(const Evidence& evidence, const std::vector<Effect>& effects) {
  std::vector<Told> told;
  std::vector<Eigen::VectorXd> curves;
  for (const Effect& effect : effects) {
    curves.push_back(curveOfOne(evidence, effect));
    told.push_back({.curve = curves.back()});
  }
  for (const auto& cluster : clustersOf(curves)) tellTogether(evidence, effects, cluster, told);
  return told;
}

}  // namespace toftwin::loop
