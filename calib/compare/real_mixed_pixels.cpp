// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "calib/compare/held_out.h"
#include "calib/compare/real_data.h"
#include "calib/compare/residual.h"

namespace toftwin::compare {
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
      {"camera", "n judged", "step [mm]", "ideal camera", "box pixel alone", "with blur", "blur σ [px]",
       "wide part [%]"},
      {}};
  FigureRow figures;
  for (const auto& [name, title] : {std::pair{"kinect_v2", "Kinect v2"}, std::pair{"o3d303", "O3D303"}}) {
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
      const double at = static_cast<double>(i - 1) + (half - depth[i - 1]) / (depth[i] - depth[i - 1]);
      if (depth[i - 1] < half && depth[i] >= half && std::isnan(left_edge)) left_edge = at;
      if (depth[i - 1] >= half && depth[i] < half) right_edge = at;
    }
    if (!(left_edge < right_edge))
      return Error{Error::Code::InvalidArgument,
                   fmt::format("mixed_pixels/{}.csv shows no object before the wall", name)};
    for (const bool right : {false, true}) {
      for (std::size_t i = 0; i < depth.size(); ++i) {
        const double n = right ? right_edge - static_cast<double>(i) : static_cast<double>(i) - left_edge;
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
    const Bounded narrow[] = {{0.289, 0.289, 0.2891}, {0.0, 0.0, 1e-9}, {top, 0.5 * top, 1.5 * top}};
    const CurveFit box = fitCurve(y, narrow, model, blocks);
    std::vector<double> ideal;
    for (std::size_t i = 0; i < y.size(); ++i)
      if (isJudged(blocks[i])) ideal.push_back(y[i] - (offset[i] > 0.0 ? top : 0.0));
    table.rows.push_back({title, std::to_string(fit.judged_n), shown(fit.value[2], 0),
                          shown(summarise(ideal).rms), shown(box.judged_rms), shown(fit.judged_rms),
                          shown(fit.value[0], 2), shown(100.0 * fit.value[1], 0)});
    const std::string data = std::string{title} + ", edges of an object";
    const double none = std::nan("");
    finding.outcomes.push_back({.data = data,
                                .judged = fit.judged_n,
                                .ideal_mm = summarise(ideal).rms,
                                .constant_mm = summarise(ideal).rms,
                                .published_mm = none,
                                .as_is_mm = none,
                                .fitted_mm = fit.judged_rms,
                                .is_by_law = true});
    finding.ablations.push_back({"blur of the lens", data, fit.judged_rms, box.judged_rms});
    finding.ablations.push_back({"extent of the pixel and blur", data, fit.judged_rms, summarise(ideal).rms});
    Curve left{.name = "left edge (fitted)", .ink = Ink::Baseline, .stroke = Stroke::Dots},
        right{.name = "right edge (judged)", .ink = Ink::Measured, .stroke = Stroke::Dots},
        line{.name = "fitted to the left edge", .ink = Ink::Simulated};
    for (std::size_t i = 0; i < y.size(); ++i) {
      Curve& dots = isJudged(blocks[i]) ? right : left;
      dots.x.push_back(offset[i]), dots.y.push_back(y[i]);
      if (!isJudged(blocks[i])) line.x.push_back(offset[i]), line.y.push_back(fit.prediction[i]);
    }
    figures.figures.push_back({fmt::format("{}.", title), toSvg(Plot{.title = title,
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
