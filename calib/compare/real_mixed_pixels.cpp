// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calib/compare/held_out.h"
#include "calib/compare/real_data.h"
#include "calib/compare/residual.h"
#include "calib/compare/simulated_line.h"
#include "calib/table/table.h"

namespace toftwin::compare {
namespace {

constexpr double kReach_px = 8.0;
/// "A weakly reflecting object before a strongly reflecting background", says the measurement.
constexpr double kObject = 0.2, kWall = 0.8;

/// Depth before the wall (second) over pixels from an edge (first), positive on the object, ascending.
using Profile = std::vector<std::pair<double, double>>;
struct Edges {
  double left = std::nan(""), right = std::nan("");  ///< pixels; NaN where there is none
  Profile at_left{}, at_right{};
};

/// An edge is where the depth crosses half of the step, between pixels.
Edges edgesOf(std::span<const double> before_wall_mm, double half) {
  Edges edges;
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
  if (profile.empty()) return std::nan("");
  const auto above = std::ranges::lower_bound(profile, offset_px, {}, &Profile::value_type::first);
  if (above == profile.begin()) return above->second;
  if (above == profile.end()) return profile.back().second;
  const auto below = above - 1;
  const double share = (offset_px - below->first) / (above->first - below->first);
  return (1.0 - share) * below->second + share * above->second;
}

struct Measured {
  Edges edges;
  double wall_mm = 0.0;
  double constant_mm = 0.0,
         step_mm = 0.0;  ///< of the wall beside the left edge, and of the object before that
  double left_t = 0.0;   ///< the ray to the left edge
};
Result<Measured> measuredEdges(const std::filesystem::path& file) {
  const auto columns = table::readNumbers(file, {"x_mm", "z_mm", "background_z_mm"});
  if (!columns) return columns.error();
  std::vector<double> t, before_wall, wall;
  for (std::size_t i = 0; i < (*columns)[0].size(); ++i) {
    const double z = (*columns)[1][i], background = (*columns)[2][i];
    t.push_back((*columns)[0][i] / background);
    const bool is_near = std::abs(t.back()) < 0.15;
    before_wall.push_back(is_near ? background - z : std::nan(""));
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
                 fmt::format("{} shows no object before the wall", file.string())};
  measured.left_t = t[static_cast<std::size_t>(std::lround(measured.edges.left))];
  return measured;
}

/// The camera's row before such an object, its light traced once.
struct Simulated {
  std::vector<TracedLine> lines;  ///< with the object moved by parts of a pixel
  double wall_mm = 0.0, step_mm = 0.0;

  /// The pixels of all lines together: profiles finer than a pixel.
  [[nodiscard]] Edges edges(const sim::SensorModel& camera) const {
    Edges all;
    for (const TracedLine& line : lines) {
      const ScanLine read = readLine(camera, line);
      std::vector<double> before_wall;
      for (std::size_t i = 0; i < read.t.size(); ++i)
        before_wall.push_back(wall_mm - read.range_mm[i] / std::sqrt(1.0 + read.t[i] * read.t[i]));
      const Edges one = edgesOf(before_wall, 0.5 * step_mm);
      all.at_left.insert(all.at_left.end(), one.at_left.begin(), one.at_left.end());
      all.at_right.insert(all.at_right.end(), one.at_right.begin(), one.at_right.end());
    }
    std::ranges::sort(all.at_left);
    std::ranges::sort(all.at_right);
    return all;
  }
};
Result<Simulated> simulatedEdges(const sim::SensorModel& camera, const Measured& measured) {
  constexpr int kPlaces = 4, kSamples = 256;
  const double object_mm = measured.wall_mm - measured.step_mm, pixel = 1.0 / camera.camera().fx;
  Simulated simulated{.lines = {}, .wall_mm = measured.wall_mm, .step_mm = measured.step_mm};
  for (int place = 0; place < kPlaces; ++place) {
    const double left = measured.left_t + pixel * place / kPlaces,
                 right = left + pixel * (measured.edges.right - measured.edges.left);
    const double reach_mm = 2.0 * measured.wall_mm;  // to either side: more than the row sees
    const auto scene = sim::Scene::parse(
        materialToml("object", kObject) + materialToml("wall", kWall) +
            wallToml({-reach_mm, measured.wall_mm, reach_mm, measured.wall_mm, 2000.0, "wall"}) +
            wallToml({left * object_mm, object_mm, right * object_mm, object_mm, 1000.0, "object"}),
        "object.toml");
    if (!scene) return scene.error();
    simulated.lines.push_back(traceLine(camera, *scene, kSamples));
  }
  return simulated;
}

Result<> addCamera(const RealDataJob& job, const RealCamera& camera, Finding& finding, TableBlock& table,
                   FigureRow& figures) {
  const auto measured = measuredEdges(job.folder / "mixed_pixels" / (camera.name + ".csv"));
  if (!measured) return measured.error();
  const auto named = sim::SensorModel::preset(camera.name);
  if (!named) return named.error();
  const sim::SensorModel preset = withoutNoise(*named);
  const auto simulated = simulatedEdges(preset, *measured);
  if (!simulated) return simulated.error();
  std::vector<double> offset, y;
  Blocks blocks;
  for (const bool is_right : {false, true}) {
    for (const auto& [n, depth] : is_right ? measured->edges.at_right : measured->edges.at_left)
      offset.push_back(n), y.push_back(depth - measured->constant_mm), blocks.push_back(is_right ? 1 : 0);
  }
  const auto depths = [&](const sim::SensorModel& model) {
    const Edges edges = simulated->edges(model);
    std::vector<double> line;
    for (std::size_t i = 0; i < offset.size(); ++i)
      line.push_back(depthAt(isJudged(blocks[i]) ? edges.at_right : edges.at_left, offset[i]));
    return line;
  };
  const Bounded numbers[] = {{0.6, 0.0, 3.0}, {0.5, 0.0, 4.0}};
  const CurveFit fit = fitCurve(
      y, numbers,
      [&](std::span<const double> x) {
        return depths(withEffect(preset, sim::Defocus{.radius = x[1], .sigma = x[0]}));
      },
      blocks);
  const std::vector<double> sharp = depths(preset);
  std::vector<double> ideal;
  for (const double n : offset) ideal.push_back(n > 0.0 ? measured->step_mm : 0.0);
  std::vector<double> as_measured = y;  // the constant included
  for (double& one : as_measured) one += measured->constant_mm;
  const double ideal_rms = judgedRms(as_measured, ideal, blocks), constant_rms = judgedRms(y, ideal, blocks),
               as_is_rms = judgedRms(as_measured, sharp, blocks);
  table.rows.push_back({camera.title, std::to_string(fit.judged_n), shown(measured->step_mm, 0),
                        shown(measured->constant_mm), shown(ideal_rms), shown(constant_rms), shown(as_is_rms),
                        shown(fit.judged_rms), shown(fit.value[0], 2), shown(fit.value[1], 2)});
  const std::string data = camera.title + ", edges of an object";
  finding.outcomes.push_back({.data = data,
                              .judged = fit.judged_n,
                              .ideal_mm = ideal_rms,
                              .constant_mm = constant_rms,
                              .published_mm = std::nan(""),
                              .as_is_mm = as_is_rms,
                              .fitted_mm = fit.judged_rms});
  finding.ablations.push_back({"defocus", data, fit.judged_rms, judgedRms(y, sharp, blocks)});
  finding.ablations.push_back({"extent of the pixel and defocus", data, fit.judged_rms, constant_rms});
  Curve left{.name = "left edge (fitted)", .ink = Ink::Baseline, .stroke = Stroke::Dots},
      right{.name = "right edge (judged)", .ink = Ink::Measured, .stroke = Stroke::Dots},
      line{.name = "simulated, fitted to the left edge", .ink = Ink::Simulated},
      plain{.name = "simulated, preset", .ink = Ink::Simulated, .stroke = Stroke::Dashed};
  for (std::size_t i = 0; i < y.size(); ++i) {
    Curve& dots = isJudged(blocks[i]) ? right : left;
    dots.x.push_back(offset[i]), dots.y.push_back(as_measured[i]);
    if (!isJudged(blocks[i])) continue;
    line.x.push_back(offset[i]), line.y.push_back(fit.prediction[i] + measured->constant_mm);
    plain.x.push_back(offset[i]), plain.y.push_back(sharp[i]);
  }
  figures.figures.push_back(
      {fmt::format("{}.", camera.title), toSvg(Plot{.title = camera.title,
                                                    .x_label = "pixels from the edge",
                                                    .y_label = "depth before the wall [mm]",
                                                    .curves = {left, right, line, plain},
                                                    .compact = true})});
  Json json = Json::object();
  json.set("sigma_px", fit.value[0])
      .set("radius_px", fit.value[1])
      .set("judged_rms_mm", fit.judged_rms)
      .set("preset_mm", as_is_rms);
  finding.data.set(camera.name, json);
  return {};
}

}  // namespace

Result<Finding> judgeMixedPixels(const RealDataJob& job) {
  Finding finding;
  finding.section = {.id = "mixed", .title = "Mixed pixels: an object before a wall"};
  TableBlock table{
      "Depth across the object's edges. Fitted on the left edge, judged on the right one; RMS in mm",
      {"camera", "n judged", "step [mm]", "constant [mm]", "ideal camera", "ideal + constant", "preset as is",
       "with defocus + constant", "σ [px]", "radius [px]"},
      {}};
  FigureRow figures;
  for (const auto& [name, title] : {std::pair{"kinect_v2", "Kinect v2"}, std::pair{"o3d303", "O3D303"}})
    if (auto done = addCamera(job, {.name = name, .title = title}, finding, table, figures); !done)
      return done.error();
  double with = 0.0, without = 0.0;
  for (const Outcome& o : finding.outcomes)
    with += o.fitted_mm * o.fitted_mm, without += o.ideal_mm * o.ideal_mm;
  finding.section.verdict = fmt::format(
      "Within 8 pixels of the edge that it was not fitted to, the pixel's extent, a defocus and a constant "
      "leave "
      "{} of {} mm RMS.",
      shown(std::sqrt(with / 2.0)), shown(std::sqrt(without / 2.0)));
  finding.section.tone = toneOf(1.0 - with / without);
  finding.section.blocks = {
      figures, table,
      Paragraph{
          fmt::format(
              "Simulated: a plate of albedo {} before one of albedo {}, as far as the left edge shows, "
              "at places that are a quarter of a pixel apart; direct light over each pixel's extent, the "
              "camera's samples and decoder, no noise. An edge is where the depth crosses half of the "
              "step, in the measurement as in the simulation. The constant is what the wall beside the left "
              "edge changes by when the object is there. One edge has some 16 pixels: no errors "
              "are given.",
              shown(kObject), shown(kWall)),
          true}};
  return finding;
}

}  // namespace toftwin::compare
