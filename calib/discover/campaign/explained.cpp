// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/explained.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include <toftwin/nan.h>

#include "calib/compare/statistics.h"
#include "calib/discover/campaign/light_noise.h"
#include "calib/discover/marginal.h"

namespace toftwin::discover {
namespace {

/// χ² of each capture under a model with fixed offset and gain, poses and light integrated out.
struct ByCapture {
  std::vector<double> energy{}, rows{};

  [[nodiscard]] double energies() const { return std::accumulate(energy.begin(), energy.end(), 0.0); }
  [[nodiscard]] double allRows() const { return std::accumulate(rows.begin(), rows.end(), 0.0); }
  [[nodiscard]] double perRow() const { return energies() / allRows(); }
};

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
  double open_rows = 0.0;  ///< that say so
};

/// The χ² of N rows varies by √(2N) from noise alone, which few captures and a faint effect do not stand out
/// of. So the cells are the finest in which that would be a tenth of what was found removes, as the open
/// captures say. Noise is that of the open captures in the same cells: noise that neighbours share is larger
/// in larger ones.
Result<Grain> grainOf(const JudgedCampaign& judged, const JudgedCampaign& open, const JudgedModels& models) {
  constexpr double kSmall = 0.1;
  // What an imperfect fit leaves of the open captures is no noise.
  constexpr double kMostNoise = 1.1;
  const double share = static_cast<double>(judged.lit.captures.size()) /
                       static_cast<double>(std::max<std::size_t>(1, open.lit.captures.size()));
  Grain grain;
  for (const int most_cells : {384, 96, 24}) {
    JudgedCampaign grained = open;
    grained.most_cells = most_cells;
    const auto with_zero = energiesOf(grained, models.with_zero), after = energiesOf(grained, models.after);
    if (!with_zero) return with_zero.error();
    if (!after) return after.error();
    grain = {most_cells, std::min(kMostNoise, after->perRow()), after->allRows()};
    const double removed = share * (with_zero->energies() - after->energies());
    if (grain.noise * std::sqrt(2.0 * share * after->allRows()) < kSmall * removed) break;
  }
  return grain;
}

/// What a model removes of the χ² that another leaves over noise, and what it leaves.
struct Balance {
  double removed = 0.0, left = 0.0;
};
Balance balanceOf(const ByCapture& from, const ByCapture& to, double noise) {
  return {from.energies() - to.energies(), to.energies() - noise * to.allRows()};
}

/// What is left of something explainable is not negative, whatever noise says. NaN where nothing is
/// explainable.
double shareOf(const Balance& balance) {
  const double all = balance.removed + std::max(0.0, balance.left);
  return all > 0.0 ? balance.removed / all : kNaN;
}

/// 95 % of the shares that noise could have made of this one in these captures: it adds a variance of 2N + 4
/// left to the χ² of N rows, of 2N²/M where it is known from M rows itself, and of 4 removed to what is
/// removed.
void addInterval(const Balance& balance, double rows, double open_rows, double noise, Judgement& judgement) {
  constexpr int kDraws = 4000;
  constexpr std::uint64_t kSeed = 20'262;
  const double left_sd = std::sqrt(2.0 * rows * noise * noise * (1.0 + rows / open_rows) +
                                   4.0 * noise * std::max(0.0, balance.left)),
               removed_sd = std::sqrt(4.0 * noise * std::abs(balance.removed));
  std::mt19937_64 engine{kSeed};
  std::normal_distribution<double> normal;
  std::vector<double> shares;
  for (int k = 0; k < kDraws; ++k) {
    const double removed = balance.removed + removed_sd * normal(engine),
                 left = balance.left + left_sd * normal(engine);
    const double share = shareOf({removed, left});
    if (std::isfinite(share)) shares.push_back(share);
  }
  judgement.removed_low = compare::quantile(shares, 0.025);
  judgement.removed_high = compare::quantile(std::move(shares), 0.975);
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
  addInterval(found, after->allRows(), grain->open_rows, grain->noise, judgement);
  judgement.before.per_row = before->perRow(), judgement.with_zero.per_row = with_zero->perRow();
  judgement.after.per_row = after->perRow();
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
