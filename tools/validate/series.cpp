// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "calib/compare/residual.h"
#include "tools/validate/free_numbers.h"
#include "tools/validate/judged.h"
#include "tools/validate/walls.h"
#include "tools/validate/warm_up_fit.h"

namespace toftwin::validate {

using compare::Curve;
using compare::Figure;
using compare::Ink;
using compare::Json;
using compare::Paragraph;
using compare::Plot;
using compare::Running;
using compare::shown;
using compare::Stroke;
using compare::summarise;
using compare::TableBlock;
using compare::Tone;

namespace {

struct Readings {
  std::vector<double> time_s, depth_mm;
};

template <class Belongs>
Readings part(const Readings& whole, const Belongs& belongs) {
  Readings result;
  for (std::size_t i = 0; i < whole.time_s.size(); ++i) {
    if (belongs(whole.time_s[i]))
      result.time_s.push_back(whole.time_s[i]), result.depth_mm.push_back(whole.depth_mm[i]);
  }
  return result;
}

double rmsOf(const WarmUpFit& fit, const Readings& series) {
  std::vector<double> residual;
  for (std::size_t i = 0; i < series.time_s.size(); ++i)
    residual.push_back(series.depth_mm[i] - fit.depth_mm(series.time_s[i]));
  return summarise(residual).rms;
}

/// What the camera, simulated with that warm-up before a wall where the series has it, leaves of `judged`;
/// the constant is of `fitted`.
Result<double> simulatedRms(const sim::SensorModel& camera, double albedo, const WarmUpFit& fit,
                            const Readings& fitted, const Readings& judged) {
  const sim::SensorModel warming = withMore(camera, {fit.effect}, true);
  const auto wall = traceWalls(warming, albedo, {fit.warm_mm}, 21);
  if (!wall) return wall.error();
  const auto residual = [&](const Readings& series) {
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
double jitter(const Readings& series) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < series.depth_mm.size(); ++i)
    steps.push_back(series.depth_mm[i] - series.depth_mm[i - 1]);
  return summarise(steps).rms / std::sqrt(2.0);
}

Curve curveOf(const WarmUpFit& fit, const Readings& series, std::string name, Ink ink, Stroke stroke) {
  Curve curve{.name = std::move(name), .x = series.time_s, .ink = ink, .stroke = stroke};
  for (const double t : series.time_s) curve.y.push_back(fit.depth_mm(t));
  return curve;
}

/// The preset's own warm-up, if it has one, moved by a constant onto the series: only the shape
/// counts here.
std::optional<WarmUpFit> presetFit(const sim::SensorModel& model, const Readings& series) {
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
  const char *name, *how;
  Readings fitted, judged;
  WarmUpFit flat, one, two;  ///< of the fitted part: no drift, one exponential, two

  Split(const char* its_name, const char* is_how, Readings to_fit, Readings to_judge)
      : name(its_name), how(is_how), fitted(std::move(to_fit)), judged(std::move(to_judge)) {
    WarmUpFit* fits[] = {&flat, &one, &two};
    for (int exponentials = 0; exponentials < 3; ++exponentials)
      *fits[exponentials] = fitWarmUp(fitted.time_s, fitted.depth_mm, exponentials);
  }
};

TableBlock splitTable(const Split& within, const Split& ahead, const std::optional<WarmUpFit>& preset, Json& data) {
  TableBlock table{"Root mean square error of the reading, mm",
                   {"part", "model", "fitted part [mm]", "held-out part [mm]"},
                   {}};
  for (const Split* split : {&within, &ahead}) {
    Json json = Json::object();
    for (const auto& [name, key, fit] : {std::tuple{"flat (no drift)", "flat", &split->flat},
                                         std::tuple{"one exponential", "one", &split->one},
                                         std::tuple{"two exponentials (the effect)", "two", &split->two}}) {
      const double held_out = rmsOf(*fit, split->judged);
      table.rows.push_back({split->name, name, shown(fit->rms_mm, 2), shown(held_out, 2)});
      json.set(std::string{key} + "_fitted_rms_mm", fit->rms_mm).set(std::string{key} + "_held_out_rms_mm", held_out);
    }
    data.set(split->name, json);
  }
  if (!preset) return table;
  table.rows.push_back({"whole series", "the preset, moved by a constant", shown(preset->rms_mm, 2), "–"});
  data.set("preset_rms_mm", preset->rms_mm);
  return table;
}

Figure figureOf(const Subject& camera, const Readings& all, const Split& within, const Split& ahead) {
  const Curve fitted = curveOf(within.two, all, "warm-up effect, fitted on even blocks", Ink::Simulated, Stroke::Line);
  const WarmUpFit& flat = within.flat;
  return {"Reading of a fixed wall since power-on. Below: less the effect fitted on even blocks.",
          toSvg(Plot{.title = camera.title + " warm-up",
                     .x_label = "time since power-on [s]",
                     .y_label = "reading of a fixed wall [mm]",
                     .curves = {{.name = "measured", .x = all.time_s, .y = all.depth_mm, .ink = Ink::Measured,
                                 .stroke = Stroke::Dots},
                                curveOf(flat, all, "flat model", Ink::Baseline, Stroke::Dashed), fitted,
                                curveOf(ahead.two, all, "warm-up effect, fitted on the first half", Ink::Extra,
                                        Stroke::Dotted)},
                     .below = compare::measuredLess(all.time_s, all.depth_mm, fitted.y)})};
}

std::string fitInWords(const sim::WarmUp& effect) {
  return fmt::format("The effect fitted on the even blocks: {} mm with {} s and {} mm with {} s.",
                     shown(effect.fast.in(millimetre), 2), shown(effect.fast_time.in(second), 0),
                     shown(effect.slow.in(millimetre), 2), shown(effect.slow_time.in(second), 0));
}

}  // namespace

Result<Judged> judge(const Series& what, const EffectGroup&, const Subject& camera, Task& task) {
  const auto columns = columnsOf(task, what.file, {what.time, what.value});
  if (!columns) return columns.error();
  const Readings all{(*columns)[0], (*columns)[1]};
  if (all.time_s.size() < 20) return Error{Error::Code::InvalidArgument, what.file + ": fewer than 20 readings"};
  const double end = all.time_s.back(), half = 0.5 * (all.time_s.front() + end);
  const auto odd = [&](double t) { return static_cast<long>(t / what.block_s) % 2 != 0; };
  const Split within{"interpolation", "fitted on the even blocks, judged on the odd ones",
                     part(all, [&](double t) { return !odd(t); }), part(all, odd)},
      ahead{"extrapolation", "fitted on the first half, judged on the second",
            part(all, [&](double t) { return t < half; }), part(all, [&](double t) { return t >= half; })};
  for (const Readings* half_of : {&within.fitted, &within.judged, &ahead.fitted, &ahead.judged}) {
    if (half_of->time_s.size() < 4)
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{}: blocks of {} s leave a half of fewer than four rows; set block_s", what.file, what.block_s)};
  }

  Judged judged = begun(what, camera);
  compare::Section& section = judged.finding.section;
  const auto preset = presetFit(camera.model, all);
  const TableBlock table = splitTable(within, ahead, preset, judged.finding.data);
  const Readings first = part(all, [&](double t) { return t < all.time_s.front() + what.block_s; }),
                 last = part(all, [&](double t) { return t > end - what.block_s; });
  const double drift = summarise(last.depth_mm).mean - summarise(first.depth_mm).mean, floor = jitter(all);
  const double flat_rms = rmsOf(within.flat, within.judged), drift_rms = rmsOf(within.two, within.judged),
               flat_ahead = rmsOf(ahead.flat, ahead.judged), drift_ahead = rmsOf(ahead.two, ahead.judged);
  section.verdict = fmt::format(
      "From the first to the last {} s the reading moves by {} mm. On blocks it was not fitted to, the warm-up effect leaves {} mm "
      "RMS where a flat model leaves {} mm; {} mm is the reading's own jitter from one row to the next.",
      shown(what.block_s, 0), shown(drift), shown(drift_rms, 2), shown(flat_rms, 2), shown(floor, 2));
  section.tone = drift_rms < 1.3 * floor ? Tone::Good : toneOf(1.0 - drift_rms * drift_rms / (flat_rms * flat_rms));
  section.blocks = {figureOf(camera, all, within, ahead), table,
                    Paragraph{fmt::format("{} Interpolation: {}. Extrapolation: {}.{}", fitInWords(within.two.effect), within.how,
                                          ahead.how, preset ? "" : " The preset of this camera has no warm-up effect."),
                              true}};
  compare::TraitCollector traits;
  traits.add({"drift", "A", all.time_s, all.depth_mm}, compare::driftTraits(all.time_s, all.depth_mm));
  addCharacteristics(std::move(traits).found(), judged);
  addNotes(what, judged);
  judged.finding.data.set("drift_mm", drift).set("jitter_mm", floor).set("samples", all.time_s.size());
  const auto simulated_ahead =
      simulatedRms(withoutNoise(camera.model), what.albedo, ahead.two, ahead.fitted, ahead.judged);
  if (!simulated_ahead) return simulated_ahead.error();
  const std::string data = dataOf(what, camera) + ", second half from the first";
  judged.outcomes.push_back({.data = data,
                             .judged = ahead.judged.time_s.size(),
                             .ideal_mm = flat_ahead,
                             .constant_mm = flat_ahead,
                             .fitted_mm = *simulated_ahead});
  judged.ablations.push_back({"warm_up", data, *simulated_ahead, flat_ahead});
  // A flat model at the jitter leaves nothing that the effect could be good at.
  const bool is_flat = flat_ahead < 1.3 * floor;
  judged.finding.cards.push_back(
      {camera.title + " warm-up", shown(drift_ahead, 2) + " mm",
       is_flat ? fmt::format("second half, RMS; no drift to find: flat model {} mm, jitter {} mm", shown(flat_ahead, 2),
                             shown(floor, 2))
               : fmt::format("RMS of the second half, fitted on the first; flat model {} mm", shown(flat_ahead, 2)),
       is_flat ? Tone::Neutral : section.tone});
  return judged;
}

}  // namespace toftwin::validate
