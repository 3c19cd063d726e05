// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/discover/curve.h"
#include "calib/discover/table_words.h"

namespace toftwin::discover {
namespace {

using namespace compare;  // this page is made of its parts

std::string experimentInWords(const TableDiscovery& d, const Effect& effect) {
  const auto& e = *effect.experiment;
  std::string words = fmt::format("Next experiment: take {} from {:.4g} to {:.4g}", e.vary, e.from, e.to);
  if (!e.hold.empty()) words += fmt::format(" while {} stays at {:.4g}", e.hold, e.held_at);
  const double rows = std::pow(4.0 * d.noise.typical / std::max(std::abs(e.difference), 1e-12), 2);
  words += fmt::format(". The two explanations differ there by {}{}, which {} at each end would show at 4 σ",
                       shown(std::abs(e.difference), decimalsOf(d)), unitOf(d),
                       rows <= 1.0 ? "one row" : fmt::format("{:.0f} rows", std::ceil(2.0 * rows)));
  return words + ".";
}

TableBlock numbersTable(const TableDiscovery& d, const Effect& effect) {
  TableBlock table{
      fmt::format("Numbers of the effect{}", d.open.unit.empty() ? "" : ", coefficients in " + d.open.unit),
      {"number", "value", "standard error", "95 % from", "to"},
      {}};
  if (!isFormula(effect)) return table;
  for (std::size_t i = 0; i < effect.numbers.size(); ++i) {
    const Estimate& one = effect.numbers[i];
    const auto step = stepRows(d.open, effect, i);
    if (step && one.error < 0.5 * (step->from - step->below)) {
      table.rows.push_back({one.name, "between two rows", "–", placeInWords(d, step->covariate, step->below),
                            placeInWords(d, step->covariate, step->from)});
      continue;
    }
    table.rows.push_back({one.name, significant(one.value), significant(one.error),
                          significant(one.value - 1.96 * one.error),
                          significant(one.value + 1.96 * one.error)});
  }
  return table;
}

TableBlock triedTable(const Effect& effect) {
  constexpr std::size_t kShown = 12;
  TableBlock table{
      "Shapes that were tried: deviance of held-out rows that each removes, in units of the noise's "
      "variance, "
      "less what its search costs; and how much less than the chosen one (± standard error)",
      {"shape", "numbers", "removes", "less than the chosen"},
      {}};
  // A sum of two parts was found in two searches, of which neither tried it.
  if (std::ranges::find(effect.tried, effect.name, &TriedShape::name) == effect.tried.end())
    table.rows.push_back(
        {effect.name, std::to_string(effect.numbers.size()), "–", "the chosen: one of these, and what it leaves"});
  for (std::size_t i = 0; i < effect.tried.size(); ++i) {
    const TriedShape& one = effect.tried[i];
    if (i >= kShown && one.name != effect.name) continue;
    const bool is_useless =
        one.gain.mean < 0.0;  // by how much is rounding where columns are too many for the rows
    table.rows.push_back({one.name, std::to_string(one.numbers), is_useless ? "–" : shown(one.gain.mean, 1),
                          is_useless ? "does worse than nothing"
                                     : shown(one.worse.mean, 1) + " ± " + shown(one.worse.error, 1)});
  }
  return table;
}

}  // namespace

compare::Section effectSection(const TableDiscovery& d, const Effect& effect, std::size_t number) {
  Section section{fmt::format("effect-{}", number),
                  fmt::format("Effect {}: {}", number, effect.name),
                  {},
                  Tone::Neutral,
                  {}};
  section.tone = isCertain(effect) ? Tone::Good : Tone::Fair;
  section.verdict = fmt::format(
      "A part of the error: {}. Formula{}: {}. Without any effect a share of {} of data sets would look "
      "like this (p; the least that {} draws can say is {}). The same is chosen in {} of 200 draws "
      "of the captures.",
      nameInWords(d, effect), d.open.unit.empty() ? "" : " in" + unitOf(d), formulaOf(effect),
      significant(effect.p), d.finding.draws, significant(1.0 / (d.finding.draws + 1.0)),
      shownPercent(effect.frequency));
  section.blocks.push_back(figuresOf(d, effect));
  if (auto numbers = numbersTable(d, effect); !numbers.rows.empty())
    section.blocks.push_back(std::move(numbers));
  if (!effect.alternatives.empty()) {
    TableBlock others{"These data cannot tell it from",
                      {"explanation", "covariates", "removes less by", "correlation"},
                      {}};
    for (const Alternative& other : effect.alternatives) {
      others.rows.push_back({other.name, joined(other.covariates),
                             shown(other.worse.mean, 1) + " ± " + shown(other.worse.error, 1),
                             shown(other.correlation, 2)});
    }
    section.blocks.push_back(std::move(others));
    if (effect.experiment) section.blocks.push_back(Paragraph{experimentInWords(d, effect)});
  }
  section.blocks.push_back(triedTable(effect));
  return section;
}

}  // namespace toftwin::discover
