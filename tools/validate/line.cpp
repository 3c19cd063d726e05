// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/residual.h"
#include "tools/validate/line_simulation.h"

namespace toftwin::validate {

using compare::Curve;
using compare::Explained;
using compare::Figure;
using compare::Ink;
using compare::Json;
using compare::Plot;
using compare::shown;
using compare::shownPercent;
using compare::Stroke;
using compare::summarise;
using compare::Summary;
using compare::TableBlock;

namespace {

/// A prediction of all rows, and its name in tables.
struct Prediction {
  std::string name;
  std::vector<double> mm;
  Ink ink = Ink::Extra;
};

/// All that is known of one line.
struct Case {
  const Line& what;
  const EffectGroup& fitted;
  std::string data;
  LineRows rows;
  Blocks blocks;
  std::vector<double> nothing, as_is;
  std::vector<Prediction> others;
  CurveFit fit{};  ///< of all numbers
};

/// Rows within the description's places, as blocks; −1 outside of them and where a prediction has a gap.
Blocks blocksOf(const Line& what, const LineRows& rows, const std::vector<double>& as_is, const std::vector<Prediction>& others) {
  Blocks blocks = rows.plates.empty() ? blocksOfRows(rows.size(), static_cast<std::size_t>(what.block_rays)) : rows.run;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const double place = std::abs(rows.place_mm[i]);
    const bool is_outside = place < what.within_mm.front() || place > what.within_mm.back() ||
                            (place == 0.0 && what.edges_mm.size() > 2) || rows.t[i] < what.rays_t.front() ||
                            rows.t[i] > what.rays_t.back();
    double sum = rows.measured_mm[i] + as_is[i];
    for (const Prediction& other : others) sum += other.mm[i];
    if (is_outside || !std::isfinite(sum)) blocks[i] = -1;
  }
  return blocks;
}

std::vector<double> inBlocks(const std::vector<double>& values, const Blocks& blocks) {
  std::vector<double> some;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (blocks[i] >= 0) some.push_back(values[i]);
  return some;
}

Explained explained(const Case& line, const std::vector<double>& prediction) {
  return compare::explain(inBlocks(line.rows.measured_mm, line.blocks), inBlocks(prediction, line.blocks));
}

/// Those numbers that belong to one of the causes.
std::vector<bool> ofCauses(const std::vector<FreeNumber>& numbers, const std::vector<std::string>& causes) {
  std::vector<bool> is_of;
  for (const FreeNumber& number : numbers) is_of.push_back(std::ranges::find(causes, number.causeName()) != causes.end());
  return is_of;
}

std::vector<std::string> without(std::vector<std::string> causes, const std::string& one) {
  std::erase(causes, one);
  return causes;
}

std::vector<std::string> fitRow(const std::string& name, const CurveFit& fit, const std::vector<FreeNumber>& numbers) {
  std::vector<std::string> row{name, shown(fit.fitted_rms, 2), shown(fit.judged_rms, 2)};
  for (std::size_t i = 0; i < numbers.size(); ++i)
    row.push_back(std::isnan(fit.value[i]) ? "–" : shownFitted(fit.value[i], fit.error[i], numbers[i].decimals));
  return row;
}

/// Each cause alone, all but one, and all: what they leave of both halves.
TableBlock fitTable(const Case& line, const PredictNumbers& predict, Json& data) {
  const std::vector<FreeNumber>& numbers = line.fitted.numbers;
  TableBlock table{line.rows.plates.empty()
                       ? fmt::format("Fitted on alternate blocks of {} rays, judged on the others; RMS in mm", line.what.block_rays)
                       : "Fitted on every other run, judged on the runs between; RMS in mm",
                   {"fitted", "fitted half", "judged half"},
                   {}};
  for (const FreeNumber& number : numbers)
    table.header.push_back(number.unit.empty() ? number.name : fmt::format("{} [{}]", number.name, number.unit));
  const auto unfitted = [&](const std::string& name, const std::vector<double>& mm) {
    table.rows.push_back({name, "–", shown(judgedRms(line.rows.measured_mm, mm, line.blocks), 2)});
    table.rows.back().resize(table.header.size(), "–");
  };
  unfitted("nothing: ideal camera", line.nothing);
  unfitted("nothing: preset", line.as_is);
  for (const Prediction& other : line.others) unfitted("nothing: " + other.name, other.mm);
  const std::vector<std::string> causes = causesOf(numbers);
  const auto fitted = [&](const std::string& name, const std::vector<std::string>& some) {
    table.rows.push_back(
        fitRow(name, fitNumbers(line.rows.measured_mm, numbers, ofCauses(numbers, some), predict, line.blocks), numbers));
  };
  for (const std::string& cause : causes)
    if (causes.size() > 1) fitted(cause, {cause});
  for (const std::string& cause : causes)
    if (causes.size() > 2) fitted("all but " + cause, without(causes, cause));
  table.rows.push_back(fitRow(causes.size() > 1 ? "all" : causes.front(), line.fit, numbers));
  Json json = Json::object();
  for (std::size_t i = 0; i < numbers.size(); ++i)
    json.set(numbers[i].name, line.fit.value[i]).set(numbers[i].name + " error", line.fit.error[i]);
  data.set("held_out", json.set("judged_rms_mm", line.fit.judged_rms));
  return table;
}

/// The outcome, and each cause left out. Without an albedo no light comes over other surfaces.
void addOutcome(const Case& line, const PredictNumbers& predict, const PredictNumbers& direct, Judged& judged) {
  const std::vector<FreeNumber>& numbers = line.fitted.numbers;
  const auto& y = line.rows.measured_mm;
  const auto isOf = [&](FreeNumber::Role role) {
    std::vector<bool> is_of;
    for (const FreeNumber& number : numbers) is_of.push_back(number.role == role);
    return is_of;
  };
  const std::vector<bool> constants = isOf(FreeNumber::Role::Constant), albedos = isOf(FreeNumber::Role::Albedo);
  const auto any = [](const std::vector<bool>& all) { return std::ranges::find(all, true) != all.end(); };
  const double ideal = judgedRms(y, line.nothing, line.blocks);
  if (line.what.in_summary) {
    judged.outcomes.push_back(
        {.data = line.data,
         .judged = line.fit.judged_n,
         .ideal_mm = ideal,
         .constant_mm = any(constants) ? fitNumbers(y, numbers, constants, any(albedos) ? direct : predict, line.blocks).judged_rms : ideal,
         .other_mm = line.others.empty() ? kNone : judgedRms(y, line.others.front().mm, line.blocks),
         .as_is_mm = judgedRms(y, line.as_is, line.blocks),
         .fitted_mm = line.fit.judged_rms});
  }
  const std::vector<std::string> causes = causesOf(numbers);
  for (const std::string& cause : line.what.ablate.empty() ? causes : line.what.ablate) {
    const std::vector<bool> is_left_out = ofCauses(numbers, {cause});
    bool has_albedo = false;
    for (std::size_t i = 0; i < numbers.size(); ++i) has_albedo = has_albedo || (is_left_out[i] && albedos[i]);
    const CurveFit rest = fitNumbers(y, numbers, ofCauses(numbers, without(causes, cause)), has_albedo ? direct : predict, line.blocks);
    judged.ablations.push_back({cause, line.data, line.fit.judged_rms, rest.judged_rms});
  }
}

std::string placesInWords(double from, double to) {
  constexpr double kFar = 1e6;
  if (from <= -kFar) return "up to " + shown(to, 0);
  return to >= kFar ? shown(from, 0) + " and more" : fmt::format("{} to {}", shown(from, 0), shown(to, 0));
}

/// Means by part of the line.
TableBlock partTable(const Case& line, Json& data) {
  TableBlock table{"By place, mm from the edge, negative to its left. ± is one standard error by blocks of neighbouring rays",
                   {"place", "n", "measured", "simulated, preset", "difference", "difference, RMS", "fitted"},
                   {}};
  for (const Prediction& other : line.others) table.header.push_back("measured − " + other.name), table.header.push_back("… RMS");
  Json json = Json::array();
  const auto& bounds = line.what.parts_mm;
  for (std::size_t part = 0; part + 1 < bounds.size(); ++part) {
    std::vector<std::size_t> here;
    for (std::size_t i = 0; i < line.rows.size(); ++i) {
      const double place = line.rows.place_mm[i];
      if (place >= bounds[part] && place < bounds[part + 1] && !(place == 0.0 && line.what.edges_mm.size() > 2) &&
          std::isfinite(line.rows.measured_mm[i] + line.as_is[i]))
        here.push_back(i);
    }
    if (here.empty()) continue;
    const auto of = [&](const std::vector<double>& values) {
      std::vector<double> some;
      for (const std::size_t i : here) some.push_back(values[i]);
      return some;
    };
    const auto left = [&](const std::vector<double>& prediction) {
      std::vector<double> some;
      for (const std::size_t i : here) some.push_back(line.rows.measured_mm[i] - prediction[i]);
      return summarise(some);
    };
    const std::vector<double> measured = of(line.rows.measured_mm);
    const Summary m = summarise(measured), s = summarise(of(line.as_is)), d = left(line.as_is);
    table.rows.push_back({placesInWords(bounds[part], bounds[part + 1]),
                          std::to_string(m.n), compare::shownWithError(m.mean, compare::blockedError(measured)), shown(s.mean),
                          shown(d.mean), shown(d.rms),
                          line.fit.prediction.empty() ? "–" : shown(summarise(of(line.fit.prediction)).mean)});
    for (const Prediction& other : line.others)
      table.rows.back().push_back(shown(left(other.mm).mean)), table.rows.back().push_back(shown(left(other.mm).rms));
    Json row = Json::object();
    json.push(row.set("from_mm", bounds[part]).set("n", m.n).set("measured_mm", m.mean).set("simulated_mm", s.mean));
  }
  data.set("parts", json);
  return table;
}

/// Means of the runs before plates at several depths.
TableBlock runTable(const Case& line, Plot& plot) {
  TableBlock table{"Mean of a run, mm", {"run", "half", "plate at [mm]", "of the row", "measured", "fitted"}, {}};
  Curve measured{.name = "measured, mean of a run", .ink = Ink::Measured},
      fitted{.name = "simulated, fitted", .ink = Ink::Simulated, .stroke = Stroke::Dashed};
  for (std::size_t run = 0; run < line.rows.plates.size(); ++run) {
    std::vector<double> m, s;
    for (std::size_t i = 0; i < line.rows.size(); ++i)
      if (line.blocks[i] == static_cast<int>(run)) m.push_back(line.rows.measured_mm[i]), s.push_back(line.fit.prediction[i]);
    const PlateRun& plate = line.rows.plates[run];
    measured.x.push_back(plate.plate_mm), measured.y.push_back(summarise(m).mean);
    fitted.x.push_back(plate.plate_mm), fitted.y.push_back(summarise(s).mean);
    table.rows.push_back({line.what.files[run], isFitted(static_cast<int>(run)) ? "fitted" : "judged", shown(plate.plate_mm, 0),
                          shownPercent(plate.covered), shown(measured.y.back()), shown(fitted.y.back())});
  }
  plot.curves = {measured, fitted};
  plot.below = compare::measuredLess(measured.x, measured.y, fitted.y);
  plot.x_label = "plate's depth [mm]";
  return table;
}

Plot plotOf(const Case& line, const std::string& title) {
  const std::vector<double>& x = line.what.edges_mm.empty() ? line.rows.t : line.rows.place_mm;
  const std::vector<double>& best = line.fit.prediction.empty() ? line.as_is : line.fit.prediction;
  Plot plot{.title = title,
            .x_label = line.what.edges_mm.empty() ? "direction x/z" : "place from the edge [mm]",
            .y_label = line.what.quantity == Line::Quantity::Error ? "measured − reference [mm]" : "change by the object [mm]",
            .curves = {{.name = "measured", .x = x, .y = line.rows.measured_mm, .ink = Ink::Measured},
                       {.name = "simulated, preset", .x = x, .y = line.as_is, .ink = Ink::Simulated}},
            .zero_line = true,
            .below = compare::measuredLess(x, line.rows.measured_mm, best)};
  if (!line.fit.prediction.empty())
    plot.curves.push_back({.name = "simulated, fitted", .x = x, .y = best, .ink = Ink::Simulated, .stroke = Stroke::Dashed});
  for (const Prediction& other : line.others)
    if (line.others.size() < 4) plot.curves.push_back({.name = other.name, .x = x, .y = other.mm, .ink = other.ink});
  const auto& show = line.what.show_mm;
  if (show.size() >= 2) plot.x_range = std::pair{show[0], show[1]};
  if (show.size() >= 4) plot.y_range = std::pair{show[2], show[3]};
  return plot;
}

void addSection(const Case& line, const Task& task, const LineCase& as_is, Judged& judged) {
  compare::Section& section = judged.finding.section;
  const Explained none = explained(line, line.nothing), raw = explained(line, line.as_is);
  TableBlock table{"What is left of the measured values", kExplainedHeader,
                   {explainedRow("no simulation (the reference itself)", none), explainedRow("simulated, preset", raw)}};
  const Summary m = summarise(inBlocks(line.rows.measured_mm, line.blocks));
  section.verdict = fmt::format("Measured: {} to {} mm (median {} mm). Simulated as is, {} mm RMS of the {} mm remain ({} of the "
                                "mean square explained). Shape alone: {} of {} mm spread remain.",
                                shown(m.min, 0), shown(m.max, 0), shown(m.median, 0), shown(raw.residual_rms),
                                shown(raw.measured_rms), shownPercent(raw.fraction_raw), shown(raw.residual_sd), shown(raw.measured_sd));
  section.tone = toneOf(raw.fraction_raw);
  judged.finding.headline = fmt::format("{}: {} mm RMS, {} mm left as is", line.data, shown(none.residual_rms), shown(raw.residual_rms));
  judged.finding.data.set("no_simulation", toJson(none)).set("simulated", toJson(raw));
  const auto known = task.constant_mm.find(line.what.camera);
  if (line.what.with_constant && known != task.constant_mm.end()) {
    const Explained moved = explained(line, plus(line.as_is, known->second));
    table.rows.push_back(explainedRow(fmt::format("simulated + {} mm, the constant of the camera's distances", shown(known->second)), moved));
    section.tone = toneOf(moved.fraction_raw);
    section.verdict += fmt::format(" With the constant that the camera's distances gave, {} mm RMS remain ({}).",
                                   shown(moved.residual_rms), shownPercent(moved.fraction_raw));
    judged.finding.data.set("simulated_with_constant", toJson(moved));
    judged.finding.headline += fmt::format(", {} mm with the constant of its distances", shown(moved.residual_rms));
  }
  for (const Prediction& other : line.others) table.rows.push_back(explainedRow(other.name, explained(line, other.mm)));
  Plot plot = plotOf(line, section.title);
  std::vector<compare::Block> blocks;
  if (!line.rows.plates.empty() && !line.fit.prediction.empty()) blocks.push_back(runTable(line, plot));
  section.blocks.push_back(Figure{"Along the row. Below: what is left of the measured values.", toSvg(plot)});
  section.blocks.push_back(table);
  section.blocks.insert(section.blocks.end(), blocks.begin(), blocks.end());
  if (line.what.parts_mm.size() > 1) section.blocks.push_back(partTable(line, judged.finding.data));
  if (as_is.error_mm > 0.0) {
    section.blocks.push_back(compare::Paragraph{
        fmt::format("Monte-Carlo and sensor noise of the simulated line: {} mm (median standard error).", shown(as_is.error_mm, 2)), true});
    judged.finding.data.set("monte_carlo_mm", as_is.error_mm);
  }
}

/// Places and ranges on the scene's own surfaces, which have no noise as a measured reference has.
void placeOnScene(const Line& what, const LineCase& as_is, LineRows& rows) {
  if (what.scene.empty()) return;
  const TracedLine& traced = as_is.without.empty() ? as_is.with.front() : as_is.without.front();
  const std::vector<EdgePoint> edges = edgePoints(what.edges_mm);
  rows.on_reference_mm = rangesAlong({traced.t, traced.truth_mm}, rows.t);
  for (std::size_t i = 0; i < rows.size(); ++i) rows.place_mm[i] = placeOf(edges, rows.t[i], rows.on_reference_mm[i]);
}

bool hasRole(const Line& what, FreeNumber::Role role) {
  return std::ranges::find(what.numbers, role, &FreeNumber::role) != what.numbers.end();
}

Result<> checkLine(const Line& what) {
  const auto wrong = [&](const std::string& why) { return Error{Error::Code::InvalidArgument, fmt::format("{}: {}", what.title, why)}; };
  if (what.files.empty()) return wrong("files is missing");
  if (what.within_mm.size() != 2 || what.rays_t.size() != 2) return wrong("within_mm and rays_t have two bounds each");
  if (what.scene.empty() && (!what.reference.empty() || what.quantity == Line::Quantity::Error))
    return wrong("without a scene file the change by a plate before a background is judged: quantity = \"change\", and no reference");
  if (!what.scene.empty() && what.reference.empty()) return wrong("a scene file needs a reference line");
  if (!what.scene.empty() && what.quantity == Line::Quantity::Change && what.scene_without.empty())
    return wrong("a change needs scene_without, too");
  if (what.scene.empty() && (hasRole(what, FreeNumber::Role::Albedo) || hasRole(what, FreeNumber::Role::Emitter)))
    return wrong("an albedo or an emitter's place is fitted before a scene file");
  return {};
}

}  // namespace

Result<Judged> judge(const Line& what, const EffectGroup& fitted, const Subject& camera, Task& task) {
  if (auto checked = checkLine(what); !checked) return checked.error();
  auto rows = readRows(what, task, pixelRays(camera.model));
  if (!rows) return rows.error();
  LineSimulation simulation{what, fitted, camera, task, *rows};
  const auto as_is = simulation.trace(what.surfaces);
  if (!as_is) return as_is.error();
  task.at(0.3);
  placeOnScene(what, *as_is, *rows);
  Case line{.what = what, .fitted = fitted, .data = dataOf(what, camera), .rows = *rows, .blocks = {},
            .nothing = std::vector<double>(rows->size(), 0.0), .as_is = as_is->rows_mm, .others = {}};
  for (const Other& other : what.others) {
    auto theirs = otherAt(other, what, task, *rows);
    if (!theirs) return theirs.error();
    line.others.push_back({other.name, *std::move(theirs), Ink::Published});
  }
  line.blocks = blocksOf(what, line.rows, line.as_is, line.others);
  for (const Variant& variant : what.variants) {
    auto one = simulation.trace(what.surfaces, {}, &variant);
    if (!one) return one.error();
    line.others.push_back({variant.name, std::move(one->rows_mm)});
  }
  Judged judged = begun(what, camera);
  if (fitted.numbers.empty()) {
    addSection(line, task, *as_is, judged);
    addNotes(what, judged);
    return judged;
  }
  if (auto done = simulation.traceAlbedos(); !done) return done.error();
  const bool has_albedo = hasRole(what, FreeNumber::Role::Albedo);
  const auto direct = has_albedo ? simulation.trace(1) : Result<LineCase>{LineCase{}};
  if (!direct) return direct.error();
  const PredictNumbers predict = simulation.predictor(*as_is), predict_direct = simulation.predictor(has_albedo ? *direct : *as_is);
  line.fit = fitNumbers(line.rows.measured_mm, fitted.numbers, std::vector<bool>(fitted.numbers.size(), true), predict, line.blocks);
  if (line.fit.judged_n == 0 || line.fit.fitted_n == 0)
    return Error{Error::Code::InvalidArgument, fmt::format("{}: no row to fit or to judge; see within_mm and block_rays", line.data)};
  addSection(line, task, *as_is, judged);
  judged.finding.section.blocks.push_back(fitTable(line, predict, judged.finding.data));
  judged.finding.section.blocks.push_back(compare::Paragraph{"± is a jackknife over the fitted blocks.", true});
  addOutcome(line, predict, predict_direct, judged);
  addNotes(what, judged);
  judged.finding.cards.push_back({line.data, shown(line.fit.judged_rms) + " mm",
                                  fmt::format("RMS left of {} mm on the half that nothing was fitted to",
                                              shown(judgedRms(line.rows.measured_mm, line.nothing, line.blocks))),
                                  toneOf(1.0 - std::pow(line.fit.judged_rms / judgedRms(line.rows.measured_mm, line.nothing, line.blocks), 2))});
  return judged;
}

}  // namespace toftwin::validate
