// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/fits.h"
#include "calib/compare/residual.h"
#include "tools/validate/judged.h"
#include "tools/validate/walls.h"

namespace toftwin::validate {

using compare::Curve;
using compare::Figure;
using compare::FigureRow;
using compare::Ink;
using compare::NoiseLaw;
using compare::Paragraph;
using compare::Plot;
using compare::quantile;
using compare::shown;
using compare::shownPercent;
using compare::Stroke;
using compare::summarise;
using compare::TableBlock;
using compare::Tone;

namespace {

using Columns = std::vector<std::vector<double>>;

double rmsLogRatio(const std::vector<double>& measured, const std::vector<double>& predicted) {
  std::vector<double> logs;
  for (std::size_t i = 0; i < measured.size(); ++i)
    logs.push_back(std::log(measured[i] / predicted[i]));
  return summarise(logs).rms;
}

/// Counts per electron that bring the simulated law closest to the measured table (least squares in
/// ln σ): a scan, then golden sections would gain nothing visible.
double bestGain(const Columns& table, const NoiseLaw& simulated) {
  double best = 1.0, least = 1e300;
  for (double log_gain = std::log(1e-8); log_gain < std::log(1e4); log_gain += 0.002) {
    const double gain = std::exp(log_gain);
    double cost = 0.0;
    for (std::size_t i = 0; i < table[0].size(); ++i)
      cost += std::pow(std::log(table[1][i] / simulated.sigma_mm(table[0][i] / gain)), 2);
    if (cost < least) least = cost, best = gain;
  }
  return best;
}

struct Against {
  std::vector<double> predicted;
  double rms_log = 0.0;
  double median_ratio = 0.0;  ///< simulated / measured
};

Result<Against> againstDistance(const Noise& what, const sim::SensorModel& model, const Columns& table) {
  const auto seed = static_cast<std::uint64_t>(what.seed);
  const auto walls = traceWalls(model, what.albedo, table[0], seed);
  if (!walls) return walls.error();
  const auto readings = readWalls(model, *walls, 500, seed);
  Against result;
  std::vector<double> ratio;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    result.predicted.push_back(readings[i].sigma_mm);
    ratio.push_back(result.predicted[i] / table[1][i]);
  }
  result.rms_log = rmsLogRatio(table[1], result.predicted);
  result.median_ratio = quantile(ratio, 0.5);
  return result;
}

/// RMS of ln(measured / simulated) over the odd rows, in per cent; the gain is fitted on the even
/// ones.
double heldOutPercent(const Columns& table, const NoiseLaw& simulated) {
  Columns fitted(2), judged(2);
  for (std::size_t i = 0; i < table[0].size(); ++i)
    for (const std::size_t column : {0u, 1u})
      (i % 2 == 0 ? fitted : judged)[column].push_back(table[column][i]);
  const double gain = bestGain(fitted, simulated);
  std::vector<double> predicted;
  for (const double counts : judged[0]) predicted.push_back(simulated.sigma_mm(counts / gain));
  return 100.0 * rmsLogRatio(judged[1], predicted);
}

/// The simulated law over amplitude, of targets of some albedos at many distances.
Result<NoiseLaw> lawOf(const Noise& what, const sim::SensorModel& model) {
  const auto seed = static_cast<std::uint64_t>(what.seed) + 1;
  std::vector<double> distances, amplitude, sigma;
  for (double d = what.nearest_mm; d < what.farthest_mm; d *= 1.12) distances.push_back(d);
  for (const double albedo : what.albedos) {
    const auto walls = traceWalls(model, albedo, distances, seed);
    if (!walls) return walls.error();
    for (const WallReading& r : readWalls(model, *walls, 300, seed)) {
      if (r.valid_share > 0.99) amplitude.push_back(r.amplitude), sigma.push_back(r.sigma_mm);
    }
  }
  if (amplitude.size() < 6)
    return Error{Error::Code::InvalidArgument,
                 "the simulated camera sees too few targets between nearest_mm and farthest_mm"};
  return compare::fitNoiseLaw(amplitude, sigma);
}

Curve sorted(const std::vector<double>& x, const std::vector<double>& y, std::string name, Ink ink,
             Stroke stroke) {
  std::vector<std::pair<double, double>> pairs;
  for (std::size_t i = 0; i < x.size(); ++i) pairs.emplace_back(x[i], y[i]);
  std::sort(pairs.begin(), pairs.end());
  Curve curve{.name = std::move(name), .ink = ink, .stroke = stroke};
  for (const auto& [a, b] : pairs) curve.x.push_back(a), curve.y.push_back(b);
  return curve;
}

Figure overSignal(const Subject& camera, const Columns& table, const NoiseLaw& measured, const NoiseLaw& simulated, double gain) {
  std::vector<double> predicted;
  for (const double counts : table[0]) predicted.push_back(simulated.sigma_mm(counts / gain));
  const auto [least, most] = std::ranges::minmax(table[0]);
  Curve curve{.name = "simulated, one gain fitted", .ink = Ink::Simulated},
      law{.name = "law fitted to the measurement", .ink = Ink::Baseline, .stroke = Stroke::Dashed};
  for (double counts = least; counts <= most; counts *= 1.03) {
    curve.x.push_back(std::log10(counts)), curve.y.push_back(simulated.sigma_mm(counts / gain));
    law.x.push_back(std::log10(counts)), law.y.push_back(measured.sigma_mm(counts));
  }
  Curve dots{.name = "measured", .y = table[1], .ink = Ink::Measured, .stroke = Stroke::Dots};
  for (const double counts : table[0]) dots.x.push_back(std::log10(counts));
  Plot plot{.title = camera.title + " noise over the signal",
            .x_label = "log10 of the signal",
            .y_label = "standard deviation [mm]",
            .curves = {dots, law, curve},
            .log_y = true,
            .compact = true,
            .below = compare::measuredLess(dots.x, table[1], predicted, compare::Rest::Ratio)};
  return {"Standard deviation of one pixel's readings against its signal.", toSvg(plot)};
}

Figure overDistance(const Subject& camera, const Columns& table, const std::vector<double>& predicted, double albedo) {
  return {"The same over distance.",
          toSvg(Plot{.title = camera.title + " noise over distance",
                     .x_label = "distance [mm]",
                     .y_label = "standard deviation [mm]",
                     .curves = {{.name = "measured", .x = table[0], .y = table[1], .ink = Ink::Measured, .stroke = Stroke::Dots},
                                sorted(table[0], predicted, fmt::format("simulated, albedo {}", albedo), Ink::Simulated,
                                       Stroke::Line)},
                     .log_y = true,
                     .compact = true,
                     .below = compare::measuredLess(table[0], table[1], predicted, compare::Rest::Ratio)})};
}

/// Each noise of the camera left out once; the gain is fitted on even rows, judged on odd ones.
Result<> addAblations(const Noise& what, const Subject& camera, const Columns& table, const NoiseLaw& simulated, Judged& judged) {
  const double with_all = heldOutPercent(table, simulated);
  const sim::SensorModel& model = camera.model;
  for (std::size_t i = 0; i < model.effects().size(); ++i) {
    const std::string name = model.effectNames()[i];
    if (name != "shot_noise" && name != "read_noise" && name != "range_noise") continue;
    std::vector<sim::AnyEffect> others = model.effects();
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const auto without = lawOf(what, model.withEffects(std::move(others)));
    if (!without) return without.error();
    judged.ablations.push_back({name, dataOf(what, camera) + " over intensity [%]", with_all, heldOutPercent(table, *without)});
  }
  return {};
}

}  // namespace

Result<Judged> judge(const Noise& what, const EffectGroup&, const Subject& camera, Task& task) {
  const auto signal = columnsOf(task, what.over_signal, {what.signal, what.sigma});
  if (!signal) return signal.error();
  const auto simulated = lawOf(what, camera.model);
  if (!simulated) return simulated.error();
  Judged judged = begun(what, camera);
  if (auto done = addAblations(what, camera, *signal, *simulated, judged); !done) return done.error();
  const NoiseLaw measured = compare::fitNoiseLaw((*signal)[0], (*signal)[1]);
  const double gain = bestGain(*signal, *simulated);
  std::vector<double> predicted;
  for (const double counts : (*signal)[0]) predicted.push_back(simulated->sigma_mm(counts / gain));
  const double rms_log = rmsLogRatio((*signal)[1], predicted);

  compare::Section& section = judged.finding.section;
  section.verdict = fmt::format(
      "Over the signal the simulated noise follows the measured one within {} (RMS of the ratio's logarithm), with one free "
      "number, counts per electron; the best law of that form leaves {}.",
      shownPercent(rms_log), shownPercent(measured.rms_log));
  section.tone = rms_log < 1.3 * measured.rms_log ? Tone::Good : rms_log < 0.5 ? Tone::Fair : Tone::Bad;
  FigureRow figures{{overSignal(camera, *signal, measured, *simulated, gain)}};
  if (!what.over_distance.empty()) {
    const auto table = columnsOf(task, what.over_distance, {what.distance, what.sigma});
    if (!table) return table.error();
    const auto distance = againstDistance(what, camera.model, *table);
    if (!distance) return distance.error();
    figures.figures.push_back(overDistance(camera, *table, distance->predicted, what.albedo));
    section.verdict += fmt::format(" Over distance, albedo {} simulated: median {} times the measured value.", what.albedo,
                                   shown(distance->median_ratio, 2));
    judged.finding.data.set("simulated_rms_log_over_distance", distance->rms_log)
        .set("median_ratio_over_distance", distance->median_ratio)
        .set("n_distance", (*table)[0].size());
  }
  section.blocks = {figures,
                    TableBlock{"σ(I) = √(a² + b²/I + c²/I²), I the signal",
                               {"", "a [mm]", "b [mm √count]", "c [mm count]", "RMS of ln ratio"},
                               {{"fitted to the measurement", shown(measured.a_mm, 2), shown(measured.b, 1),
                                 shown(measured.c, 0), shown(measured.rms_log, 3)},
                                {"simulated, in the same counts", shown(simulated->a_mm, 2),
                                 shown(simulated->b * std::sqrt(gain), 1), shown(simulated->c * gain, 0), shown(rms_log, 3)}}},
                    Paragraph{fmt::format("Gain that fits best: {:.3g} counts per electron of amplitude. Simulated: 300 readings "
                                          "of 16 pixels each.",
                                          gain),
                              true}};
  compare::TraitCollector traits;
  traits.add("noise law", "A", compare::noiseLawTraits((*signal)[0], (*signal)[1]));
  addCharacteristics(std::move(traits).found(), judged);
  addNotes(what, judged);
  judged.finding.data.set("law_a_mm", measured.a_mm)
      .set("law_b", measured.b)
      .set("law_c", measured.c)
      .set("law_rms_log", measured.rms_log)
      .set("simulated_rms_log_over_intensity", rms_log)
      .set("gain_counts_per_electron", gain)
      .set("n_intensity", (*signal)[0].size());
  judged.finding.cards.push_back({camera.title + " noise", shownPercent(rms_log),
                                  fmt::format("RMS log ratio over the signal; best law of the form {}",
                                              shownPercent(measured.rms_log)),
                                  section.tone});
  return judged;
}

}  // namespace toftwin::validate
