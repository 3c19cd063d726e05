// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/compare/real_data.h"
#include "calib/compare/real_fits.h"
#include "calib/compare/residual.h"
#include "calib/compare/scan_line.h"
#include "calib/compare/simulated_line.h"

namespace toftwin::compare {
namespace {

constexpr double kAlbedo = 0.8, kHeight_mm = 1000.0;

/// Signed place on the walls: distance from the edge in mm, negative on the left wall.
double fromEdge(const CornerFit& corner, double t, double range_mm) {
  const double z = range_mm / std::sqrt(1.0 + t * t);
  const double along = std::hypot(t * z - corner.edge_x_mm, z - corner.edge_z_mm);
  return t < corner.edge_t() ? -along : along;
}

/// The point of a wall that the ray t meets.
std::pair<double, double> meets(const PlanarLine& wall, double t) {
  const double z = wall.rangeAlong(t) / std::sqrt(1.0 + t * t);
  return {t * z, z};
}

/// Two upright boards along the fitted lines, as far as the camera's measured line reaches.
Result<sim::Scene> cornerScene(const CornerFit& corner, double t_left, double t_right,
                               double albedo) {
  const auto [lx, lz] = meets(corner.left, t_left);
  const auto [rx, rz] = meets(corner.right, t_right);
  return sim::Scene::parse(
      materialToml("board", albedo) +
          wallToml({lx, lz, corner.edge_x_mm, corner.edge_z_mm, kHeight_mm, "board"}) +
          wallToml({corner.edge_x_mm, corner.edge_z_mm, rx, rz, kHeight_mm, "board"}),
      "corner.toml");
}

struct Rows {
  std::vector<double> t, place_mm, measured_mm, simulated_mm,
      plane_mm;  ///< errors against the reference
};

std::vector<std::vector<std::string>> regionRows(const Rows& rows, double delay_mm, Json& json) {
  struct Part {
    const char* name;
    double from, to;
  };
  constexpr Part kParts[] = {{"left wall, over 300 mm from the edge", -1e9, -300},
                             {"left wall, 100–300 mm", -300, -100},
                             {"left wall, 30–100 mm", -100, -30},
                             {"edge, within 30 mm", -30, 30},
                             {"right wall, 30–100 mm", 30, 100},
                             {"right wall, 100–300 mm", 100, 300},
                             {"right wall, over 300 mm", 300, 1e9}};
  std::vector<std::vector<std::string>> table;
  json = Json::array();
  for (const Part& part : kParts) {
    std::vector<double> measured, simulated, left;
    for (std::size_t i = 0; i < rows.t.size(); ++i) {
      if (rows.place_mm[i] < part.from || rows.place_mm[i] >= part.to ||
          !std::isfinite(rows.measured_mm[i] + rows.simulated_mm[i]))
        continue;
      measured.push_back(rows.measured_mm[i]);
      simulated.push_back(rows.simulated_mm[i]);
      left.push_back(rows.measured_mm[i] - rows.simulated_mm[i] - delay_mm);
    }
    if (measured.empty()) continue;
    const Summary m = summarise(measured), s = summarise(simulated), d = summarise(left);
    table.push_back({part.name, std::to_string(m.n), shown(m.mean), shown(s.mean),
                     shown(m.mean - s.mean), shown(d.mean), shown(d.rms)});
    Json row = Json::object();
    row.set("region", part.name)
        .set("n", m.n)
        .set("measured_mm", m.mean)
        .set("simulated_mm", s.mean);
    row.set("left_after_constant_mm", d.mean).set("left_after_constant_rms_mm", d.rms);
    json.push(std::move(row));
  }
  return table;
}

std::vector<double> plus(std::vector<double> values, double constant) {
  for (double& v : values) v += constant;
  return values;
}

}  // namespace

Result<Finding> judgeCorner(const RealDataJob& job, const RealCamera& camera) {
  const auto measured = loadScanLine(job.folder / "corner" / (camera.name + "_measured.csv"));
  if (!measured) return measured.error();
  const auto reference = loadScanLine(job.folder / "corner" / (camera.name + "_reference.csv"));
  if (!reference) return reference.error();
  const auto corner = fitCorner(*reference);
  if (!corner) return corner.error();
  const auto published = publishedCorner(job.folder);
  if (!published) return published.error();
  const auto model = sim::SensorModel::preset(camera.name);
  if (!model) return model.error();
  const auto t_left = std::min(measured->t.front(), reference->t.front()),
             t_right = std::max(measured->t.back(), reference->t.back());
  const auto scene = cornerScene(*corner, t_left, t_right, kAlbedo);
  if (!scene) return scene.error();
  LineEffort effort{.batches = 4,
                    .samples_per_batch = std::max(32, static_cast<int>(2048 * job.effort)),
                    .frames = 64,
                    .seed = 41};
  const auto simulated = simulateLine(*model, *scene, effort, [&](double share) {
    if (job.progress != nullptr) job.progress->at(0.4 * share);
  });
  if (!simulated) return simulated.error();
  const std::vector<double> albedos{0.3, 0.6, 0.8, 1.0};
  std::vector<ScanLine> by_albedo;
  for (const double albedo : albedos) {
    const auto other = cornerScene(*corner, t_left, t_right, albedo);
    if (!other) return other.error();
    effort.batches = 2;
    const auto line = simulateLine(*model, *other, effort);
    if (!line) return line.error();
    by_albedo.push_back(line->line);
    if (job.progress != nullptr)
      job.progress->at(0.4 + 0.13 * static_cast<double>(by_albedo.size()));
  }
  effort.max_surfaces = 1;
  const auto direct = simulateLine(*model, *scene, effort);
  if (!direct) return direct.error();

  // The simulator sees ideal planes, the reference line has its own noise: each error is against
  // its own truth.
  Rows rows;
  for (std::size_t i = 0; i < reference->size(); ++i) {
    const double t = reference->t[i], truth = corner->rangeAlong(t);
    rows.t.push_back(t);
    rows.place_mm.push_back(fromEdge(*corner, t, truth));
    rows.measured_mm.push_back(rangeAlong(*measured, t) - reference->range_mm[i]);
    rows.simulated_mm.push_back(rangeAlong(simulated->line, t) - truth);
    rows.plane_mm.push_back(truth - reference->range_mm[i]);
  }
  std::vector<double> nothing;  // over the same rays as the simulation
  for (const double simulated_mm : rows.simulated_mm) nothing.push_back(0.0 * simulated_mm);
  const Explained none = explain(rows.measured_mm, nothing),
                  raw = explain(rows.measured_mm, rows.simulated_mm);
  const Explained delayed = explain(rows.measured_mm, plus(rows.simulated_mm, camera.delay_mm));

  const Plot plot{
      .title = camera.title + " corner error",
      .x_label = "distance from the edge along the boards [mm], left board negative",
      .y_label = "range − reference [mm]",
      .curves =
          {{.name = "measured", .x = rows.place_mm, .y = rows.measured_mm, .ink = Ink::Measured},
           {.name = "simulated, preset", .x = rows.place_mm, .y = rows.simulated_mm, .ink = Ink::Simulated},
           {.name =
                fmt::format("simulated + {} mm (constant from the distance table)", shown(camera.delay_mm)),
            .x = rows.place_mm,
            .y = plus(rows.simulated_mm, camera.delay_mm),
            .ink = Ink::Simulated,
            .stroke = Stroke::Dashed},
           {.name = "fitted planes − reference",
            .x = rows.place_mm,
            .y = rows.plane_mm,
            .ink = Ink::Baseline,
            .stroke = Stroke::Dotted}},
      .zero_line = true,
      .below = measuredLess(rows.place_mm, rows.measured_mm, plus(rows.simulated_mm, camera.delay_mm))};
  CornerLines lines{.t = rows.t,
                    .truth_mm = {},
                    .measured_mm = rows.measured_mm,
                    .as_is_mm = rows.simulated_mm,
                    .direct_mm = {},
                    .albedo = albedos,
                    .simulated_mm = {}};
  const auto emitters = model->traceRequest().emitters;
  for (const sim::EmitterSpec& emitter : emitters)
    lines.emitter_x_mm += 1e3 * emitter.position_m.x / static_cast<double>(emitters.size());
  for (const double t : rows.t) {
    lines.truth_mm.push_back(corner->rangeAlong(t));
    lines.direct_mm.push_back(rangeAlong(direct->line, t) - lines.truth_mm.back());
  }
  for (const ScanLine& line : by_albedo) {
    lines.simulated_mm.emplace_back();
    for (std::size_t i = 0; i < rows.t.size(); ++i)
      lines.simulated_mm.back().push_back(rangeAlong(line, rows.t[i]) - lines.truth_mm[i]);
  }
  const auto above = [](const ScanLine& line, std::string name, Ink ink, Stroke stroke) {
    Curve curve{.name = std::move(name), .ink = ink, .stroke = stroke};
    for (std::size_t i = 0; i < line.size(); ++i)
      curve.x.push_back(line.x_mm(i)), curve.y.push_back(line.z_mm(i));
    return curve;
  };
  const Plot plan{.title = camera.title + " corner from above",
                  .x_label = "x [mm]",
                  .y_label = "z [mm]",
                  .curves = {above(*reference, "reference", Ink::Baseline, Stroke::Line),
                             above(*measured, "measured", Ink::Measured, Stroke::Line),
                             above(simulated->line, "simulated", Ink::Simulated, Stroke::Dashed)}};

  Finding finding;
  finding.section = {.id = "corner-" + camera.name,
                     .title = camera.title + ": corner of two boards"};
  finding.section.verdict = fmt::format(
      "Measured: {} to {} mm too far (median {} mm). Simulated as is, {} mm RMS of the {} mm "
      "remain ({} of the mean square explained); with the "
      "constant that the distance table gave, {} mm RMS ({}). Shape alone: {} of {} mm spread "
      "remain.",
      shown(summarise(rows.measured_mm).min, 0), shown(summarise(rows.measured_mm).max, 0),
      shown(summarise(rows.measured_mm).median, 0), shown(raw.residual_rms),
      shown(raw.measured_rms), shownPercent(raw.fraction_raw), shown(delayed.residual_rms),
      shownPercent(delayed.fraction_raw), shown(raw.residual_sd), shown(raw.measured_sd));
  finding.section.tone = toneOf(delayed.fraction_raw);
  Json regions;
  const auto region_table = regionRows(rows, camera.delay_mm, regions);
  finding.section.blocks = {
      Figure{"Error along each ray, one camera row. Each error is against its own truth: the "
             "measured line against the structured-light reference, the simulated one against the "
             "two planes fitted to it. Below: measured less simulated with the constant.",
             toSvg(plot)},
      TableBlock{
          "What is left of the measured error",
          kExplainedHeader,
          {explainedRow("no simulation (the reference itself)", none), explainedRow("simulated, preset", raw),
           explainedRow("simulated + constant from the distance table", delayed)}},
      TableBlock{"By region, mean errors in mm",
                 {"region", "n", "measured", "simulated", "difference", "… after the constant", "… RMS"},
                 region_table},
      Paragraph{fmt::format("The published simulator's output is of another corner (edge {} mm before "
                            "its camera and {} mm beside the axis, here {} and {} mm), and multipath "
                            "depends on both, so it is not a third curve of this figure but has its "
                            "own section beside our simulation of that corner:",
                            shown(published->edge_z_mm, 0), shown(std::abs(published->edge_x_mm), 0),
                            shown(corner->edge_z_mm, 0), shown(std::abs(corner->edge_x_mm), 0)),
                false, kPublishedSection, kPublishedTitle},
      Figure{"The same from above.", toSvg(plan)},
      Paragraph{
          fmt::format("Geometry from the reference line: edge at x {} mm, z {} mm; boards {} and {} mm "
                      "long, opening {}°, planes fit it to {} and {} mm RMS. "
                      "Assumed, not measured: boards Lambertian with albedo {}, {} mm tall with the camera "
                      "at half height, nothing else in the room. "
                      "Monte-Carlo and sensor noise of the simulated line: {} mm (median standard error).",
                      shown(corner->edge_x_mm), shown(corner->edge_z_mm), shown(corner->left_length_mm, 0),
                      shown(corner->right_length_mm, 0), shown(corner->opening_deg, 2),
                      shown(corner->left.rms_mm, 2), shown(corner->right.rms_mm, 2), kAlbedo, kHeight_mm,
                      shown(simulated->median_error_mm, 2)),
          true}};
  finding.data.set("no_simulation", toJson(none))
      .set("simulated", toJson(raw))
      .set("simulated_with_constant", toJson(delayed))
      .set("regions", regions);
  addCornerFit(camera, lines, finding);
  finding.data.set("opening_deg", corner->opening_deg)
      .set("monte_carlo_mm", simulated->median_error_mm)
      .set("albedo", kAlbedo);
  finding.cards.push_back(
      {camera.title + " corner", shown(delayed.residual_rms) + " mm",
       fmt::format("RMS left of {} mm, constant from the distance table", shown(none.residual_rms)),
       finding.section.tone});
  finding.headline = fmt::format(
      "{} corner: {} mm RMS, {} mm left as is, {} mm with the constant of the distance table",
      camera.title, shown(none.residual_rms), shown(raw.residual_rms), shown(delayed.residual_rms));
  return finding;
}

}  // namespace toftwin::compare
