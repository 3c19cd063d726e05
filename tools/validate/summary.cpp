// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tools/validate/judged.h"

namespace toftwin::validate {

using compare::Paragraph;
using compare::Section;
using compare::shown;
using compare::TableBlock;

namespace {

/// Effects whose ratio of what is left without and with them is wanted, each with the data that show it.
template <class IsWanted>
std::string named(const std::vector<Judged>& all, const IsWanted& isWanted) {
  std::vector<std::pair<std::string, std::string>> effects;  // and where, in the order of the table
  for (const Judged& judged : all) {
    for (const Ablation& a : judged.ablations) {
      const double ratio = a.without / a.with;
      if (!isWanted(ratio)) continue;
      const std::string where = fmt::format("{} {}", a.data, shown(ratio, ratio < 1.0 ? 2 : 1));
      const auto known = std::find_if(effects.begin(), effects.end(),
                                      [&](const auto& effect) { return effect.first == a.cause; });
      if (known == effects.end()) {
        effects.emplace_back(a.cause, where);
      } else {
        known->second += "; " + where;
      }
    }
  }
  std::string words;
  for (const auto& [effect, where] : effects)
    words += fmt::format("{}{} ({})", words.empty() ? "" : ", ", effect, where);
  return words;
}

/// The effects without which a fit gets much worse, and what speaks against the model: effects without which it gets
/// better, and data on which the fit is worse than no fit.
std::string whatCounts(const std::vector<Judged>& all) {
  constexpr double kMuch = 1.5;
  const std::string much = named(all, [](double ratio) { return ratio >= kMuch; });
  std::string words = much.empty() ? fmt::format("No effect left out makes a fit {} times worse.", kMuch)
                                   : fmt::format("One effect left out, the rest fitted again, so many times "
                                                 "worse (from {} on): {}.",
                                                 kMuch, much);
  const std::string better = named(all, [](double ratio) { return ratio < 0.995; });
  if (!better.empty()) words += fmt::format(" Better without: {}.", better);
  std::string worse;
  for (const Judged& judged : all) {
    for (const Outcome& o : judged.outcomes) {
      if (!(o.fitted_mm > o.as_is_mm) || shown(o.fitted_mm) == shown(o.as_is_mm)) continue;
      worse += fmt::format("{}{} ({} for {})", worse.empty() ? "" : ", ", o.data, shown(o.fitted_mm), shown(o.as_is_mm));
    }
  }
  if (!worse.empty()) words += fmt::format(" The judged half is met worse by the fitted model than by the preset as is: {}.", worse);
  return words;
}

}  // namespace

Section summarySection(const std::vector<Judged>& all, const std::string& other) {
  Section section{.id = "summary",
                  .title = "The simulator against real data: what is left",
                  .verdict = {},
                  .blocks = {}};
  TableBlock left{"RMS in mm over the judged half of each data set; fitted on the other half",
                  {"real data", "n judged", "ideal camera", "ideal + best constant",
                   other, "ours, preset as is", "ours, fitted"},
                  {}};
  TableBlock worth{
      "Each effect left out of the fitted model once, the rest fitted again; RMS over the judged "
      "half",
      {"effect", "data", "with", "without", "times worse"},
      {}};
  const auto cell = [](double v) { return std::isfinite(v) ? shown(v) : std::string{"–"}; };
  int better = 0, sets = 0;
  for (const Judged& judged : all) {
    for (const Outcome& o : judged.outcomes) {
      left.rows.push_back({o.data, std::to_string(o.judged), cell(o.ideal_mm), cell(o.constant_mm),
                           cell(o.other_mm), cell(o.as_is_mm),
                           cell(o.fitted_mm)});
      ++sets, better += o.fitted_mm < 0.8 * o.constant_mm ? 1 : 0;
    }
    for (const Ablation& a : judged.ablations)
      worth.rows.push_back(
          {a.cause, a.data, shown(a.with, 2), shown(a.without, 2), shown(a.without / a.with, 2)});
  }
  section.verdict = fmt::format(
      "On {} of {} data sets the fitted model leaves at least a fifth less than the best constant "
      "does, on "
      "the half that it was not fitted to.",
      better, sets);
  section.blocks = {
      left,
      Paragraph{"Ours is the simulated camera: light, effects, samples, decoder. A corner's and a box's albedo lies "
                "between some that were simulated, and a corner's emitter moves by its geometry."},
      Paragraph{whatCounts(all)}, worth};
  return section;
}

}  // namespace toftwin::validate
