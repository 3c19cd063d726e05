// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <fmt/format.h>

#include "calib/compare/real_data.h"

namespace toftwin::compare {

Section summarySection(const std::vector<Finding>& findings) {
  Section section{.id = "summary",
                  .title = "The simulator against real data: what is left",
                  .verdict = {},
                  .blocks = {}};
  TableBlock left{"RMS over the judged half of each data set; fitted on the other half",
                  {"data", "n judged", "unit", "ideal camera", "… with the best constant",
                   "published simulator", "ours, preset", "ours, fitted"},
                  {}};
  TableBlock worth{
      "Each effect left out of the fitted model once, the rest fitted again; RMS over the judged "
      "half",
      {"effect", "data", "with", "without", "times worse"},
      {}};
  const auto cell = [](double v) { return std::isfinite(v) ? shown(v) : std::string{"–"}; };
  int better = 0, all = 0;
  for (const Finding& finding : findings) {
    for (const Outcome& o : finding.outcomes) {
      left.rows.push_back({o.data, std::to_string(o.judged), "mm", cell(o.ideal_mm),
                           cell(o.constant_mm), cell(o.published_mm), cell(o.as_is_mm),
                           cell(o.fitted_mm)});
      ++all, better += o.fitted_mm < 0.8 * o.constant_mm ? 1 : 0;
    }
    for (const Ablation& a : finding.ablations)
      worth.rows.push_back(
          {a.effect, a.data, shown(a.with, 2), shown(a.without, 2), shown(a.without / a.with, 2)});
  }
  section.verdict = fmt::format(
      "On {} of {} data sets the fitted model leaves at least a fifth less than the best constant "
      "does, on "
      "the half that it was not fitted to.",
      better, all);
  section.blocks = {left, worth};
  return section;
}

}  // namespace toftwin::compare
