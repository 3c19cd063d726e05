// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/residual.h"
#include "tools/validate/candidates.h"
#include "tools/validate/free_numbers.h"
#include "tools/validate/walls.h"

namespace toftwin::validate {

using compare::Curve;
using compare::Explained;
using compare::Figure;
using compare::Ink;
using compare::NamedTraits;
using compare::Paragraph;
using compare::Plot;
using compare::shown;
using compare::shownPercent;
using compare::Stroke;
using compare::summarise;
using compare::Summary;
using compare::TableBlock;

namespace {

struct ErrorTable {
  std::vector<double> reference_mm, error_mm;  ///< error: measured − reference
};

/// Rows that are judged, and those of another session, whose errors are below the least.
Result<std::pair<ErrorTable, ErrorTable>> sessions(const Distances& what, const Task& task) {
  const bool has_error = !what.error.empty();
  const auto columns = columnsOf(task, what.file, {what.reference, has_error ? what.error : what.measured});
  if (!columns) return columns.error();
  const auto& [reference, value] = std::tie((*columns)[0], (*columns)[1]);
  std::pair<ErrorTable, ErrorTable> result;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const double error = has_error ? what.sign * value[i] : value[i] - reference[i];
    ErrorTable& table = error < what.least_error_mm ? result.second : result.first;
    table.reference_mm.push_back(reference[i]);
    table.error_mm.push_back(error);
  }
  if (result.first.error_mm.size() < 20)
    return Error{Error::Code::InvalidArgument, fmt::format("{}: fewer than 20 rows to judge", what.file)};
  return result;
}

/// Waves, scale and residual, measured and simulated, at the frequencies that the camera is known to have.
NamedTraits wavesOf(const Subject& camera, const ErrorTable& measured, const std::vector<WallReading>& readings) {
  std::vector<double> frequency_hz;
  for (const Frequency f : camera.model.traceRequest().frequencies) frequency_hz.push_back(f.in(hertz));
  ErrorTable simulated;
  for (const WallReading& r : readings)
    simulated.reference_mm.push_back(r.truth_mm), simulated.error_mm.push_back(r.range_mm - r.truth_mm);
  const auto fitOf = [&](const ErrorTable& table) -> compare::HarmonicFit {
    return [&](std::size_t least) {
      std::vector<double> distance = table.reference_mm;
      for (double& d : distance) d *= 1e-3;
      return compare::fittedHarmonics(distance, table.error_mm, frequency_hz, {}, least);
    };
  };
  const auto [of_a, of_b] = compare::withTheSameWaves({fitOf(measured), fitOf(simulated)});
  compare::TraitCollector all;
  all.add("harmonics", "A", of_a), all.add("harmonics", "B", of_b);
  return std::move(all).found();
}

TableBlock binTable(const Distances& what, const ErrorTable& table, const std::vector<double>& simulated) {
  TableBlock bins{"By distance. ± is one standard error of the mean, by blocks of rows at neighbouring distances",
                  {"distance", "n", "measured [mm]", "simulated [mm]", "difference [mm]"},
                  {}};
  const auto [nearest, farthest] = std::ranges::minmax(table.reference_mm);
  for (double from = what.bin_mm * std::floor(nearest / what.bin_mm); from <= farthest; from += what.bin_mm) {
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < table.reference_mm.size(); ++i) {
      if (table.reference_mm[i] >= from && table.reference_mm[i] < from + what.bin_mm) rows.push_back(i);
    }
    if (rows.size() < 10) continue;
    // Rows at nearly one distance err alike, so they must be neighbours in the blocks of the error.
    std::stable_sort(rows.begin(), rows.end(),
                     [&](std::size_t a, std::size_t b) { return table.reference_mm[a] < table.reference_mm[b]; });
    std::vector<double> measured, predicted;
    for (const std::size_t i : rows) measured.push_back(table.error_mm[i]), predicted.push_back(simulated[i]);
    const Summary m = summarise(measured), p = summarise(predicted);
    bins.rows.push_back({fmt::format("{:.0f}–{:.0f} mm", from, from + what.bin_mm), std::to_string(m.n),
                         compare::shownWithError(m.mean, compare::blockedError(measured)), shown(p.mean),
                         shown(m.mean - p.mean)});
  }
  return bins;
}

Figure figureOf(const Subject& camera, const ErrorTable& table, const ErrorTable& other,
                const std::vector<WallReading>& readings, const std::vector<double>& simulated, double constant_mm) {
  Curve raw{.name = "simulated, preset", .ink = Ink::Simulated},
      moved{.name = fmt::format("simulated {} {} mm", constant_mm < 0 ? "−" : "+", shown(std::abs(constant_mm))),
            .ink = Ink::Simulated,
            .stroke = Stroke::Dashed};
  for (const WallReading& r : readings) {
    raw.x.push_back(r.truth_mm), raw.y.push_back(r.range_mm - r.truth_mm);
    moved.x.push_back(r.truth_mm), moved.y.push_back(r.range_mm - r.truth_mm + constant_mm);
  }
  Plot plot{.title = camera.title + " distance error",
            .x_label = "reference distance [mm]",
            .y_label = "measured − reference [mm]",
            .curves = {{.name = "measured", .x = table.reference_mm, .y = table.error_mm, .ink = Ink::Measured,
                        .stroke = Stroke::Dots}},
            .zero_line = true,
            .below = compare::measuredLess(table.reference_mm, table.error_mm, plus(simulated, constant_mm))};
  if (!other.error_mm.empty()) {
    plot.curves.push_back({.name = "measured, another session (not judged)", .x = other.reference_mm, .y = other.error_mm,
                           .ink = Ink::Baseline, .stroke = Stroke::Dots});
  }
  plot.curves.push_back(raw);
  plot.curves.push_back(moved);
  return {"Error over distance; positive: reads too far. Below: measured less simulated, moved by the constant.", toSvg(plot)};
}

}  // namespace

Result<Judged> judge(const Distances& what, const EffectGroup&, const Subject& camera, Task& task) {
  auto both = sessions(what, task);
  if (!both) return both.error();
  const auto& [table, other] = *both;
  const auto [nearest, farthest] = std::ranges::minmax(table.reference_mm);
  std::vector<double> distances;
  for (double d = nearest - 10.0; d < farthest + 20.0; d += what.step_mm) distances.push_back(d);
  const auto seed = static_cast<std::uint64_t>(what.seed);
  const auto walls = traceWalls(camera.model, what.albedo, distances, seed);
  if (!walls) return walls.error();
  const auto readings = readWalls(camera.model, *walls, what.frames, seed, [&](double share) { task.at(share); });
  std::vector<double> range_mm;
  for (const WallReading& r : readings) range_mm.push_back(r.range_mm);
  const std::vector<double> simulated = errorsAt(table.reference_mm, walls->truth_mm, range_mm);
  const Explained none = compare::explain(table.error_mm, std::vector<double>(table.error_mm.size(), 0.0)),
                  as_is = compare::explain(table.error_mm, simulated);
  task.constant_mm[camera.name] = as_is.best_offset;

  Judged judged = begun(what, camera);
  compare::Section& section = judged.finding.section;
  section.verdict = fmt::format(
      "The camera reads {} mm too far on average; {} mm of that is a constant that the preset does "
      "not have. Beyond the constant, the measured error varies by {} mm; the simulator leaves {} "
      "mm of that ({} of the variance explained).",
      shown(summarise(table.error_mm).mean), shown(as_is.best_offset), shown(none.residual_sd), shown(as_is.residual_sd),
      shownPercent(as_is.fraction_centred));
  section.tone = toneOf(as_is.fraction_centred);
  section.blocks = {figureOf(camera, table, other, readings, simulated, as_is.best_offset),
                    TableBlock{"What is left of the measured error",
                               kExplainedHeader,
                               {explainedRow("no simulation (the reference itself)", none),
                                explainedRow("simulated, preset", as_is)}},
                    binTable(what, table, simulated),
                    Paragraph{fmt::format("Assumed: target square to the axis, Lambertian, albedo {}, no ambient light, warm "
                                          "camera. The constant, {} mm, was fitted to this table.{}",
                                          what.albedo, shown(as_is.best_offset),
                                          other.error_mm.empty()
                                              ? ""
                                              : fmt::format(" {} rows of another session are shown but not judged.",
                                                            other.error_mm.size())),
                              true}};
  judged.finding.data.set("no_simulation", toJson(none))
      .set("simulated", toJson(as_is))
      .set("rows_of_another_session", other.error_mm.size())
      .set("constant_mm", as_is.best_offset);
  std::vector<EffectGroup> candidates;
  if (!what.candidates.empty()) {
    auto read = loadCandidates(task.set.file.parent_path() / what.candidates);
    if (!read) return read.error();
    candidates = *std::move(read);
  }
  addCandidates(dataOf(what, camera),
                {.at_mm = table.reference_mm,
                 .error_mm = table.error_mm,
                 .block_mm = what.block_mm,
                 .camera = withoutNoise(camera.model),
                 .simulate = [&](const sim::SensorModel& model) {
                   return errorsAt(table.reference_mm, walls->truth_mm, readRanges(model, *walls));
                 }},
                candidates, static_cast<std::size_t>(what.at_most), judged);
  addCharacteristics(wavesOf(camera, table, readings), judged);
  addNotes(what, judged);
  judged.finding.headline = fmt::format("{} distance error: {} mm spread, {} mm left", camera.title, shown(none.residual_sd),
                                        shown(as_is.residual_sd));
  judged.finding.cards.push_back(
      {camera.title + " distance", shown(as_is.residual_sd) + " mm",
       fmt::format("spread left, of {} mm; constant {} mm", shown(none.residual_sd), shown(as_is.best_offset)), section.tone});
  return judged;
}

}  // namespace toftwin::validate
