// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/discover.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include <fmt/format.h>

#include "calib/loop/between_groups.h"
#include "calib/loop/noise.h"
#include "calib/loop/projection.h"
#include "calib/loop/written_model.h"

namespace toftwin::loop {
namespace {

constexpr std::size_t kFewestRows = 20;
/// Effects are looked for in about so many rows at most: what a tenth of the noise hides in these is no matter of a metrologist's.
constexpr Eigen::Index kSearched = 6000;
/// From so many groups on a fifth of them is locked, not rows of each.
constexpr int kGroupsToLock = 8;
/// Spread that differs by less along all rows hardly changes what counts how much.
constexpr double kSpreads = 1.4;

// ---- Rows ----------------------------------------------------------------------------------------------------------

/// A column's, or whole groups, or one block of rows that follow each other in a few; never the first or the last, where a change in
/// time is steepest.
std::vector<bool> lockedRows(const TableEvidence& table, const table::Readings& readings, const std::vector<Eigen::Index>& rows, double share) {
  std::vector<bool> locked(rows.size(), false);
  const auto every = static_cast<std::size_t>(std::lround(1.0 / share));
  if (!readings.locked.empty()) {
    for (std::size_t i = 0; i < rows.size(); ++i) locked[i] = readings.locked[table.row[static_cast<std::size_t>(rows[i])]];
  } else if (table.evidence.groups() >= kGroupsToLock) {
    for (std::size_t i = 0; i < rows.size(); ++i)
      locked[i] = static_cast<std::size_t>(table.evidence.group[static_cast<std::size_t>(rows[i])]) % every == every / 2;
  } else {
    const std::size_t blocks = std::clamp<std::size_t>(rows.size() / 8, 2 * every, 10 * every);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::size_t at = i * blocks / rows.size();
      locked[i] = at % every == every / 2;
    }
  }
  return locked;
}

std::vector<Eigen::Index> without(const Eigen::Index count, const std::vector<NoReadings>& none) {
  std::vector<bool> is_none(static_cast<std::size_t>(count), false);
  for (const NoReadings& kind : none)
    for (const Eigen::Index row : kind.rows) is_none[static_cast<std::size_t>(row)] = true;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < count; ++i)
    if (!is_none[static_cast<std::size_t>(i)]) rows.push_back(i);
  return rows;
}

/// The rows in the groups that the table gives them, which the search may have taken for one.
Evidence inGroups(const TableEvidence& table, const table::Readings& readings) {
  TableEvidence copy{.evidence = table.evidence, .row = table.row};
  giveGroups(copy, readings);
  return std::move(copy.evidence);
}

// ---- The three responses -------------------------------------------------------------------------------------------

/// Coefficients by all rows, of effects whose shapes were found in some.
void fitByAll(Evidence& e, Explanation& explanation) {
  if (explanation.effects.empty()) return;
  const LeastSquares fit = robustLeastSquares(e, e.y, columnsOf(e, explanation.effects));
  const Eigen::VectorXd z = fit.residual.cwiseQuotient(e.sigma);
  const double variance = z.squaredNorm() / std::max(1.0, static_cast<double>(e.rows() - fit.coefficient.size()));
  takeNumbers(explanation.effects, fit, variance);
}

Explanation explained(Evidence& e, const ExplainOptions& options) {
  if (e.rows() <= kSearched) return explain(e, options);
  Evidence some = rowsOf(e, thinned(e.rows(), kSearched));
  Explanation explanation = explain(some, options);
  fitByAll(e, explanation);
  return explanation;
}

/// Everything that `e` says within groups, then what the groups' means say, each judged by its own units: rows, and groups. `grouped`: the
/// same rows in their groups, also where `e` has none because they share one offset.
Explanation explainedByUnits(Evidence& e, const Evidence& grouped, const ExplainOptions& options) {
  Explanation all = explained(e, options);
  if (grouped.groups() < 2) return all;
  const auto most = static_cast<std::size_t>(options.most_effects) + 2;
  for (bool is_searched = false; !is_searched && all.effects.size() < most;) {
    const Eigen::VectorXd left = lessEffects(e, all.effects);
    std::vector<Effect> more = explainGroups(grouped, left, options);
    if (more.empty()) break;
    all.p = std::min(all.p, more.front().p);
    is_searched = more.front().rests_on >= kGroupsSearched;  // until nothing is left
    const LeastSquares fit = leastSquares(ungrouped(e), left, Eigen::VectorXd::Ones(e.rows()), columnsOf(e, more));
    const double freedom = std::max(1.0, static_cast<double>(more.front().rests_on - 1 - fit.coefficient.size()));
    takeNumbers(more, fit, varianceOfGroups(grouped, fit.residual, freedom));
    std::ranges::move(more, std::back_inserter(all.effects));
  }
  return all;
}

/// The mean: within groups, where their offsets say more than one constant beside what changes within them, and between them.
void explainMean(Discovery& d, const DiscoverOptions& options) {
  Evidence& e = d.open.evidence;
  const ExplainOptions search{.alpha = options.alpha, .draws = options.draws, .seed = options.seed};
  e = inGroups(d.open, d.readings);  // also where an earlier search took them for one
  const Evidence grouped = e;
  if (e.groups() > 1 && chanceOfGroups(e, flexibleWithinGroups(e)) > options.alpha) e = ungrouped(std::move(e));
  d.mean = explainedByUnits(e, grouped, search);
  d.has_group_offsets = false;
  if (e.groups() < 2) return;
  Evidence rest = e;
  rest.y = lessEffects(e, d.mean.effects);
  d.has_group_offsets = chanceOfGroups(rest, Eigen::MatrixXd(e.rows(), 0)) <= options.alpha;
}

/// Residuals beside everything that was found, offsets of groups included.
Eigen::VectorXd residualOf(const Discovery& d) {
  const Evidence& e = d.open.evidence;
  return leastSquares(e, e.y, e.sigma.array().square().inverse(), columnsOf(e, d.mean.effects)).residual;
}

/// The logarithm of what is left, as a response of its own. It is not of what is exactly 0.
Explanation explainSpread(const Discovery& d, const DiscoverOptions& options) {
  Evidence grouped = inGroups(d.open, d.readings), e = ungrouped(grouped);
  const Eigen::VectorXd left = residualOf(d);
  const double least = 0.05 * std::max(1e-300, robustScale(left));
  e.y = left.array().abs().max(least).log();
  e.sigma.setOnes();
  grouped.y = e.y, grouped.sigma = e.sigma;
  return explainedByUnits(e, grouped, {.alpha = options.alpha, .draws = options.draws, .seed = options.seed + 1000, .most_effects = 2});
}

/// What each row scatters by as the spread's effects say, relative to their median.
Eigen::VectorXd sigmaOf(const Discovery& d, const Evidence& e) {
  Eigen::VectorXd log_sigma = Eigen::VectorXd::Zero(e.rows());
  for (const Effect& effect : d.spread.effects) log_sigma += columnsOf(e, effect.shape.columns) * effect.coefficient;
  log_sigma.array() -= median({log_sigma.begin(), log_sigma.end()});
  return log_sigma.cwiseMax(-5.0).cwiseMin(5.0).array().exp();
}

/// What the open rows' model leaves of these rows, offsets of their groups included.
Eigen::VectorXd beyondOpen(const Discovery& d, const Evidence& rows) {
  Evidence e = rows;
  if (d.open.evidence.groups() < 2) e = ungrouped(std::move(e));
  return robustLeastSquares(e, lessEffects(e, d.mean.effects), Eigen::MatrixXd(e.rows(), 0)).residual;
}

/// The errors less what goes with columns, but not less series' offsets.
Eigen::VectorXd lessCurves(const Discovery& d) {
  std::vector<Effect> curves = d.mean.effects;
  std::erase_if(curves, [](const Effect& effect) { return isSeries(effect); });
  return lessEffects(d.open.evidence, curves);
}

/// Of each open row, by where the reference begins anew in the file.
std::vector<int> seriesNumbers(const Discovery& d) {
  std::vector<int> series;
  for (const std::size_t row : d.open.row) {
    const std::size_t line = d.readings.line[row];
    series.push_back(static_cast<int>(std::ranges::count_if(d.all.begins, [&](std::size_t begin) { return line >= begin; })));
  }
  return series;
}

std::optional<Explanation> explainShare(const Discovery& d, const DiscoverOptions& options) {
  Evidence grouped = d.all.evidence, e = ungrouped(grouped);
  e.y.setZero();
  double count = 0.0;
  // That ranges beyond the longest one wrap is known; what is asked is when a reading fails.
  for (const NoReadings& kind : d.no_readings)
    for (const Eigen::Index row : kind.rows)
      if (kind.kind != NoReading::Wrapped) e.y[row] = 100.0, count += 1.0;
  if (count < 8.0) return std::nullopt;
  e.sigma.setOnes();
  grouped.y = e.y, grouped.sigma = e.sigma;
  return explainedByUnits(e, grouped, {.alpha = options.alpha, .draws = options.draws, .seed = options.seed + 2000, .most_effects = 2, .is_robust = false});
}

}  // namespace

Result<Discovery> discover(table::Readings readings, const DiscoverOptions& options) {
  Discovery d{.readings = std::move(readings)};
  d.all = evidenceOf(d.readings);
  if (static_cast<std::size_t>(d.all.evidence.rows()) < kFewestRows) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: {} rows have all values; at least {} are needed", d.readings.file.string(), d.all.evidence.rows(), kFewestRows)};
  }
  if (d.all.evidence.covariates.empty())
    return Error{Error::Code::InvalidArgument, fmt::format("{}: has no column that the error could go with", d.readings.file.string())};
  d.no_readings = findNoReadings(d.all.evidence, d.all.measured);
  const auto split = [&] {
    const auto rows = without(d.all.evidence.rows(), d.no_readings);
    const auto locked = lockedRows(d.all, d.readings, rows, options.locked_share);
    std::vector<Eigen::Index> open_rows, locked_rows;
    for (std::size_t i = 0; i < rows.size(); ++i) (locked[i] ? locked_rows : open_rows).push_back(rows[i]);
    d.open = rowsOf(d.all, open_rows), d.locked = rowsOf(d.all, locked_rows);
  };
  split();
  explainMean(d, options);
  d.spread = explainSpread(d, options);
  const Eigen::VectorXd sigma = sigmaOf(d, d.open.evidence);
  const bool spreads = d.readings.sigma.empty() && sigma.maxCoeff() > kSpreads * sigma.minCoeff();
  if (spreads) d.open.evidence.sigma = sigma;
  // Locked rows may jump as others do: what measures nothing cannot judge.
  Evidence measuring = rowsOf(d.all.evidence, without(d.all.evidence.rows(), d.no_readings));
  if (spreads) measuring.sigma = sigmaOf(d, measuring);
  NoReadings jumps = findJumps(measuring, beyondOpen(d, measuring));
  if (!jumps.rows.empty()) {
    const auto rows = without(d.all.evidence.rows(), d.no_readings);
    for (Eigen::Index& row : jumps.rows) row = rows[static_cast<std::size_t>(row)];
    d.no_readings.push_back(jumps);
    split();
    if (spreads) d.open.evidence.sigma = sigmaOf(d, d.open.evidence);
  }
  if (spreads || !jumps.rows.empty()) explainMean(d, options);
  d.share = explainShare(d, options);
  const Noise noise = judgeNoise(d.open.evidence, columnsOf(d.open.evidence, d.mean.effects));
  d.noise = robustScale(noise.residual);
  d.repeats = repeatsOf(d.open.evidence);
  d.overlap = overlapOf(d.open.evidence, lessCurves(d), seriesNumbers(d));
  d.told = toldOf(d.open.evidence, d.mean.effects);
  d.numbers = numbersOf(d.open.evidence, d.mean.effects, d.mean.block_length);
  if (auto written = writeModel(d); !written) return written.error();
  d.removed = removedOf(d.open.evidence, d.mean.effects, d.locked, d.model, d.mean.block_length);
  return d;
}

}  // namespace toftwin::loop
