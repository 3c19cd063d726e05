// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "calib/compare/csv.h"
#include "calib/compare/held_out.h"
#include "calib/compare/real_data.h"
#include "calib/compare/residual.h"
#include "calib/compare/scatter_laws.h"

namespace toftwin::compare {

double veilError_mm(const ScatterCamera& camera, double eta, double background_mm,
                    double plate_mm) {
  if (camera.modulation.empty()) return eta * (plate_mm - background_mm) / (1.0 + eta);
  double error = 0.0;
  for (const auto& [frequency, weight] : camera.modulation) {
    const double period = unambiguousRange(frequency).in(millimetre);
    const double turn = 2.0 * std::numbers::pi * (plate_mm - background_mm) / period;
    error += weight * std::arg(1.0 + std::polar(eta, turn)) / (2.0 * std::numbers::pi) * period;
  }
  return error;
}

std::vector<ScatterCamera> scatterCameras() {
  // The Kinect's decoder averages the three frequencies' cycles: weights f / Σ f.
  return {{"kinect_v2",
           "Kinect v2",
           {{80_MHz, 80.0 / 216.0}, {16_MHz, 16.0 / 216.0}, {120_MHz, 120.0 / 216.0}},
           {1, 3, 5, 7, 9, 11}},
          {"o3d303", "O3D303", {{30_MHz, 1.0}}, {1, 3, 5, 7, 9}},
          {"xtion_2", "Xtion 2", {}, {1, 3, 5, 7, 9, 11, 13}}};
}

namespace {

/// One run: the background's change beside the plate, and what the plate is.
struct Run {
  std::vector<double> t, change_mm, background_mm;
  double plate_mm = 0.0, covered = 0.0;
};

std::optional<Run> toRun(const std::vector<std::vector<double>>& columns) {
  std::vector<double> t, plate;
  const auto& [x, z, background] = std::tie(columns[0], columns[1], columns[2]);
  for (std::size_t i = 0; i < x.size(); ++i) t.push_back(x[i] / background[i]);
  // The plate stands right of the axis and is at least 80 mm before the background.
  double edge = std::nan("");
  for (std::size_t i = 0; i < x.size(); ++i)
    if (t[i] > 0.02 && z[i] > 300.0 && background[i] - z[i] > 80.0 && !(edge <= t[i])) edge = t[i];
  if (std::isnan(edge)) return {};
  for (std::size_t i = 0; i < x.size(); ++i)
    if (t[i] > edge + 0.03 && z[i] > 300.0 && background[i] - z[i] > 80.0) plate.push_back(z[i]);
  if (plate.size() < 10) return {};
  const auto [first, last] = std::minmax_element(t.begin(), t.end());
  Run run;
  run.plate_mm = quantile(plate, 0.5);
  run.covered = (*last - edge) / (*last - *first);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (t[i] < -0.45 || t[i] > std::min(0.0, edge - 0.08) || std::abs(z[i] - background[i]) > 250.0)
      continue;
    run.t.push_back(t[i]), run.change_mm.push_back(z[i] - background[i]),
        run.background_mm.push_back(background[i]);
  }
  return run;
}

Result<> addCamera(const RealDataJob& job, const ScatterCamera& camera, Finding& finding,
                   TableBlock& table, TableBlock& runs_table, FigureRow& figures) {
  std::vector<double> change;
  std::vector<Run> runs;
  Blocks blocks;
  for (std::size_t i = 0; i < camera.runs.size(); ++i) {
    const auto file =
        job.folder / "lens_scatter" / camera.name / fmt::format("run_{:02}.csv", camera.runs[i]);
    const auto columns = loadColumns(file, {"x_mm", "z_mm", "background_z_mm"});
    if (!columns) return columns.error();
    auto run = toRun(*columns);
    if (!run)
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{}: no plate before the background to the right of the axis",
                               file.string())};
    change.insert(change.end(), run->change_mm.begin(), run->change_mm.end());
    blocks.insert(blocks.end(), run->t.size(), static_cast<int>(i));
    runs.push_back(*std::move(run));
  }
  const auto predict = [&](std::span<const double> x) {
    std::vector<double> line;
    for (const Run& run : runs)
      for (const double background : run.background_mm)
        line.push_back(veilError_mm(camera,
                                    x[0] * run.covered * std::pow(background / run.plate_mm, 2),
                                    background, run.plate_mm));
    return line;
  };
  const Bounded veil[] = {{0.01, 0.0, 1.0}};
  const CurveFit fit = fitCurve(change, veil, predict, blocks);
  std::vector<double> judged, left;
  Plot plot{.title = camera.title,
            .x_label = "plate's depth [mm]",
            .y_label = "background's change [mm]",
            .curves = {},
            .zero_line = true,
            .compact = true};
  Curve measured{.name = "measured, median of a run", .ink = Ink::Measured},
      simulated{.name = "even veil, one number", .ink = Ink::Simulated, .stroke = Stroke::Dashed};
  std::size_t at = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::vector<double> here;
    for (std::size_t j = 0; j < runs[i].t.size(); ++j) here.push_back(fit.prediction[at++]);
    const double m = summarise(runs[i].change_mm).mean, s = summarise(here).mean;
    measured.x.push_back(runs[i].plate_mm), measured.y.push_back(m);
    simulated.x.push_back(runs[i].plate_mm), simulated.y.push_back(s);
    if (isJudged(static_cast<int>(i)))
      judged.insert(judged.end(), runs[i].change_mm.begin(), runs[i].change_mm.end());
    runs_table.rows.push_back({camera.title, fmt::format("{}", camera.runs[i]),
                               isFitted(static_cast<int>(i)) ? "fitted" : "judged",
                               shown(runs[i].plate_mm, 0), shownPercent(runs[i].covered), shown(m),
                               shown(s)});
  }
  plot.curves = {measured, simulated};
  plot.below = measuredLess(measured.x, measured.y, simulated.y);
  figures.figures.push_back({camera.title + ".", toSvg(plot)});
  const double ideal = summarise(judged).rms;
  table.rows.push_back({camera.title, std::to_string(fit.judged_n), shown(ideal),
                        shown(fit.judged_rms),
                        shownFitted(1e2 * fit.value[0], 1e2 * fit.error[0], 2)});
  const std::string data = camera.title + ", dark wall beside a bright plate";
  finding.outcomes.push_back(
      {data, fit.judged_n, ideal, ideal, std::nan(""), ideal, fit.judged_rms});
  finding.ablations.push_back({"lens scatter, even veil", data, fit.judged_rms, ideal});
  Json json = Json::object();
  json.set("veil_times_albedo_ratio", fit.value[0])
      .set("error", fit.error[0])
      .set("ideal_mm", ideal)
      .set("judged_rms_mm", fit.judged_rms);
  finding.data.set(camera.name, json);
  return {};
}

/// The infrared image beside the edge of a wide bright plate, as it was measured.
Result<> addEdgeProfile(const RealDataJob& job, const std::string& name, const std::string& title,
                        TableBlock& table) {
  const auto columns = loadColumns(job.folder / "lens_scatter" / (name + "_edge_profile.csv"),
                                   {"offset_px", "relative_intensity"});
  if (!columns) return columns.error();
  std::vector<std::string> row{title};
  const double bounds[] = {0.5, 1.5, 2.5, 5.5, 10.5, 20.5, 40.5, 80.5};
  for (std::size_t part = 0; part + 1 < std::size(bounds); ++part) {
    std::vector<double> here;
    for (std::size_t i = 0; i < (*columns)[0].size(); ++i) {
      const double n = (*columns)[0][i];  // mirrored: one side is all
      if (n > bounds[part] && n < bounds[part + 1]) here.push_back((*columns)[1][i]);
    }
    row.push_back(shown(100.0 * summarise(here).mean, 2));
  }
  table.rows.push_back(std::move(row));
  return {};
}

}  // namespace

Result<Finding> judgeScatter(const RealDataJob& job) {
  Finding finding;
  finding.section = {.id = "scatter", .title = "Lens scatter: a bright plate beside a dark wall"};
  TableBlock table{
      "Even veil P̃ = P + s ⟨P⟩: one number per camera, fitted on every other run, judged on "
      "the runs between; RMS over all pixels of the wall's left part",
      {"camera", "n judged", "ideal camera [mm]", "with the veil [mm]",
       "s · albedo of plate / wall [%]"},
      {}};
  TableBlock runs{
      "Change of the wall's reading, mean of a run",
      {"camera", "run", "half", "plate at [mm]", "of the row", "measured [mm]", "veil [mm]"},
      {}};
  TableBlock profile{
      "Infrared image beside the edge of a bright plate, per cent of the plate, by pixels from the "
      "edge",
      {"camera", "1 px", "2 px", "3–5 px", "6–10 px", "11–20 px", "21–40 px", "41–80 px"},
      {}};
  FigureRow figures;
  for (const ScatterCamera& camera : scatterCameras())
    if (auto done = addCamera(job, camera, finding, table, runs, figures); !done)
      return done.error();
  for (const auto& [name, title] :
       {std::pair{"kinect_v2", "Kinect v2"}, std::pair{"o3d303", "O3D303"}})
    if (auto done = addEdgeProfile(job, name, title, profile); !done) return done.error();
  double with = 0.0, without = 0.0;
  for (const Outcome& o : finding.outcomes)
    with += o.fitted_mm * o.fitted_mm, without += o.ideal_mm * o.ideal_mm;
  finding.section.verdict = fmt::format(
      "One number per camera, an even veil, leaves {} of {} mm RMS over the three cameras' runs "
      "that it was not "
      "fitted to ({} explained), the Kinect's change of sign included.",
      shown(std::sqrt(with / 3.0)), shown(std::sqrt(without / 3.0)),
      shownPercent(1.0 - with / without));
  finding.section.tone = toneOf(1.0 - with / without);
  finding.section.blocks = {
      figures, table, runs, profile,
      Paragraph{"Closed form: the wall's phasor gets η e^(i 4πf (d_plate − d_wall)/c), η = s · "
                "(albedo of the plate / of the "
                "wall) · share of the row that the plate covers · (d_wall/d_plate)². The albedos "
                "were not measured and the plate's "
                "height is not known: s alone cannot be had from this. Xtion 2: charge-weighted "
                "mean of the two distances, as a pulsed camera's gates give.",
                true}};
  return finding;
}

namespace {

/// Φ(x): share of a Gaussian of standard deviation 1 below x.
double below(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

}  // namespace

Result<Finding> judgeMixedPixels(const RealDataJob& job) {
  Finding finding;
  finding.section = {.id = "mixed", .title = "Mixed pixels: an object before a wall"};
  TableBlock table{
      "Depth across the object's edges as the mean of two surfaces, weighted by what the pixel "
      "sees of each. "
      "Fitted on the left edge, judged on the right one; RMS in mm",
      {"camera", "n judged", "step [mm]", "ideal camera", "box pixel alone", "with blur",
       "blur σ [px]", "wide part [%]"},
      {}};
  FigureRow figures;
  for (const auto& [name, title] :
       {std::pair{"kinect_v2", "Kinect v2"}, std::pair{"o3d303", "O3D303"}}) {
    const auto columns = loadColumns(job.folder / "mixed_pixels" / (std::string{name} + ".csv"),
                                     {"x_mm", "z_mm", "background_z_mm"});
    if (!columns) return columns.error();
    std::vector<double> depth;  // before the wall
    for (std::size_t i = 0; i < (*columns)[0].size(); ++i) {
      const double t = (*columns)[0][i] / (*columns)[2][i];
      depth.push_back(std::abs(t) < 0.15 ? (*columns)[2][i] - (*columns)[1][i] : std::nan(""));
    }
    const double top = quantile(depth, 0.97), half = 0.5 * top;
    std::vector<double> offset,
        y;  // pixels from the edge, positive on the object; depth over the step
    Blocks blocks;
    double left_edge = std::nan(""), right_edge = std::nan("");
    for (std::size_t i = 1; i < depth.size(); ++i) {
      const double at =
          static_cast<double>(i - 1) + (half - depth[i - 1]) / (depth[i] - depth[i - 1]);
      if (depth[i - 1] < half && depth[i] >= half && std::isnan(left_edge)) left_edge = at;
      if (depth[i - 1] >= half && depth[i] < half) right_edge = at;
    }
    if (!(left_edge < right_edge))
      return Error{Error::Code::InvalidArgument,
                   fmt::format("mixed_pixels/{}.csv shows no object before the wall", name)};
    for (const bool right : {false, true}) {
      for (std::size_t i = 0; i < depth.size(); ++i) {
        const double n =
            right ? right_edge - static_cast<double>(i) : static_cast<double>(i) - left_edge;
        if (std::abs(n) > 8.0 || std::isnan(depth[i])) continue;
        offset.push_back(n), y.push_back(depth[i]), blocks.push_back(right ? 1 : 0);
      }
    }
    // Numbers: blur in pixels, share of a blur four times as wide, step.
    const auto model = [&](std::span<const double> x) {
      std::vector<double> line;
      for (const double n : offset)
        line.push_back(x[2] * ((1.0 - x[1]) * below(n / x[0]) + x[1] * below(n / (4.0 * x[0]))));
      return line;
    };
    const Bounded numbers[] = {{0.8, 0.289, 4.0}, {0.05, 0.0, 0.5}, {top, 0.5 * top, 1.5 * top}};
    const CurveFit fit = fitCurve(y, numbers, model, blocks);
    // A pixel that sees exactly one pixel's width has σ = 1/√12; the ideal camera no width at all.
    const Bounded narrow[] = {
        {0.289, 0.289, 0.2891}, {0.0, 0.0, 1e-9}, {top, 0.5 * top, 1.5 * top}};
    const CurveFit box = fitCurve(y, narrow, model, blocks);
    std::vector<double> ideal;
    for (std::size_t i = 0; i < y.size(); ++i)
      if (isJudged(blocks[i])) ideal.push_back(y[i] - (offset[i] > 0.0 ? top : 0.0));
    table.rows.push_back({title, std::to_string(fit.judged_n), shown(fit.value[2], 0),
                          shown(summarise(ideal).rms), shown(box.judged_rms), shown(fit.judged_rms),
                          shown(fit.value[0], 2), shown(100.0 * fit.value[1], 0)});
    const std::string data = std::string{title} + ", edges of an object";
    finding.outcomes.push_back({data, fit.judged_n, summarise(ideal).rms, summarise(ideal).rms,
                                std::nan(""), box.judged_rms, fit.judged_rms});
    finding.ablations.push_back({"blur of the lens", data, fit.judged_rms, box.judged_rms});
    finding.ablations.push_back(
        {"extent of the pixel and blur", data, fit.judged_rms, summarise(ideal).rms});
    Curve left{.name = "left edge (fitted)", .ink = Ink::Baseline, .stroke = Stroke::Dots},
        right{.name = "right edge (judged)", .ink = Ink::Measured, .stroke = Stroke::Dots},
        line{.name = "fitted to the left edge", .ink = Ink::Simulated};
    for (std::size_t i = 0; i < y.size(); ++i) {
      Curve& dots = isJudged(blocks[i]) ? right : left;
      dots.x.push_back(offset[i]), dots.y.push_back(y[i]);
      if (!isJudged(blocks[i])) line.x.push_back(offset[i]), line.y.push_back(fit.prediction[i]);
    }
    figures.figures.push_back(
        {fmt::format("{}.", title), toSvg(Plot{.title = title,
                                               .x_label = "pixels from the edge",
                                               .y_label = "depth before the wall [mm]",
                                               .curves = {left, right, line},
                                               .compact = true})});
    Json json = Json::object();
    json.set("blur_px", fit.value[0])
        .set("judged_rms_mm", fit.judged_rms)
        .set("box_pixel_mm", box.judged_rms);
    finding.data.set(name, json);
  }
  double with = 0.0, without = 0.0;
  for (const Outcome& o : finding.outcomes)
    with += o.fitted_mm * o.fitted_mm, without += o.ideal_mm * o.ideal_mm;
  finding.section.verdict = fmt::format(
      "Within 8 pixels of the edge that it was not fitted to, two widths of blur leave {} of {} "
      "mm RMS.",
      shown(std::sqrt(with / 2.0)), shown(std::sqrt(without / 2.0)));
  finding.section.tone = toneOf(1.0 - with / without);
  finding.section.blocks = {
      figures, table,
      Paragraph{"The step is small against all periods, so phasors add up like depths. One edge "
                "has some 16 pixels: no errors are given.",
                true}};
  return finding;
}

}  // namespace toftwin::compare
