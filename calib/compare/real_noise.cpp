// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/compare/fits.h"
#include "calib/compare/real_data.h"
#include "calib/compare/residual.h"
#include "calib/compare/simulated_wall.h"
#include "calib/table/table.h"

namespace toftwin::compare {
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

Result<Against> againstDistance(const sim::SensorModel& model, const Columns& table) {
  const auto walls = traceWalls(model, 0.8, table[0], 61);
  if (!walls) return walls.error();
  const auto readings = readWalls(model, *walls, 500, 61);
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

/// The simulated law over amplitude: white, grey and black paper at many distances.
Result<NoiseLaw> lawOf(const sim::SensorModel& model) {
  std::vector<double> distances, amplitude, sigma;
  for (double d = 550.0; d < 4500.0; d *= 1.12) distances.push_back(d);
  for (const double albedo : {0.8, 0.2, 0.05}) {
    const auto walls = traceWalls(model, albedo, distances, 62);
    if (!walls) return walls.error();
    for (const WallReading& r : readWalls(model, *walls, 300, 62)) {
      if (r.valid_share > 0.99) amplitude.push_back(r.amplitude), sigma.push_back(r.sigma_mm);
    }
  }
  if (amplitude.size() < 6)
    return Error{Error::Code::InvalidArgument,
                 "the simulated camera sees too few walls between 0.55 and 4.5 m"};
  return fitNoiseLaw(amplitude, sigma);
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

}  // namespace

Result<Finding> judgeNoise(const RealDataJob& job, const RealCamera& camera) {
  const auto over_distance = table::readNumbers(
      job.folder / "noise" / (camera.name + "_sigma_vs_distance.csv"), {"distance_mm", "sigma_mm"});
  if (!over_distance) return over_distance.error();
  const auto over_intensity =
      table::readNumbers(job.folder / "noise" / (camera.name + "_sigma_vs_intensity.csv"),
                  {"intensity_counts", "sigma_mm"});
  if (!over_intensity) return over_intensity.error();
  const auto model = sim::SensorModel::preset(camera.name);
  if (!model) return model.error();
  const auto distance = againstDistance(*model, *over_distance);
  if (!distance) return distance.error();
  const auto simulated = lawOf(*model);
  if (!simulated) return simulated.error();
  Finding finding;
  const double with_all = heldOutPercent(*over_intensity, *simulated);
  for (std::size_t i = 0; i < model->effects().size(); ++i) {
    const std::string name = model->effectNames()[i];
    if (name != "shot_noise" && name != "read_noise" && name != "range_noise") continue;
    std::vector<sim::AnyEffect> others = model->effects();
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const auto without = lawOf(model->withEffects(std::move(others)));
    if (!without) return without.error();
    finding.ablations.push_back({name, camera.title + ", noise over intensity [%]", with_all,
                                 heldOutPercent(*over_intensity, *without)});
  }
  const NoiseLaw measured = fitNoiseLaw((*over_intensity)[0], (*over_intensity)[1]);
  const double gain = bestGain(*over_intensity, *simulated);
  std::vector<double> from_simulation;
  for (const double counts : (*over_intensity)[0])
    from_simulation.push_back(simulated->sigma_mm(counts / gain));
  const double simulated_rms_log = rmsLogRatio((*over_intensity)[1], from_simulation);

  std::vector<double> grid, law;
  const auto [least, most] =
      std::minmax_element((*over_intensity)[0].begin(), (*over_intensity)[0].end());
  Curve simulated_curve{.name = "simulated, one gain fitted", .ink = Ink::Simulated},
      law_curve{
          .name = "law fitted to the measurement", .ink = Ink::Baseline, .stroke = Stroke::Dashed};
  for (double counts = *least; counts <= *most; counts *= 1.03) {
    simulated_curve.x.push_back(std::log10(counts)),
        simulated_curve.y.push_back(simulated->sigma_mm(counts / gain));
    law_curve.x.push_back(std::log10(counts)), law_curve.y.push_back(measured.sigma_mm(counts));
  }
  Curve intensity_dots{
      .name = "measured", .y = (*over_intensity)[1], .ink = Ink::Measured, .stroke = Stroke::Dots};
  for (const double counts : (*over_intensity)[0]) intensity_dots.x.push_back(std::log10(counts));

  const Plot by_distance{
      .title = camera.title + " noise over distance",
      .x_label = "distance [mm]",
      .y_label = "standard deviation [mm]",
      .curves = {{.name = "measured, white and black paper",
                  .x = (*over_distance)[0],
                  .y = (*over_distance)[1],
                  .ink = Ink::Measured,
                  .stroke = Stroke::Dots},
                 sorted((*over_distance)[0], distance->predicted, "simulated, albedo 0.8 (white)",
                        Ink::Simulated, Stroke::Line)},
      .log_y = true,
      .compact = true,
      .below = measuredLess((*over_distance)[0], (*over_distance)[1], distance->predicted, Rest::Ratio)};
  const Plot by_intensity{
      .title = camera.title + " noise over intensity",
      .x_label = "log10 of the infrared image's counts",
      .y_label = "standard deviation [mm]",
      .curves = {intensity_dots, law_curve, simulated_curve},
      .log_y = true,
      .compact = true,
      .below = measuredLess(intensity_dots.x, (*over_intensity)[1], from_simulation, Rest::Ratio)};

  finding.section = {.id = "noise-" + camera.name, .title = camera.title + ": noise"};
  finding.section.verdict = fmt::format(
      "Over the infrared image's counts the simulated noise follows the measured one within {} "
      "(RMS of the ratio's logarithm), with one free number, counts per electron; the "
      "best law of that form leaves {}. Over distance, white paper simulated: median {} times the "
      "measured value of both papers.",
      shownPercent(simulated_rms_log), shownPercent(measured.rms_log),
      shown(distance->median_ratio, 2));
  finding.section.tone = simulated_rms_log < 1.3 * measured.rms_log ? Tone::Good
                         : simulated_rms_log < 0.5                  ? Tone::Fair
                                                                    : Tone::Bad;
  finding.section.blocks = {
      FigureRow{
          {{"Standard deviation of 1,000 readings of one pixel against the infrared image there.",
            toSvg(by_intensity)},
           {"The same over distance; black paper lies above.", toSvg(by_distance)}}},
      TableBlock{"σ(I) = √(a² + b²/I + c²/I²), I in counts",
                 {"", "a [mm]", "b [mm √count]", "c [mm count]", "RMS of ln ratio"},
                 {{"fitted to the measurement", shown(measured.a_mm, 2), shown(measured.b, 1),
                   shown(measured.c, 0), shown(measured.rms_log, 3)},
                  {"simulated, in the same counts", shown(simulated->a_mm, 2),
                   shown(simulated->b * std::sqrt(gain), 1), shown(simulated->c * gain, 0),
                   shown(simulated_rms_log, 3)}}},
      Paragraph{fmt::format("The preset's photon budget was derived from the white-paper distance "
                            "table of this very data set, so agreement there is no test; the "
                            "intensity table (black paper in it too) was not used. "
                            "Gain that fits best: {:.3g} counts per electron of amplitude. "
                            "Simulated: {} readings of 16 pixels each.",
                            gain, 300),
                true}};
  TraitCollector traits;
  traits.add("noise law", "A", noiseLawTraits((*over_intensity)[0], (*over_intensity)[1]));
  addCharacteristics(std::move(traits).found(), finding);
  finding.data.set("law_a_mm", measured.a_mm)
      .set("law_b", measured.b)
      .set("law_c", measured.c)
      .set("law_rms_log", measured.rms_log);
  finding.data.set("simulated_rms_log_over_intensity", simulated_rms_log)
      .set("gain_counts_per_electron", gain);
  finding.data.set("simulated_rms_log_over_distance", distance->rms_log)
      .set("median_ratio_over_distance", distance->median_ratio);
  finding.data.set("n_intensity", (*over_intensity)[0].size())
      .set("n_distance", (*over_distance)[0].size());
  finding.cards.push_back({camera.title + " noise", shownPercent(simulated_rms_log),
                           fmt::format("RMS log ratio over intensity; best law of the form {}",
                                       shownPercent(measured.rms_log)),
                           finding.section.tone});
  return finding;
}

}  // namespace toftwin::compare
