// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/model.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "protocol/settings/describe.h"
#include "protocol/settings/settings.h"
#include "sim/images/content_hash.h"

namespace toftwin::loop {
namespace {

using terms::Basis;
using terms::Term;

/// The error of a corrected value is found by turns; a gain of 23 % takes 20 of them to rounding.
constexpr int kTurns = 60;

bool endsInHat(const Product& product) { return !product.empty() && product.back().basis == Basis::Hat; }

/// Everything of a product but its last factor, as a text that is equal for equal factors.
std::string besideLast(const Product& product) {
  return terms::toText({.coefficient = 1.0, .factors = {product.begin(), product.end() - 1}}) + product.back().of.parts.front().covariate;
}

std::string tomlOf(const std::vector<Term>& all) {
  std::string out = "terms = [\n";
  for (const Term& term : all) out += "  " + settings::toToml(terms::toText(term)) + ",\n";
  return out + "]\n";
}

std::vector<Term> termsIn(settings::Table& table) {
  std::vector<Term> all;
  for (const std::string& text : table.texts("terms").value_or(std::vector<std::string>{})) {
    if (auto term = terms::parseTerm(text)) all.push_back(*std::move(term));
    else table.complain("terms", term.error().message);
  }
  return all;
}

}  // namespace

std::string dataIdOf(const table::Readings& readings) {
  std::string bytes;
  const auto add = [&]<class T>(const std::vector<T>& values) {
    if (!values.empty()) bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  };
  add(readings.line), add(readings.error), add(readings.reference);
  return sim::contentHash(bytes);
}

std::vector<Term> termsOf(const Model& model) {
  std::vector<Term> all;
  for (const LearnedEffect& effect : model.effects) all.insert(all.end(), effect.terms.begin(), effect.terms.end());
  return all;
}

std::vector<Term> termsOf(const Shape& shape, const Eigen::VectorXd& coefficient, terms::Quantity quantity) {
  std::vector<Term> all;
  std::map<std::string, std::size_t> curves;             // which of `all` a curve is
  std::map<std::size_t, std::map<double, double>> knots;  // of each of them
  for (std::size_t i = 0; i < shape.columns.size(); ++i) {
    const Product& product = shape.columns[i];
    const double c = coefficient[static_cast<Eigen::Index>(i)];
    if (!endsInHat(product)) {
      all.push_back({.quantity = quantity, .coefficient = c, .factors = product});
      continue;
    }
    const auto [at, is_new] = curves.try_emplace(besideLast(product), all.size());
    if (is_new) all.push_back({.quantity = quantity, .coefficient = 1.0, .factors = product});
    const auto& hat = product.back().numbers;
    auto& curve = knots[at->second];
    curve[hat[1]] = c;
    // A hat that was left out beside a constant is 0 at its knot.
    for (const double beside : {hat[0], hat[2]})
      if (std::isfinite(beside)) curve.try_emplace(beside, 0.0);
  }
  for (const auto& [which, curve] : knots) {
    terms::Factor& factor = all[which].factors.back();
    factor.basis = Basis::Curve, factor.numbers.clear();
    for (const auto& [x, y] : curve) factor.numbers.insert(factor.numbers.end(), {x, y});
  }
  return all;
}

std::string toToml(const Model& model) {
  std::string out = fmt::format(
      "# Learned by toftwin discover {}: measured = true value + the sum of all terms. See docs/discover.md.\n", TOFTWIN_VERSION);
  out += fmt::format("data = {}\nunit = {}\nmeasured = {}\nreference = {}\n", settings::toToml(model.data), settings::toToml(model.unit),
                     settings::toToml(model.measured), settings::toToml(model.reference));
  if (!model.data_id.empty()) out += fmt::format("data_id = {}\n", settings::toToml(model.data_id));
  for (const LearnedEffect& effect : model.effects) {
    out += fmt::format("\n[[effect]]\ntype = \"learned\"\ntitle = {}\nrole = {}\n", settings::toToml(effect.title), settings::toToml(effect.role));
    if (effect.p > 0.0) out += fmt::format("p = {}\n", settings::toToml(effect.p));
    out += tomlOf(effect.terms);
  }
  for (const Rung& rung : model.rungs) out += fmt::format("\n[[rung]]\nname = {}\n{}", settings::toToml(rung.name), tomlOf(rung.terms));
  return out;
}

namespace {

Result<Model> modelIn(settings::Table table) {
  Model model;
  model.data = table.text("data").value_or(""), model.unit = table.text("unit").value_or("");
  model.measured = table.text("measured").value_or(""), model.reference = table.text("reference").value_or("");
  model.data_id = table.text("data_id").value_or("");
  for (settings::Table& section : table.tables("effect")) {
    LearnedEffect effect;
    if (const auto type = section.text("type"); type != "learned")
      section.complain("type", "must be \"learned\": a model of a table has no other effects");
    effect.title = section.text("title").value_or(""), effect.role = section.text("role").value_or("effect");
    effect.p = section.number("p", {0.0, 1.0}, {}, false).value_or(0.0);
    effect.terms = termsIn(section);
    model.effects.push_back(std::move(effect));
  }
  for (settings::Table& section : table.tables("rung"))
    model.rungs.push_back({section.text("name").value_or(""), termsIn(section)});
  if (model.effects.empty()) table.complain("", "has no [[effect]]: it is no model that toftwin discover wrote");
  if (auto checked = table.check(); !checked) return checked.error();
  return model;
}

}  // namespace

Result<Model> parseModel(std::string_view toml, const std::filesystem::path& name) {
  auto table = settings::Table::parse(toml, name);
  if (!table) return table.error();
  return modelIn(*std::move(table));
}

Result<Model> loadModel(const std::filesystem::path& file) {
  auto table = settings::Table::load(file);
  if (!table) return table.error();
  return modelIn(*std::move(table));
}

Eigen::VectorXd predicted(const Evidence& evidence, const std::vector<Term>& all) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(evidence.rows());
  for (const Term& term : all) sum += term.coefficient * columnOf(evidence, term.factors);
  return sum;
}

Result<Eigen::VectorXd> corrected(const TableEvidence& table, const table::Readings& readings, const Model& model,
                                  const std::vector<Term>& all) {
  const auto refuse = [&](const std::string& what) {
    return Error{Error::Code::InvalidArgument, fmt::format("{}: {}", readings.file.string(), what)};
  };
  if (model.unit != readings.unit)
    return refuse(fmt::format("its values are in {}, the model's in {}", readings.unit.empty() ? "no unit" : readings.unit, model.unit.empty() ? "no unit" : model.unit));
  const std::string range{rangeName(readings)};
  for (const std::string& name : terms::covariatesOf(all)) {
    if (name != range && !table.evidence.find(name)) return refuse(fmt::format("the model needs the column '{}', which is not there", name));
  }
  Evidence evidence = table.evidence;
  if (table.measured.size() == 0) return (evidence.y - predicted(evidence, all)).eval();
  if (!evidence.find(range)) evidence.covariates.push_back({.name = range, .unit = readings.unit, .nature = table::Nature::Length, .x = table.measured});
  Covariate& at = *std::ranges::find(evidence.covariates, range, &Covariate::name);
  std::vector<Term> fixed, moving;
  for (const Term& term : all) {
    const auto names = terms::covariatesOf({term});
    (std::ranges::find(names, range) == names.end() ? fixed : moving).push_back(term);
  }
  const Eigen::VectorXd start = table.measured - predicted(evidence, fixed);
  at.x = start;
  for (int turn = 0; turn < kTurns && !moving.empty(); ++turn) {
    const Eigen::VectorXd next = start - predicted(evidence, moving);
    const double change = (next - at.x).cwiseAbs().maxCoeff();
    // Where the error jumps by more than the range between two turns, the middle is as good as either.
    at.x = turn < kTurns / 2 ? next : (0.5 * (next + at.x)).eval();
    if (!(change > 1e-9 * std::max(1.0, start.cwiseAbs().maxCoeff()))) break;
  }
  return at.x;
}

}  // namespace toftwin::loop
