// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>
#include <variant>

#include <fmt/format.h>

#include "calib/compare/fits.h"
#include "calib/compare/real_data.h"
#include "calib/compare/residual.h"
#include "calib/compare/simulated_line.h"
#include "calib/compare/simulated_wall.h"
#include "calib/table/table.h"
#include "sim/sensor/sensor_model.h"

namespace toftwin::compare {
namespace {

struct Series {
  std::vector<double> time_s, depth_mm;
};

template <class Belongs>
Series part(const Series& whole, const Belongs& belongs) {
  Series result;
  for (std::size_t i = 0; i < whole.time_s.size(); ++i) {
    if (belongs(whole.time_s[i]))
      result.time_s.push_back(whole.time_s[i]), result.depth_mm.push_back(whole.depth_mm[i]);
  }
  return result;
}

double rmsOf(const WarmUpFit& fit, const Series& series) {
  std::vector<double> residual;
  for (std::size_t i = 0; i < series.time_s.size(); ++i)
    residual.push_back(series.depth_mm[i] - fit.depth_mm(series.time_s[i]));
  return summarise(residual).rms;
}

/// What the camera, simulated with that warm-up before a wall where the series has it, leaves of `judged`;
/// the constant is of `fitted`.
Result<double> simulatedRms(const sim::SensorModel& camera, const WarmUpFit& fit, const Series& fitted,
                            const Series& judged) {
  const sim::SensorModel warming = withEffect(camera, fit.effect);
  const auto wall = traceWalls(warming, 0.8, {fit.warm_mm}, 21);
  if (!wall) return wall.error();
  const auto residual = [&](const Series& series) {
    std::vector<double> left;
    Moment moment;
    for (std::size_t i = 0; i < series.time_s.size(); ++i) {
      moment.since_power_on = series.time_s[i] * second;
      left.push_back(series.depth_mm[i] - readRanges(warming, *wall, moment).front());
    }
    return left;
  };
  const double constant = summarise(residual(fitted)).mean;
  std::vector<double> left = residual(judged);
  for (double& one : left) one -= constant;
  return summarise(left).rms;
}

/// What no model of time can explain: the reading's own jitter from one second to the next, sd =
/// rms step / √2.
double jitter(const Series& series) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < series.depth_mm.size(); ++i)
    steps.push_back(series.depth_mm[i] - series.depth_mm[i - 1]);
  return summarise(steps).rms / std::sqrt(2.0);
}

Curve curveOf(const WarmUpFit& fit, const Series& series, std::string name, Ink ink, Stroke stroke) {
  Curve curve{.name = std::move(name), .x = series.time_s, .ink = ink, .stroke = stroke};
  for (const double t : series.time_s) curve.y.push_back(fit.depth_mm(t));
  return curve;
}

/// The preset's own warm-up, if it has one, moved by a constant onto the series: only the shape
/// counts here.
std::optional<WarmUpFit> presetFit(const sim::SensorModel& model, const Series& series) {
  for (const sim::AnyEffect& effect : model.effects()) {
    if (const auto* warm_up = std::get_if<sim::WarmUp>(&effect)) {
      WarmUpFit fit{.warm_mm = 0.0, .effect = *warm_up, .rms_mm = 0.0};
      Running offset;
      for (std::size_t i = 0; i < series.time_s.size(); ++i) {
        offset.add(series.depth_mm[i] - fit.depth_mm(series.time_s[i]));
      }
      fit.warm_mm = offset.mean();
      fit.rms_mm = rmsOf(fit, series);
      return fit;
    }
  }
  return std::nullopt;
}

struct Split {
  const char* name;
  const char* how;
  Series fitted, judged;
};

}  // namespace

Result<Finding> judgeWarmUp(const RealDataJob& job, const RealCamera& camera) {
  const auto columns =
      table::readNumbers(job.folder / "warmup_drift" / (camera.name + ".csv"), {"time_s", "depth_mm"});
  if (!columns) return columns.error();
  const Series all{(*columns)[0], (*columns)[1]};
  const double end = all.time_s.back(), half = 0.5 * (all.time_s.front() + end);
  const auto odd = [](double t) { return static_cast<long>(t / 60.0) % 2 != 0; };
  const Split splits[] = {
      {"interpolation", "fitted on the even minutes, judged on the odd ones",
       part(all, [&](double t) { return !odd(t); }), part(all, odd)},
      {"extrapolation", "fitted on the first half, judged on the second",
       part(all, [&](double t) { return t < half; }), part(all, [&](double t) { return t >= half; })}};

  Finding finding;
  finding.section = {.id = "warm-up-" + camera.name, .title = camera.title + ": warm-up"};
  TableBlock table{"Root mean square error of the depth reading, mm",
                   {"part", "model", "fitted part [mm]", "held-out part [mm]"},
                   {}};
  double flat_rms = 0.0, drift_rms = 0.0, flat_ahead = 0.0, drift_ahead = 0.0;
  std::size_t judged_ahead = 0;
  for (const Split& split : splits) {
    Json data = Json::object();
    for (const auto& [name, key, exponentials] :
         {std::tuple{"flat (no drift)", "flat", 0}, std::tuple{"one exponential", "one", 1},
          std::tuple{"two exponentials (the effect)", "two", 2}}) {
      const WarmUpFit fit = fitWarmUp(split.fitted.time_s, split.fitted.depth_mm, exponentials);
      const double held_out = rmsOf(fit, split.judged);
      table.rows.push_back({split.name, name, shown(fit.rms_mm, 2), shown(held_out, 2)});
      data.set(std::string{key} + "_fitted_rms_mm", fit.rms_mm)
          .set(std::string{key} + "_held_out_rms_mm", held_out);
      if (split.name == splits[0].name) (exponentials == 0 ? flat_rms : drift_rms) = held_out;
      if (split.name == splits[1].name) (exponentials == 0 ? flat_ahead : drift_ahead) = held_out;
      judged_ahead = split.judged.time_s.size();
    }
    finding.data.set(split.name, data);
  }
  const WarmUpFit shown_fit = fitWarmUp(splits[0].fitted.time_s, splits[0].fitted.depth_mm, 2);
  const WarmUpFit extrapolated = fitWarmUp(splits[1].fitted.time_s, splits[1].fitted.depth_mm, 2);
  const WarmUpFit flat = fitWarmUp(splits[0].fitted.time_s, splits[0].fitted.depth_mm, 0);
  const auto model = sim::SensorModel::preset(camera.name);
  if (!model) return model.error();
  const auto preset = presetFit(*model, all);
  if (preset) {
    table.rows.push_back({"whole series", "the preset, moved by a constant", shown(preset->rms_mm, 2), "–"});
    finding.data.set("preset_rms_mm", preset->rms_mm);
  }
  const Series first = part(all, [&](double t) { return t < all.time_s.front() + 60.0; }),
               last = part(all, [&](double t) { return t > end - 60.0; });
  const double drift = summarise(last.depth_mm).mean - summarise(first.depth_mm).mean, floor = jitter(all);

  const Plot plot{.title = camera.title + " warm-up",
                  .x_label = "time since power-on [s]",
                  .y_label = "depth of a fixed wall [mm]",
                  .curves = {{.name = "measured",
                              .x = all.time_s,
                              .y = all.depth_mm,
                              .ink = Ink::Measured,
                              .stroke = Stroke::Dots},
                             curveOf(flat, all, "flat model", Ink::Baseline, Stroke::Dashed),
                             curveOf(shown_fit, all, "warm-up effect, fitted on even minutes", Ink::Simulated,
                                     Stroke::Line),
                             curveOf(extrapolated, all, "warm-up effect, fitted on the first half",
                                     Ink::Extra, Stroke::Dotted)},
                  .below = measuredLess(all.time_s, all.depth_mm,
                                        curveOf(shown_fit, all, "", Ink::Simulated, Stroke::Line).y)};
  const double explained = 1.0 - drift_rms * drift_rms / (flat_rms * flat_rms);
  finding.section.verdict = fmt::format(
      "From the first to the last minute the reading moves by {} mm. On minutes it was not fitted "
      "to, the warm-up effect leaves {} mm "
      "RMS where a flat model leaves {} mm; {} mm is the reading's own jitter from second to "
      "second.",
      shown(drift), shown(drift_rms, 2), shown(flat_rms, 2), shown(floor, 2));
  finding.section.tone = drift_rms < 1.3 * floor ? Tone::Good : toneOf(explained);
  finding.section.blocks = {
      Figure{"Cold start before a fixed wall, centre pixel. Dots: measured, one a second. Below: "
             "less the effect fitted on even minutes.",
             toSvg(plot)},
      table,
      Paragraph{
          fmt::format(
              "The effect fitted on the even minutes: {} mm with {} s and {} mm with "
              "{} s. {}. {}. {}",
              shown(shown_fit.effect.fast.in(millimetre), 2), shown(shown_fit.effect.fast_time.in(second), 0),
              shown(shown_fit.effect.slow.in(millimetre), 2), shown(shown_fit.effect.slow_time.in(second), 0),
              std::string{"Interpolation: "} + splits[0].how, std::string{"Extrapolation: "} + splits[1].how,
              preset ? "The preset's own warm-up was taken from this series, so its "
                       "row is a check of the preset and no test."
                     : "The preset of this camera has no warm-up effect."),
          true}};
  TraitCollector traits;
  traits.add({"drift", "A", all.time_s, all.depth_mm}, driftTraits(all.time_s, all.depth_mm));
  addCharacteristics(std::move(traits).found(), finding);
  finding.data.set("drift_mm", drift).set("jitter_mm", floor).set("samples", all.time_s.size());
  const auto simulated_ahead =
      simulatedRms(withoutNoise(*model), extrapolated, splits[1].fitted, splits[1].judged);
  if (!simulated_ahead) return simulated_ahead.error();
  const std::string ahead = camera.title + ", warm-up, second half from the first";
  finding.outcomes.push_back(
      {ahead, judged_ahead, flat_ahead, flat_ahead, std::nan(""), std::nan(""), *simulated_ahead});
  finding.ablations.push_back({"warm_up", ahead, *simulated_ahead, flat_ahead});
  // A flat model at the jitter leaves nothing that the effect could be good at.
  const bool is_flat = flat_ahead < 1.3 * floor;
  finding.cards.push_back(
      {camera.title + " warm-up", shown(drift_ahead, 2) + " mm",
       is_flat ? fmt::format("second half, RMS; no drift to find: flat model {} mm, jitter {} mm",
                             shown(flat_ahead, 2), shown(floor, 2))
               : fmt::format("RMS of the second half, fitted on the first; flat model {} mm",
                             shown(flat_ahead, 2)),
       is_flat ? Tone::Neutral : finding.section.tone});
  return finding;
}

}  // namespace toftwin::compare
