// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/residual.h"
#include "tools/validate/free_numbers.h"
#include "tools/validate/judged.h"
#include "tools/validate/traced_line.h"

namespace toftwin::validate {

using compare::Curve;
using compare::Figure;
using compare::Ink;
using compare::Plot;
using compare::quantile;
using compare::shown;
using compare::Stroke;
using compare::TableBlock;

namespace {

constexpr double kReach_px = 8.0;
/// Depth before the wall (second) over pixels from an edge (first), positive on the object, ascending.
using Profile = std::vector<std::pair<double, double>>;
struct EdgeProfiles {
  double left = kNaN, right = kNaN;  ///< pixels; NaN where there is none
  Profile at_left{}, at_right{};
};

/// An edge is where the depth crosses half of the step, between pixels.
EdgeProfiles edgesOf(std::span<const double> before_wall_mm, double half) {
  EdgeProfiles edges;
  for (std::size_t i = 1; i < before_wall_mm.size(); ++i) {
    const double a = before_wall_mm[i - 1], b = before_wall_mm[i];
    const double at = static_cast<double>(i - 1) + (half - a) / (b - a);
    if (a < half && b >= half && std::isnan(edges.left)) edges.left = at;
    if (a >= half && b < half) edges.right = at;
  }
  for (std::size_t i = 0; i < before_wall_mm.size(); ++i) {
    if (!std::isfinite(before_wall_mm[i])) continue;
    const double from_left = static_cast<double>(i) - edges.left,
                 from_right = edges.right - static_cast<double>(i);
    if (std::abs(from_left) <= kReach_px) edges.at_left.emplace_back(from_left, before_wall_mm[i]);
    if (std::abs(from_right) <= kReach_px) edges.at_right.emplace_back(from_right, before_wall_mm[i]);
  }
  std::ranges::sort(edges.at_right);
  return edges;
}

/// Linear between the pixels beside it; as the outermost one beyond them.
double depthAt(const Profile& profile, double offset_px) {
  if (profile.empty()) return kNaN;
  const auto above = std::ranges::lower_bound(profile, offset_px, {}, &Profile::value_type::first);
  if (above == profile.begin()) return above->second;
  if (above == profile.end()) return profile.back().second;
  const auto below = above - 1;
  const double share = (offset_px - below->first) / (above->first - below->first);
  return (1.0 - share) * below->second + share * above->second;
}

struct Measured {
  EdgeProfiles edges;
  double wall_mm = 0.0;
  double constant_mm = 0.0,
         step_mm = 0.0;  ///< of the wall beside the left edge, and of the object before that
  double left_t = 0.0;   ///< the ray to the left edge
};
Result<Measured> measuredEdges(const Edges& what, const Task& task) {
  const auto columns = columnsOf(task, what.file, {what.x, what.z, what.background});
  if (!columns) return columns.error();
  std::vector<double> t, before_wall, wall;
  for (std::size_t i = 0; i < (*columns)[0].size(); ++i) {
    const double z = (*columns)[1][i], background = (*columns)[2][i];
    t.push_back((*columns)[0][i] / background);
    const bool is_near = std::abs(t.back()) < what.within_t;
    before_wall.push_back(is_near ? background - z : kNaN);
    if (is_near) wall.push_back(background);
  }
  Measured measured{.edges = edgesOf(before_wall, 0.5 * quantile(before_wall, 0.97)),
                    .wall_mm = quantile(wall, 0.5)};
  // Wall and object are what pixels well off the left edge say: that edge is fitted, the right one judged.
  std::vector<double> on_wall, on_object;
  for (const auto& [offset, depth] : measured.edges.at_left) {
    if (offset < -4.0) on_wall.push_back(depth);
    if (offset > 3.0) on_object.push_back(depth);
  }
  measured.constant_mm = quantile(on_wall, 0.5);
  measured.step_mm = quantile(on_object, 0.5) - measured.constant_mm;
  measured.edges = edgesOf(before_wall, measured.constant_mm + 0.5 * measured.step_mm);
  if (!(measured.edges.left < measured.edges.right))
    return Error{Error::Code::InvalidArgument,
                 what.file + ": no object before the wall"};
  measured.left_t = t[static_cast<std::size_t>(std::lround(measured.edges.left))];
  return measured;
}

/// The camera's row before such an object, its light traced once.
struct Simulated {
  std::vector<TracedLine> lines;  ///< with the object moved by parts of a pixel
  double wall_mm = 0.0, step_mm = 0.0;

  /// The pixels of all lines together: profiles finer than a pixel.
  [[nodiscard]] EdgeProfiles edges(const sim::SensorModel& camera) const {
    EdgeProfiles all;
    for (const TracedLine& line : lines) {
      const ScanLine read = readLine(camera, line, 1).line;
      std::vector<double> before_wall;
      for (std::size_t i = 0; i < read.t.size(); ++i)
        before_wall.push_back(wall_mm - read.range_mm[i] / std::sqrt(1.0 + read.t[i] * read.t[i]));
      const EdgeProfiles one = edgesOf(before_wall, 0.5 * step_mm);
      all.at_left.insert(all.at_left.end(), one.at_left.begin(), one.at_left.end());
      all.at_right.insert(all.at_right.end(), one.at_right.begin(), one.at_right.end());
    }
    std::ranges::sort(all.at_left);
    std::ranges::sort(all.at_right);
    return all;
  }
};
Result<Simulated> simulatedEdges(const Edges& what, const Task& task, const sim::SensorModel& camera, const Measured& measured) {
  constexpr int kPlaces = 4;
  const double object_mm = measured.wall_mm - measured.step_mm, pixel = 1.0 / camera.camera().fx;
  Simulated simulated{.lines = {}, .wall_mm = measured.wall_mm, .step_mm = measured.step_mm};
  for (int place = 0; place < kPlaces; ++place) {
    const double left = measured.left_t + pixel * place / kPlaces,
                 right = left + pixel * (measured.edges.right - measured.edges.left);
    const double reach_mm = 2.0 * measured.wall_mm;  // to either side: more than the row sees
    const auto scene = sim::Scene::parse(
        materialToml("object", what.object_albedo) + materialToml("wall", what.wall_albedo) +
            wallToml({-reach_mm, measured.wall_mm, reach_mm, measured.wall_mm, 2000.0, "wall"}) +
            wallToml({left * object_mm, object_mm, right * object_mm, object_mm, 1000.0, "object"}),
        "object.toml");
    if (!scene) return scene.error();
    simulated.lines.push_back(traceLine(camera.traceRequest(), *scene, {.samples = task.paths(what.samples), .surfaces = 1, .seed = 0}));
  }
  return simulated;
}

/// Rows beside both edges: pixels from the edge, and the depth before the wall less the constant.
struct EdgeRows {
  std::vector<double> offset_px, y;
  Blocks blocks;  ///< the left edge is fitted, the right one judged
};
EdgeRows rowsOf(const Measured& measured) {
  EdgeRows rows;
  for (const bool is_right : {false, true}) {
    for (const auto& [offset, depth] : is_right ? measured.edges.at_right : measured.edges.at_left)
      rows.offset_px.push_back(offset), rows.y.push_back(depth - measured.constant_mm), rows.blocks.push_back(is_right ? 1 : 0);
  }
  return rows;
}

Figure figureOf(const Subject& camera, const EdgeRows& rows, const std::vector<double>& as_measured,
                const std::vector<double>& fitted, const std::vector<double>& as_is) {
  Curve left{.name = "left edge (fitted)", .ink = Ink::Baseline, .stroke = Stroke::Dots},
      right{.name = "right edge (judged)", .ink = Ink::Measured, .stroke = Stroke::Dots},
      line{.name = "simulated, fitted to the left edge", .ink = Ink::Simulated},
      plain{.name = "simulated, preset", .ink = Ink::Simulated, .stroke = Stroke::Dashed};
  for (std::size_t i = 0; i < rows.y.size(); ++i) {
    Curve& dots = isJudged(rows.blocks[i]) ? right : left;
    dots.x.push_back(rows.offset_px[i]), dots.y.push_back(as_measured[i]);
    if (!isJudged(rows.blocks[i])) continue;
    line.x.push_back(rows.offset_px[i]), line.y.push_back(fitted[i]);
    plain.x.push_back(rows.offset_px[i]), plain.y.push_back(as_is[i]);
  }
  return {"Depth before the wall beside both edges.", toSvg(Plot{.title = camera.title + " edges",
                                                                 .x_label = "pixels from the edge",
                                                                 .y_label = "depth before the wall [mm]",
                                                                 .curves = {left, right, line, plain}})};
}

}  // namespace

Result<Judged> judge(const Edges& what, const EffectGroup& fitted, const Subject& camera, Task& task) {
  const auto measured = measuredEdges(what, task);
  if (!measured) return measured.error();
  const sim::SensorModel clean = withoutNoise(camera.model);
  const auto simulated = simulatedEdges(what, task, clean, *measured);
  if (!simulated) return simulated.error();
  const EdgeRows rows = rowsOf(*measured);
  const auto depths = [&](const sim::SensorModel& model) {
    const EdgeProfiles edges = simulated->edges(model);
    std::vector<double> line;
    for (std::size_t i = 0; i < rows.y.size(); ++i)
      line.push_back(depthAt(isJudged(rows.blocks[i]) ? edges.at_right : edges.at_left, rows.offset_px[i]));
    return line;
  };
  const CurveFit fit = fitNumbers(
      rows.y, fitted.numbers, std::vector<bool>(fitted.numbers.size(), true),
      [&](std::span<const double> values) { return depths(withMore(clean, effectsAt(fitted, values), true)); }, rows.blocks);
  const std::vector<double> as_is = depths(clean), as_measured = plus(rows.y, measured->constant_mm);
  std::vector<double> ideal;
  for (const double n : rows.offset_px) ideal.push_back(n > 0.0 ? measured->step_mm : 0.0);
  const double ideal_rms = judgedRms(as_measured, ideal, rows.blocks), constant_rms = judgedRms(rows.y, ideal, rows.blocks),
               as_is_rms = judgedRms(as_measured, as_is, rows.blocks);
  const std::string data = dataOf(what, camera);
  Judged judged = begun(what, camera);
  judged.outcomes.push_back({.data = data,
                             .judged = fit.judged_n,
                             .ideal_mm = ideal_rms,
                             .constant_mm = constant_rms,
                             .as_is_mm = as_is_rms,
                             .fitted_mm = fit.judged_rms});
  const auto causes = causesOf(fitted.numbers);
  if (causes.size() == 1) judged.ablations.push_back({causes.front(), data, fit.judged_rms, judgedRms(rows.y, as_is, rows.blocks)});
  judged.ablations.push_back({"extent of the pixel and " + fmt::format("{}", fmt::join(causes, ", ")), data, fit.judged_rms, constant_rms});
  TableBlock table{"Depth across the object's edges. Fitted on the left edge, judged on the right one; RMS in mm",
                   {"n judged", "step [mm]", "constant [mm]", "ideal camera", "ideal + constant", "preset as is", "fitted + constant"},
                   {{std::to_string(fit.judged_n), shown(measured->step_mm, 0), shown(measured->constant_mm), shown(ideal_rms),
                     shown(constant_rms), shown(as_is_rms), shown(fit.judged_rms)}}};
  for (std::size_t i = 0; i < fitted.numbers.size(); ++i) {
    table.header.push_back(fmt::format("{} [{}]", fitted.numbers[i].name, fitted.numbers[i].unit));
    table.rows.front().push_back(shown(fit.value[i], fitted.numbers[i].decimals));
    judged.finding.data.set(fitted.numbers[i].name, fit.value[i]);
  }
  compare::Section& section = judged.finding.section;
  section.verdict = fmt::format("Within 8 pixels of the edge that it was not fitted to, the fitted camera and a constant leave {} of "
                                "{} mm RMS.",
                                shown(fit.judged_rms), shown(ideal_rms));
  section.tone = toneOf(1.0 - std::pow(fit.judged_rms / ideal_rms, 2));
  section.blocks = {figureOf(camera, rows, as_measured, plus(fit.prediction, measured->constant_mm), as_is), table};
  addNotes(what, judged);
  judged.finding.data.set("judged_rms_mm", fit.judged_rms).set("preset_mm", as_is_rms);
  return judged;
}

}  // namespace toftwin::validate
