// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/compare/real_data.h"
#include "calib/compare/real_fits.h"
#include "calib/compare/residual.h"
#include "calib/compare/simulated_line.h"
#include "calib/compare/simulated_wall.h"
#include "calib/table/table.h"

namespace toftwin::compare {
namespace {

struct ErrorTable {
  std::vector<double> reference_mm, error_mm;  ///< error: measured − reference, our sign
};

/// Rows of the main session, and the rows of the other one that the author superposed (the O3D303's
/// second branch reads too near; no row of its main branch does).
std::pair<ErrorTable, ErrorTable> sessions(const std::vector<std::vector<double>>& columns,
                                           bool two_sessions) {
  std::pair<ErrorTable, ErrorTable> result;
  for (std::size_t i = 0; i < columns[0].size(); ++i) {
    const double error = -columns[1][i];
    ErrorTable& table = two_sessions && error < 0.0 ? result.second : result.first;
    table.reference_mm.push_back(columns[0][i]);
    table.error_mm.push_back(error);
  }
  return result;
}

/// Waves, scale and residual, measured and simulated, at the frequencies that the camera is known to have.
NamedTraits wavesOf(const RealCamera& camera, const ErrorTable& measured,
                    const std::vector<WallReading>& readings) {
  const std::vector<double> frequency_hz = frequenciesOf(camera.name);
  ErrorTable simulated;
  for (const WallReading& r : readings)
    simulated.reference_mm.push_back(r.truth_mm), simulated.error_mm.push_back(r.range_mm - r.truth_mm);
  const auto fitOf = [&](const ErrorTable& table) -> HarmonicFit {
    return [&](std::size_t least) {
      std::vector<double> distance = table.reference_mm;
      for (double& d : distance) d *= 1e-3;
      return fittedHarmonics(distance, table.error_mm, frequency_hz, {}, least);
    };
  };
  const auto [of_a, of_b] = withTheSameWaves({fitOf(measured), fitOf(simulated)});
  TraitCollector all;
  all.add("harmonics", "A", of_a), all.add("harmonics", "B", of_b);
  return std::move(all).found();
}

std::vector<double> shifted(std::vector<double> values, double by) {
  for (double& one : values) one += by;
  return values;
}

std::vector<std::vector<std::string>> bins(const ErrorTable& table,
                                           const std::vector<double>& simulated) {
  std::vector<std::vector<std::string>> rows;
  for (double from = 500.0; from < 4000.0; from += 250.0) {
    std::vector<std::size_t> rows_of_bin;
    for (std::size_t i = 0; i < table.reference_mm.size(); ++i) {
      if (table.reference_mm[i] >= from && table.reference_mm[i] < from + 250.0)
        rows_of_bin.push_back(i);
    }
    if (rows_of_bin.size() < 10) continue;
    // Rows at nearly one distance err alike, so they must be neighbours in the blocks of the error.
    std::stable_sort(rows_of_bin.begin(), rows_of_bin.end(), [&](std::size_t a, std::size_t b) {
      return table.reference_mm[a] < table.reference_mm[b];
    });
    std::vector<double> measured, predicted;
    for (const std::size_t i : rows_of_bin)
      measured.push_back(table.error_mm[i]), predicted.push_back(simulated[i]);
    const Summary m = summarise(measured), p = summarise(predicted);
    rows.push_back({fmt::format("{:.0f}–{:.0f} mm", from, from + 250.0), std::to_string(m.n),
                    shownWithError(m.mean, blockedError(measured)), shown(p.mean),
                    shown(m.mean - p.mean)});
  }
  return rows;
}

}  // namespace

Result<Finding> judgeDistance(const RealDataJob& job, RealCamera& camera) {
  const auto columns = table::readNumbers(job.folder / "distance_error" / (camera.name + ".csv"),
                                   {"reference_mm", "reference_minus_measured_mm"});
  if (!columns) return columns.error();
  const auto [table, other] = sessions(*columns, camera.name == "o3d303");
  const auto model = sim::SensorModel::preset(camera.name);
  if (!model) return model.error();
  const auto [nearest, farthest] =
      std::minmax_element(table.reference_mm.begin(), table.reference_mm.end());
  std::vector<double> distances;
  for (double d = *nearest - 10.0; d < *farthest + 20.0; d += 15.0) distances.push_back(d);
  const auto walls = traceWalls(*model, 0.8, distances, 31);
  if (!walls) return walls.error();
  const auto readings = readWalls(*model, *walls, 200, 31, [&](double share) {
    if (job.progress != nullptr) job.progress->at(share);
  });
  std::vector<double> range_mm;
  for (const WallReading& r : readings) range_mm.push_back(r.range_mm);
  const std::vector<double> simulated = errorsAt(table.reference_mm, walls->truth_mm, range_mm);
  const std::vector<double> nothing(table.error_mm.size(), 0.0);
  const Explained none = explain(table.error_mm, nothing), sim = explain(table.error_mm, simulated);
  camera.delay_mm = sim.best_offset;

  Curve raw{.name = "simulated, preset", .ink = Ink::Simulated},
      moved{.name = fmt::format("simulated {} {} mm", sim.best_offset < 0 ? "−" : "+",
                                shown(std::abs(sim.best_offset))),
            .ink = Ink::Simulated,
            .stroke = Stroke::Dashed};
  for (const WallReading& r : readings) {
    raw.x.push_back(r.truth_mm), raw.y.push_back(r.range_mm - r.truth_mm);
    moved.x.push_back(r.truth_mm), moved.y.push_back(r.range_mm - r.truth_mm + sim.best_offset);
  }
  Plot plot{.title = camera.title + " distance error",
            .x_label = "reference distance [mm]",
            .y_label = "measured − reference [mm]",
            .curves = {{.name = "measured",
                        .x = table.reference_mm,
                        .y = table.error_mm,
                        .ink = Ink::Measured,
                        .stroke = Stroke::Dots}},
            .zero_line = true,
            .below = measuredLess(table.reference_mm, table.error_mm, shifted(simulated, sim.best_offset))};
  if (!other.error_mm.empty()) {
    plot.curves.push_back({.name = "measured, another session (not judged)",
                           .x = other.reference_mm,
                           .y = other.error_mm,
                           .ink = Ink::Baseline,
                           .stroke = Stroke::Dots});
  }
  plot.curves.push_back(raw);
  plot.curves.push_back(moved);

  Finding finding;
  finding.section = {.id = "distance-" + camera.name, .title = camera.title + ": distance error"};
  finding.section.verdict = fmt::format(
      "The camera reads {} mm too far on average; {} mm of that is a constant that the preset does "
      "not have. Beyond the constant, the measured error varies by {} mm; the simulator leaves {} "
      "mm of that ({} of the variance explained).",
      shown(summarise(table.error_mm).mean), shown(sim.best_offset), shown(none.residual_sd),
      shown(sim.residual_sd), shownPercent(sim.fraction_centred));
  finding.section.tone = toneOf(sim.fraction_centred);
  finding.section.blocks = {
      Figure{"Flat target moved away slowly; positive: reads too far. The reference comes from "
             "printed markers whose own noise grows with distance. Below: measured less simulated, moved by "
             "the constant.",
             toSvg(plot)},
      TableBlock{"What is left of the measured error",
                 kExplainedHeader,
                 {explainedRow("no simulation (the reference itself)", none),
                  explainedRow("simulated, preset", sim)}},
      TableBlock{"By distance. ± is one standard error of the mean, by blocks of rows at neighbouring "
                 "distances",
                 {"distance", "n", "measured [mm]", "simulated [mm]", "difference [mm]"},
                 bins(table, simulated)},
      Paragraph{fmt::format("Assumed: target square to the axis, Lambertian, albedo 0.8, no ambient light, "
                            "warm camera. The constant, {} mm, was fitted to this table; "
                            "it is used below on the corner, which did not help to fit it.{}",
                            shown(sim.best_offset),
                            other.error_mm.empty() ? ""
                                                   : fmt::format(" {} rows of another session, which read "
                                                                 "too near, are shown but not judged.",
                                                                 other.error_mm.size())),
                true}};
  finding.data.set("no_simulation", toJson(none))
      .set("simulated", toJson(sim))
      .set("rows_of_another_session", other.error_mm.size())
      .set("constant_mm", sim.best_offset);
  addDistanceFit(camera, withoutNoise(*model), *walls, table.reference_mm, table.error_mm, finding);
  addCharacteristics(wavesOf(camera, table, readings), finding);
  finding.headline = fmt::format("{} distance error: {} mm spread, {} mm left", camera.title,
                                 shown(none.residual_sd), shown(sim.residual_sd));
  finding.cards.push_back({camera.title + " distance", shown(sim.residual_sd) + " mm",
                           fmt::format("spread left, of {} mm; constant {} mm",
                                       shown(none.residual_sd), shown(sim.best_offset)),
                           finding.section.tone});
  return finding;
}

}  // namespace toftwin::compare
