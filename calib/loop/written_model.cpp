// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/written_model.h"

#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/loop/between_groups.h"
#include "calib/loop/noise.h"
#include "calib/loop/projection.h"

namespace toftwin::loop {
namespace {

terms::Term constantTerm(double value, terms::Quantity quantity) { return {.quantity = quantity, .coefficient = value}; }

std::string titleOf(const Discovery& d, const Effect& effect) {
  return fmt::format("{}: {}", fmt::join(headersOf(d.readings, effect.shape.covariates), " and "), effect.shape.name());
}

/// Offsets of groups as levels of the column that names them.
std::vector<terms::Term> groupTerms(const Discovery& d, const Eigen::VectorXd& offset) {
  const auto quantity = quantityOf(d.readings);
  std::vector<terms::Term> all;
  for (Eigen::Index g = 0; g < offset.size(); ++g) {
    terms::Factor level{.basis = terms::Basis::Level, .of = {.parts = {{1.0, groupColumn(d.readings)}}}, .level = d.open.evidence.group_names[static_cast<std::size_t>(g)]};
    if (offset[g] != 0.0) all.push_back({.quantity = quantity, .coefficient = offset[g], .factors = {level}});
  }
  return all;
}

/// Everything at once, on open rows: constant, gain, series, effects.
Model modelOf(const Discovery& d) {
  const Evidence& e = d.open.evidence;
  const auto quantity = quantityOf(d.readings);
  Model model{.data = d.readings.file.filename().string(), .unit = d.readings.unit,
              .measured = d.readings.measured_name.empty() ? d.readings.error_name : d.readings.measured_name,
              .reference = d.readings.reference_name, .data_id = dataIdOf(d.readings)};
  const std::vector<Effect>& effects = d.mean.effects;
  Eigen::VectorXd left = lessEffects(e, effects);
  const Eigen::VectorXd offset = d.has_group_offsets ? groupOffsets(e, left) : Eigen::VectorXd();
  if (d.has_group_offsets)
    for (Eigen::Index i = 0; i < left.size(); ++i) left[i] -= offset[e.group[static_cast<std::size_t>(i)]];
  const Eigen::VectorXd weight = robustWeights(left.array() - median({left.begin(), left.end()}), e.sigma);
  const bool has_truth = d.open.hasTruth();
  const double constant = has_truth ? left.dot(weight) / weight.sum() : 0.0;
  if (has_truth || effects.empty()) model.effects.push_back({.title = "constant", .role = "constant", .terms = {constantTerm(constant, quantity)}});
  const auto add = [&](const Effect& effect, const std::string& role) {
    model.effects.push_back({.title = role == "effect" ? titleOf(d, effect) : role, .role = role, .terms = termsOf(effect.shape, effect.coefficient, quantity), .p = effect.p});
  };
  for (const Effect& effect : effects)
    if (isGain(d, effect)) add(effect, "gain");
  for (const Effect& effect : effects)
    if (isSeries(effect)) add(effect, "series");
  if (d.has_group_offsets) model.effects.push_back({.title = "series", .role = "series", .terms = groupTerms(d, offset)});
  for (const Effect& effect : effects)
    if (!isGain(d, effect) && !isSeries(effect)) add(effect, "effect");
  return model;
}

/// Simpler models, each by least squares: what a person would try first.
std::vector<Rung> rungsOf(const Discovery& d) {
  const Evidence e = ungrouped(d.open.evidence);
  const auto quantity = quantityOf(d.readings);
  std::vector<Rung> rungs;
  if (!d.open.hasTruth()) return rungs;
  const auto fitted = [&](const std::vector<Product>& products) {
    const Eigen::MatrixXd x = columnsOf(e, products);
    const LeastSquares fit = leastSquares(e, e.y, Eigen::VectorXd::Ones(e.rows()), x);
    std::vector<terms::Term> all{constantTerm((e.y - x * fit.coefficient).mean(), quantity)};
    for (std::size_t i = 0; i < products.size(); ++i)
      all.push_back({.quantity = quantity, .coefficient = fit.coefficient[static_cast<Eigen::Index>(i)], .factors = products[i]});
    return all;
  };
  rungs.push_back({"constant", fitted({})});
  std::vector<Product> products;
  if (e.reference.size() > 0) {
    products.push_back({{.basis = terms::Basis::Power, .of = {.parts = {{1.0, std::string{rangeName(d.readings)}}}}, .numbers = {1.0}}});
    rungs.push_back({"gain", fitted(products)});
  }
  for (const Effect& effect : d.mean.effects) {
    if (!isSeries(effect)) continue;
    products.insert(products.end(), effect.shape.columns.begin(), effect.shape.columns.end());
    if (!rungs.empty() && rungs.back().name == "series") rungs.pop_back();
    rungs.push_back({"series", fitted(products)});
  }
  if (d.has_group_offsets) {
    const auto levels = groupTerms(d, Eigen::VectorXd::Ones(d.open.evidence.groups()));
    for (std::size_t i = 1; i < levels.size(); ++i) products.push_back(levels[i].factors);
    rungs.push_back({"series", fitted(products)});
  }
  return rungs;
}

}  // namespace

bool isSeries(const Effect& effect) { return effect.shape.covariates == std::vector<std::string>{std::string{kLine}}; }
bool isGain(const Discovery& d, const Effect& effect) {
  return effect.shape.covariates == std::vector<std::string>{std::string{rangeName(d.readings)}} && effect.shape.name() == "straight line";
}

Result<> writeModel(Discovery& d) {
  Model model = modelOf(d);
  model.rungs = rungsOf(d);
  auto read = parseModel(toToml(model), "model.toml");
  if (!read) return read.error();
  d.model = *std::move(read);
  d.seen = ladderOf(d.open, d.model), d.unseen = ladderOf(d.locked, d.model);
  d.is_written = d.unseen.steps.size() < 2 || d.unseen.last() < d.unseen.first();
  return {};
}

}  // namespace toftwin::loop
