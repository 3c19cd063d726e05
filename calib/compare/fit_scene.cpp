// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/compare/real_fits.h"

namespace toftwin::compare {
namespace {

/// Between lines that were simulated for some albedos; beyond them, the outermost slope.
std::vector<double> atAlbedo(const std::vector<double>& albedo,
                             const std::vector<std::vector<double>>& lines, double a) {
  std::size_t i = 1;
  while (i + 1 < albedo.size() && a > albedo[i]) ++i;
  const double share = (a - albedo[i - 1]) / (albedo[i] - albedo[i - 1]);
  std::vector<double> line = lines[i - 1];
  for (std::size_t row = 0; row < line.size(); ++row)
    line[row] += share * (lines[i][row] - lines[i - 1][row]);
  return line;
}

Blocks onlyFinite(Blocks blocks, const std::vector<double>& a, const std::vector<double>& b) {
  for (std::size_t i = 0; i < blocks.size(); ++i)
    if (!std::isfinite(a[i] + b[i])) blocks[i] = -1;
  return blocks;
}

/// What an emitter at x does to the range of direct light beside one in the lens. [mm]
double baselineError(double t, double range_mm, double x_mm) {
  const double s = t / std::sqrt(1.0 + t * t);
  return 0.5 *
         (std::sqrt(range_mm * range_mm - 2.0 * range_mm * s * x_mm + x_mm * x_mm) - range_mm);
}

struct CornerModel {
  std::string name;
  bool fits_albedo, fits_constant, fits_emitter;
  bool multipath = true;
};

/// Numbers: albedo, constant in mm, emitter's shift in mm, as far as the model fits them.
CurveFit fitCorner(const CornerLines& lines, const CornerModel& model, const Blocks& blocks) {
  std::vector<Bounded> numbers;
  if (model.fits_albedo) numbers.push_back({0.8, 0.3, 1.0});
  if (model.fits_constant) numbers.push_back({0.0, -200.0, 200.0});
  if (model.fits_emitter) numbers.push_back({0.0, -300.0, 300.0});
  return fitCurve(
      lines.measured_mm, numbers,
      [&](std::span<const double> x) {
        std::size_t at = 0;
        std::vector<double> line = !model.multipath ? lines.direct_mm
                                   : model.fits_albedo
                                       ? atAlbedo(lines.albedo, lines.simulated_mm, x[at++])
                                       : lines.as_is_mm;
        const double constant = model.fits_constant ? x[at++] : 0.0,
                     shift = model.fits_emitter ? x[at++] : 0.0;
        for (std::size_t i = 0; i < line.size(); ++i)
          line[i] += constant +
                     baselineError(lines.t[i], lines.truth_mm[i], lines.emitter_x_mm + shift) -
                     baselineError(lines.t[i], lines.truth_mm[i], lines.emitter_x_mm);
        return line;
      },
      blocks);
}

}  // namespace

void addCornerFit(const RealCamera& camera, const CornerLines& lines, Finding& finding) {
  constexpr std::size_t kRows = 20;
  const Blocks blocks =
      onlyFinite(blocksOfRows(lines.t.size(), kRows), lines.measured_mm, lines.as_is_mm);
  const CornerModel all{"albedo, constant, emitter's place", true, true, true};
  const CornerModel models[] = {{"the constant", false, true, false},
                                {"albedo", true, false, false},
                                {"albedo and constant", true, true, false},
                                all};
  TableBlock table{
      fmt::format("Fitted on alternate blocks of {} rays, judged on the others; RMS in mm", kRows),
      {"fitted", "fitted half", "judged half", "albedo", "constant [mm]",
       "emitter's shift along x [mm]"},
      {}};
  const std::vector<double> nothing(lines.t.size(), 0.0);
  table.rows.push_back({"nothing: ideal camera", "–",
                        shown(judgedRms(lines.measured_mm, nothing, blocks)), "–", "–", "–"});
  table.rows.push_back({"nothing: preset", "–",
                        shown(judgedRms(lines.measured_mm, lines.as_is_mm, blocks)), "0.8", "0",
                        "0"});
  for (const CornerModel& model : models) {
    const CurveFit fit = fitCorner(lines, model, blocks);
    std::size_t at = 0;
    const auto cell = [&](bool fits, int decimals) {
      if (!fits) return std::string{"–"};
      const std::size_t i = at++;
      return shownFitted(fit.value[i], fit.error[i], decimals);
    };
    const std::string albedo = cell(model.fits_albedo, 2), constant = cell(model.fits_constant, 1),
                      emitter = cell(model.fits_emitter, 0);
    table.rows.push_back(
        {model.name, shown(fit.fitted_rms), shown(fit.judged_rms), albedo, constant, emitter});
  }
  const CurveFit best = fitCorner(lines, all, blocks);
  const CornerModel ideal{"", false, true, false, false};
  const std::string data = camera.title + ", corner";
  finding.outcomes.push_back({data, best.judged_n, judgedRms(lines.measured_mm, nothing, blocks),
                              fitCorner(lines, ideal, blocks).judged_rms, std::nan(""),
                              judgedRms(lines.measured_mm, lines.as_is_mm, blocks),
                              best.judged_rms});
  const auto without = [&](const char* effect, const CornerModel& model) {
    finding.ablations.push_back(
        {effect, data, best.judged_rms, fitCorner(lines, model, blocks).judged_rms});
  };
  without("multipath", {"", false, true, true, false});
  without("constant delay", {"", true, false, true});
  without("emitter's place (or the reference's registration)", {"", true, true, false});
  finding.section.blocks.push_back(table);
  finding.section.blocks.push_back(
      Paragraph{"± is a jackknife over the fitted blocks. An emitter's shift is nearly linear in "
                "the ray's angle, and so "
                "is a turn of the structured-light reference against the camera: the data cannot "
                "tell them apart.",
                true});
  Json json = Json::object();
  json.set("albedo", best.value[0])
      .set("albedo_error", best.error[0])
      .set("constant_mm", best.value[1]);
  json.set("emitter_shift_mm", best.value[2]).set("judged_rms_mm", best.judged_rms);
  finding.data.set("held_out", json);
}

void addBoxFit(const BoxLines& lines, Finding& finding) {
  constexpr std::size_t kRows = 8;
  const auto within = [&](double near_mm, double far_mm) {
    Blocks blocks = blocksOfRows(lines.place_mm.size(), kRows);
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const double place = std::abs(lines.place_mm[i]);
      if (place < near_mm || place > far_mm || lines.place_mm[i] == 0.0) blocks[i] = -1;
    }
    return onlyFinite(blocks, lines.measured_mm, lines.published_mm);
  };
  const Blocks blocks = within(15.0, 250.0);
  // Numbers: the box's albedo, a constant (the two captures' drift), the share of the mirrored
  // emitter.
  const auto fit = [&](bool fits_constant, bool fits_side, double side) {
    std::vector<Bounded> numbers{{0.5, 0.05, 2.0}};
    if (fits_constant) numbers.push_back({0.0, -20.0, 20.0});
    if (fits_side) numbers.push_back({0.5, -3.0, 4.0});
    return fitCurve(
        lines.measured_mm, numbers,
        [&, fits_constant, fits_side, side](std::span<const double> x) {
          std::vector<double> line = atAlbedo(lines.albedo, lines.preset_mm, x[0]);
          const std::vector<double> mirrored = atAlbedo(lines.albedo, lines.mirrored_mm, x[0]);
          const double share = fits_side ? x.back() : side;
          for (std::size_t i = 0; i < line.size(); ++i)
            line[i] += share * (mirrored[i] - line[i]) + (fits_constant ? x[1] : 0.0);
          return line;
        },
        blocks);
  };
  const std::vector<double> nothing(lines.place_mm.size(), 0.0);
  const std::vector<double> as_is = atAlbedo(lines.albedo, lines.preset_mm, lines.assumed_albedo);
  TableBlock table{
      fmt::format("Fitted on alternate blocks of {} rays, judged on the others, 15–250 mm "
                  "beside the box; RMS in mm",
                  kRows),
      {"fitted", "fitted half", "judged half", "box's albedo", "constant [mm]",
       "share of the mirrored emitter"},
      {}};
  table.rows.push_back({"nothing: the box changes nothing", "–",
                        shown(judgedRms(lines.measured_mm, nothing, blocks), 2), "–", "–", "–"});
  table.rows.push_back({"nothing: preset", "–",
                        shown(judgedRms(lines.measured_mm, as_is, blocks), 2),
                        shown(lines.assumed_albedo, 1), "0", "0"});
  table.rows.push_back({"nothing: published simulator", "–",
                        shown(judgedRms(lines.measured_mm, lines.published_mm, blocks), 2), "–",
                        "–", "–"});
  const CurveFit albedo = fit(false, false, 0.0), mirrored = fit(false, false, 1.0),
                 constant = fit(true, false, 0.0), constant_mirrored = fit(true, false, 1.0),
                 side = fit(true, true, 0.0);
  const auto row = [&](const char* name, const CurveFit& f, bool has_constant,
                       const std::string& share) {
    table.rows.push_back({name, shown(f.fitted_rms, 2), shown(f.judged_rms, 2),
                          shownFitted(f.value[0], f.error[0], 2),
                          has_constant ? shownFitted(f.value[1], f.error[1], 2) : "0", share});
  };
  row("albedo, emitter at +x (preset)", albedo, false, "0");
  row("albedo, emitter at −x", mirrored, false, "1");
  row("albedo and constant, emitter at +x", constant, true, "0");
  row("albedo and constant, emitter at −x", constant_mirrored, true, "1");
  row("albedo, constant and side", side, true, shownFitted(side.value[2], side.error[2], 2));
  const CurveFit& best =
      constant.fitted_rms < constant_mirrored.fitted_rms ? constant : constant_mirrored;
  finding.section.blocks.push_back(table);

  // The shadow itself, right beside the edges, was not fitted.
  TableBlock shadow{
      "The emitter's shadow, 3–15 mm beside the box, was not fitted: one emitter at x, box of "
      "albedo 0.8, no "
      "constant; RMS left over these rays, mm",
      {"emitter at x [mm]", "left of the box", "right of the box", "both"},
      {}};
  const auto besides = [&](const std::vector<double>& line, double sign) {
    std::vector<double> left;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const double place = sign * lines.place_mm[i];
      if (place >= 3.0 && place <= 15.0 && std::isfinite(line[i]))
        left.push_back(lines.measured_mm[i] - line[i]);
    }
    return summarise(left).rms;
  };
  const auto shadowRow = [&](const std::string& name, const std::vector<double>& line) {
    const double l = besides(line, -1.0), r = besides(line, 1.0);
    shadow.rows.push_back({name, shown(l), shown(r), shown(std::sqrt(0.5 * (l * l + r * r)))});
  };
  shadowRow("ideal camera", nothing);
  for (std::size_t i = 0; i < lines.emitter_x_mm.size(); ++i)
    shadowRow(shown(lines.emitter_x_mm[i], 0), lines.by_emitter_mm[i]);
  shadowRow("published simulator (−20, −25, −30)", lines.published_mm);
  finding.section.blocks.push_back(shadow);
  const std::string data = "Kinect v2, wall beside a box";
  const std::vector<Term> only_constant{{"", std::vector<double>(nothing.size(), 1.0)}};
  const LinearFit ideal = fitLinear(lines.measured_mm, only_constant, blocks);
  finding.outcomes.push_back({data, best.judged_n, judgedRms(lines.measured_mm, nothing, blocks),
                              ideal.judged_rms,
                              judgedRms(lines.measured_mm, lines.published_mm, blocks),
                              judgedRms(lines.measured_mm, as_is, blocks), best.judged_rms});
  finding.ablations.push_back({"multipath", data, best.judged_rms, ideal.judged_rms});
  finding.ablations.push_back({"constant between the two captures", data, best.judged_rms,
                               std::min(albedo.judged_rms, mirrored.judged_rms)});
  Json json = Json::object();
  json.set("albedo", best.value[0])
      .set("constant_mm", best.value[1])
      .set("judged_rms_mm", best.judged_rms);
  json.set("side_share", side.value[2]).set("side_share_error", side.error[2]);
  finding.data.set("held_out", json);
}

}  // namespace toftwin::compare
