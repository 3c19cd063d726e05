// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/judged.h"

#include <algorithm>

#include "calib/compare/trait_verdict.h"
#include "calib/compare/verdict_words.h"
#include "calib/table/table.h"

namespace toftwin::validate {

using compare::shown;
using compare::shownPercent;

const std::vector<std::string> kExplainedHeader{"prediction",           "n",
                                                "RMS left [mm]",        "explained",
                                                "constant missing [mm]", "spread left [mm]",
                                                "spread explained"};

int Task::paths(int samples) const { return std::max(std::min(samples, 32), static_cast<int>(samples * effort)); }

Judged begun(const Heading& heading, const Subject& camera) {
  Judged judged;
  judged.finding.section = {.id = heading.id, .title = camera.title + ": " + heading.title};
  return judged;
}

std::string dataOf(const Heading& heading, const Subject& camera) { return camera.title + ", " + heading.data; }

void addNotes(const Heading& heading, Judged& judged) {
  for (const std::string& note : heading.notes) judged.finding.section.blocks.push_back(compare::Paragraph{note, true});
}

Result<std::vector<double>> columnOf(const Task& task, const std::string& file, const std::string& column) {
  auto columns = table::readNumbers(task.set.folder / file, {column});
  if (!columns) return columns.error();
  return std::move(columns->front());
}

Result<std::vector<std::vector<double>>> columnsOf(const Task& task, const std::string& file,
                                                   const std::vector<std::string>& columns) {
  std::vector<std::vector<double>> all;
  for (const std::string& column : columns) {
    auto one = columnOf(task, file, column);
    if (!one) return one.error();
    all.push_back(*std::move(one));
  }
  return all;
}

void addCharacteristics(const compare::NamedTraits& traits, Judged& judged) {
  auto& blocks = judged.finding.section.blocks;
  const auto verdicts = compare::verdictsOf(traits);
  if (!verdicts.empty()) blocks.push_back(compare::verdictTable(verdicts));
  blocks.push_back(compare::traitTable(traits, "A, measured", "B, simulated"));
  if (!traits.untold.empty()) blocks.push_back(compare::whatIsNotTold("What these data cannot tell", traits));
  judged.finding.data.set("characteristics", toJson(traits)).set("verdicts", toJson(verdicts));
}

std::vector<std::string> explainedRow(const std::string& name, const compare::Explained& e) {
  return {name,
          std::to_string(e.n),
          shown(e.residual_rms),
          shownPercent(e.fraction_raw),
          shown(e.best_offset),
          shown(e.residual_sd),
          shownPercent(e.fraction_centred)};
}

std::vector<double> plus(std::vector<double> values, double constant) {
  for (double& v : values) v += constant;
  return values;
}

compare::Tone toneOf(double explained_fraction) {
  if (explained_fraction >= 0.8) return compare::Tone::Good;
  return explained_fraction >= 0.4 ? compare::Tone::Fair : compare::Tone::Bad;
}

}  // namespace toftwin::validate
