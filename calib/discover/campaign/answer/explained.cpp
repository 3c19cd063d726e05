// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/answer/explained.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "calib/compare/statistics.h"
#include "calib/discover/campaign/answer/removed_share.h"
#include "calib/discover/campaign/captures/light_noise.h"
#include "calib/discover/marginal.h"

namespace toftwin::discover {
namespace {

/// χ² of each capture under a model with fixed offset and gain, poses and light integrated out; captures of one place
/// are one.
struct ByCapture {
  std::vector<double> energy{}, rows{};

  [[nodiscard]] double energies() const { return std::accumulate(energy.begin(), energy.end(), 0.0); }
  [[nodiscard]] double allRows() const { return std::accumulate(rows.begin(), rows.end(), 0.0); }
  [[nodiscard]] double perRow() const { return energies() / allRows(); }
  [[nodiscard]] double spread() const;
};

/// How much more than 2n, at least 1, the χ² of n rows varies from one capture to another: a capture's own noise is
/// known from its few frames, and all of its rows with it. By the middle one of the captures, since some may err.
double ByCapture::spread() const {
  constexpr double kMiddle = 0.4549;  // of χ² with one degree of freedom
  std::vector<double> by_row, squares;
  for (std::size_t c = 0; c < rows.size(); ++c)
    if (rows[c] > 0.0) by_row.push_back(energy[c] / rows[c]);
  const double usual = compare::quantile(by_row, 0.5);
  for (std::size_t c = 0; c < rows.size(); ++c)
    if (rows[c] > 0.0) squares.push_back(0.5 * rows[c] * std::pow(energy[c] / (usual * rows[c]) - 1.0, 2.0));
  return squares.empty() ? 1.0 : std::max(1.0, compare::quantile(std::move(squares), 0.5) / kMiddle);
}

Result<ByCapture> energiesOf(const JudgedCampaign& judged, const JudgedModel& model) {
  const auto evidence = residualEvidence(judged, model.effects);
  if (!evidence) return evidence.error();
  const Marginal marginal = marginalise(*evidence, judged.scales);
  const Columns offset_and_gain{0, 1};
  const Eigen::Vector2d known{model.offset_mm, model.gain_percent};
  ByCapture all;
  for (const CaptureEvidence& capture : marginal.captures) {
    all.energy.push_back(energyLeft(capture, offset_and_gain, known));
    all.rows.push_back(capture.rows);
  }
  return all;
}

/// How many cells each capture is divided into, and the χ² of noise for each row of them.
struct Grain {
  int most_cells = 0;
  double noise = 1.0;
  double spread = 1.0;      ///< ByCapture::spread
  double open_rows = 0.0;   ///< that say so
  double stands_out = 0.0;  ///< what was found removes there, over what noise alone does to χ²
};

Result<Grain> grainWith(int most_cells, double share, const JudgedCampaign& open, const JudgedModels& models) {
  // What an imperfect fit leaves of the open captures is no noise.
  constexpr double kMostNoise = 1.1;
  JudgedCampaign grained = open;
  grained.most_cells = most_cells;
  const auto with_zero = energiesOf(grained, models.with_zero), after = energiesOf(grained, models.after);
  if (!with_zero) return with_zero.error();
  if (!after) return after.error();
  const double noise = after->perRow() / (1.0 - models.after.fitted_share);
  Grain grain{most_cells, std::min(kMostNoise, noise), after->spread(), after->allRows()};
  grain.stands_out = share * (with_zero->energies() - after->energies()) /
                     (grain.noise * std::sqrt(2.0 * grain.spread * share * grain.open_rows));
  return grain;
}

/// The χ² of N rows varies by √(2N) or more from noise alone, which few captures and a faint effect do not stand out
/// of. So the cells are the finest in which that would be a tenth of what was found removes, as the open
/// captures say; where there are none, those in which that stands out most: what each pixel has by itself does not
/// in larger ones. Noise is that of the open captures in the same cells: noise that neighbours share is larger
/// in larger ones.
Result<Grain> grainOf(const JudgedCampaign& judged, const JudgedCampaign& open, const JudgedModels& models) {
  constexpr double kEnough = 10.0;
  const double share = static_cast<double>(judged.lit.captures.size()) /
                       static_cast<double>(std::max<std::size_t>(1, open.lit.captures.size()));
  Grain clearest;
  for (const int most_cells : {384, 96, 24, Cells::kMostCells}) {
    const auto grain = grainWith(most_cells, share, open, models);
    if (!grain) return grain.error();
    if (clearest.most_cells == 0 || grain->stands_out > clearest.stands_out) clearest = *grain;
    if (most_cells < Cells::kMostCells && grain->stands_out > kEnough) return grain;
  }
  return clearest;
}

Balance balanceOf(const ByCapture& from, const ByCapture& to, double noise) {
  return {from.energies() - to.energies(), to.energies() - noise * to.allRows()};
}

/// Noise adds a variance of 2N (times their spread) + 4 left to the χ² of N rows, of 2N²/M where it is known from M
/// rows itself, and of 4 removed to what is removed.
Balance sigmaOf(const Balance& balance, double rows, const Grain& grain) {
  const double noise = grain.noise;
  return {std::sqrt(4.0 * noise * std::abs(balance.removed)),
          std::sqrt(2.0 * grain.spread * rows * noise * noise * (1.0 + rows / grain.open_rows) +
                    4.0 * noise * std::max(0.0, balance.left))};
}

/// How well each capture is described by itself, not their sum.
Result<> addEach(const JudgedCampaign& judged, const JudgedCampaign& open, const JudgedModels& models,
                 Judgement& judgement) {
  const auto grain = grainOf(judged, open, models);
  if (!grain) return grain.error();
  JudgedCampaign grained = judged;
  grained.most_cells = grain->most_cells;
  const auto before = energiesOf(grained, models.before), with_zero = energiesOf(grained, models.with_zero),
             after = energiesOf(grained, models.after);
  if (!before) return before.error();
  if (!with_zero) return with_zero.error();
  if (!after) return after.error();
  judgement.cells = grain->most_cells, judgement.noise = grain->noise;
  judgement.explainable = with_zero->energies() - grain->noise * with_zero->allRows();
  judgement.removed_by_zero = shareOf(balanceOf(*before, *with_zero, grain->noise));
  const Balance found = balanceOf(*with_zero, *after, grain->noise);
  judgement.removed = shareOf(found);
  const auto [low, high] = intervalOf(found, sigmaOf(found, after->allRows(), *grain));
  judgement.removed_low = low, judgement.removed_high = high;
  judgement.before.per_row = before->perRow(), judgement.with_zero.per_row = with_zero->perRow();
  judgement.after.per_row = after->perRow();
  const auto file = energiesOf(judged, models.before), found_model = energiesOf(judged, models.after);
  if (!file) return file.error();
  if (!found_model) return found_model.error();
  judgement.gained = file->energies() - found_model->energies();
  return {};
}

}  // namespace

Result<> addExplained(const JudgedCampaign& judged, const JudgedCampaign& open, const JudgedModels& models,
                      Judgement& judgement) {
  if (std::ranges::all_of(open.lit.captures, [](const MeasuredCapture& one) { return one.light_variance.empty(); }))
    return addEach(judged, open, models, judgement);
  const auto of_judged = eachByItself(judged.lit.captures), of_open = eachByItself(open.lit.captures);
  const Lit judged_lit{of_judged, judged.lit.traced, judged.lit.varied},
      open_lit{of_open, open.lit.traced, open.lit.varied};
  return addEach({judged.declared, judged_lit, judged.scales, judged.most_cells},
                 {open.declared, open_lit, open.scales, open.most_cells}, models, judgement);
}

}  // namespace toftwin::discover
