// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/refit.h"

#include <algorithm>
#include <cmath>

#include "calib/discover/campaign/reading.h"
#include "calib/discover/marginal.h"
#include "sim/images/rows.h"

namespace toftwin::discover {
namespace {

/// A number that is fitted: of which effect of the list, and by how much it is changed for its
/// derivative.
struct Free {
  std::size_t place = 0;
  std::string key{};
  double step = 0.0;
};

double valueOf(const sim::AnyEffect& effect, const std::string& key) {
  for (const EffectNumber& number : numbersOf(effect)) {
    if (number.key == key) return number.value;
  }
  return 0.0;
}

/// A tenth of what the effect has, or of what its defaults have.
std::vector<Free> freeNumbersOf(const std::vector<sim::AnyEffect>& effects,
                                const std::vector<std::size_t>& places) {
  std::vector<Free> all;
  for (const std::size_t place : places) {
    const sim::AnyEffect defaults =
        std::visit([]<class E>(const E&) { return sim::AnyEffect{E{}}; }, effects[place]);
    for (const EffectNumber& number : numbersOf(effects[place])) {
      if (number.is_whole) continue;
      double step =
          0.05 * std::max(std::abs(number.value), 0.1 * std::abs(valueOf(defaults, number.key)));
      if (step == 0.0) step = 1e-4 * (number.high - number.low);
      if (number.value + step > number.high) step = -step;
      all.push_back({place, number.key, step});
    }
  }
  return all;
}

std::vector<sim::AnyEffect> moved(std::vector<sim::AnyEffect> effects, const Free& free,
                                  double by) {
  effects[free.place] =
      withNumber(effects[free.place], free.key, valueOf(effects[free.place], free.key) + by);
  return effects;
}

/// The evidence of the residuals that a list of effects leaves, with a column for each free number.
Result<Evidence> evidenceOf(const Judged& judged, const std::vector<sim::AnyEffect>& effects,
                            const std::vector<Free>& free) {
  const auto declared = NoiselessCamera::make(
      judged.declared.model, effectsWithoutNoise(judged.declared.model), judged.captures);
  if (!declared) return declared.error();
  std::vector<NoiselessCamera> cameras;
  auto here = NoiselessCamera::make(judged.declared.model, effects, judged.captures);
  if (!here) return here.error();
  for (const Free& one : free) {
    auto camera = NoiselessCamera::make(judged.declared.model, moved(effects, one, one.step),
                                        judged.captures);
    if (!camera) return camera.error();
    cameras.push_back(*std::move(camera));
  }
  Evidence evidence;
  evidence.groups = commonGroups();
  for (std::size_t i = 0; i < free.size(); ++i) {
    evidence.groups.push_back({.name = free[i].key,
                               .kind = Kind::Declared,
                               .first = kCommon + i,
                               .count = 1,
                               .numbers = 1});
  }
  evidence.captures.resize(judged.captures.size());
  sim::inParallel(static_cast<int>(judged.captures.size()), 1, [&](int first, int last) {
    for (auto c = static_cast<std::size_t>(first); c < static_cast<std::size_t>(last); ++c) {
      const MeasuredCapture& capture = judged.captures[c];
      const TracedCapture& traced = *judged.traced[c];
      // Which pixels count must not depend on what is fitted.
      const Cells cells{capture, traced, declared->read(capture, traced.light), judged.most_cells};
      const Reading reading = here->read(capture, traced.light);
      WhitenedCapture whitened{cells, kCommon + free.size()};
      whitened.putCommon(cells, traced);
      whitened.putResidual(cells, capture, traced, reading);
      for (std::size_t i = 0; i < free.size(); ++i)
        whitened.putChange(cells, kCommon + i, reading, cameras[i].read(capture, traced.light));
      evidence.captures[c] = whitened.evidence(capture.record.name, capture.record.block);
    }
  });
  return evidence;
}

struct Step {
  Fit nuisances;
  Eigen::MatrixXd gram;  ///< of the free numbers after the nuisances
  Eigen::VectorXd moment;
  Eigen::VectorXd own;  ///< squares of the free numbers' columns
  double deviance = 0.0, freedom = 1.0;
};

Step stepOf(const Judged& judged, const Evidence& evidence, std::size_t free) {
  const Marginal marginal = marginalise(evidence, judged.scales);
  Columns nuisances;
  for (const Group& group : marginal.groups) {
    if (group.kind == Kind::Nuisance) append(nuisances, group);
  }
  Step step;
  step.nuisances = fit(marginal, nuisances);
  step.deviance = step.nuisances.deviance, step.freedom = step.nuisances.freedom;
  // Normal equations of the free numbers, the nuisances eliminated.
  const auto n = static_cast<Eigen::Index>(free);
  const Eigen::MatrixXd cross = marginal.gram(nuisances, Eigen::lastN(n));
  const Eigen::MatrixXd inverse = pseudoInverse(marginal.gram(nuisances, nuisances)).inverse;
  step.gram = marginal.gram.bottomRightCorner(n, n) - cross.transpose() * inverse * cross;
  step.moment = marginal.moment.tail(n) - cross.transpose() * inverse * marginal.moment(nuisances);
  step.own = marginal.gram.diagonal().tail(n);
  return step;
}

/// Those that are not told by offset, gain and the numbers before them: of a reference temperature,
/// an offset says all.
std::vector<Free> toldApart(const std::vector<Free>& free, const Step& step) {
  constexpr double kLeast = 1e-4;  // of a column's square
  std::vector<Free> kept;
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    double left = step.gram(row, row);
    if (!rows.empty()) {
      const Eigen::VectorXd cross = step.gram(rows, row);
      left -= cross.dot(pseudoInverse(step.gram(rows, rows), 1e-9).inverse * cross);
    }
    if (!(left > kLeast * step.own[row]) || !(step.own[row] > 0.0)) continue;
    kept.push_back(free[i]);
    rows.push_back(row);
  }
  return kept;
}

/// The same numbers with steps that suit their effects as they are now.
std::vector<Free> again(const std::vector<Free>& free, const std::vector<sim::AnyEffect>& effects,
                        const std::vector<std::size_t>& places) {
  std::vector<Free> all = freeNumbersOf(effects, places);
  std::erase_if(all, [&](const Free& one) {
    return std::ranges::none_of(
        free, [&](const Free& f) { return f.place == one.place && f.key == one.key; });
  });
  return all;
}

/// A list of effects while it is fitted.
struct State {
  std::vector<sim::AnyEffect> effects;
  std::vector<Free> free{};
  Step at{};
};

Result<> look(const Judged& judged, State& state) {
  const auto evidence = evidenceOf(judged, state.effects, state.free);
  if (!evidence) return evidence.error();
  state.at = stepOf(judged, *evidence, state.free.size());
  return {};
}

/// All numbers that can be told apart where the fit is now: a radius shows only once there is
/// something that has it.
Result<> freeWhatShows(const Judged& judged, const std::vector<std::size_t>& places, State& state) {
  state.free = freeNumbersOf(state.effects, places);
  if (auto looked = look(judged, state); !looked) return looked;
  std::vector<Free> kept = toldApart(state.free, state.at);
  if (kept.size() == state.free.size()) return {};
  state.free = std::move(kept);
  return look(judged, state);
}

/// Levenberg-Marquardt with the numbers that are free.
Result<> descend(const Judged& judged, const std::vector<std::size_t>& places, State& state) {
  constexpr int kMostSteps = 10;
  constexpr double kDone = 0.1;  // of the deviance: a tenth of a standard error squared
  double damping = 1e-3;
  for (int k = 0; k < kMostSteps && !state.free.empty() && damping < 1e8; ++k) {
    Eigen::MatrixXd damped = state.at.gram;
    damped.diagonal() *= 1.0 + damping;
    const Eigen::VectorXd change = pseudoInverse(damped, 1e-7).inverse * state.at.moment;
    State next{state.effects};
    for (std::size_t i = 0; i < state.free.size(); ++i)
      next.effects = moved(std::move(next.effects), state.free[i],
                           change[static_cast<Eigen::Index>(i)] * state.free[i].step);
    next.free = again(state.free, next.effects, places);
    if (auto looked = look(judged, next); !looked) return looked;
    const double better = state.at.deviance - next.at.deviance;
    if (better > 0.0) {
      state = std::move(next);
      damping = std::max(1e-9, 0.1 * damping);
      if (better < kDone) break;
    } else {
      damping *= 30.0;
    }
  }
  return {};
}

}  // namespace

Result<Evidence> residualEvidence(const Judged& judged,
                                  const std::vector<sim::AnyEffect>& effects) {
  return evidenceOf(judged, effects, {});
}

Result<Refitted> refit(const Judged& judged, std::vector<sim::AnyEffect> effects,
                       const std::vector<std::size_t>& places) {
  State state{std::move(effects)};
  if (auto shown = freeWhatShows(judged, places, state); !shown) return shown.error();
  for (int round = 0; round < 3; ++round) {
    const std::size_t before = state.free.size();
    if (auto done = descend(judged, places, state); !done) return done.error();
    if (auto shown = freeWhatShows(judged, places, state); !shown) return shown.error();
    if (state.free.size() <= before) break;
  }
  const Step& at = state.at;
  const auto& free = state.free;
  Refitted result{.effects = state.effects,
                  .deviance = at.deviance,
                  .dispersion = at.deviance / std::max(1.0, at.freedom)};
  const double size = std::max(1.0, result.dispersion);
  const Eigen::MatrixXd covariance = pseudoInverse(at.gram, 1e-7).inverse * size;
  for (const std::size_t place : places) {
    FittedEffect one{state.effects[place], {}};
    for (std::size_t i = 0; i < free.size(); ++i) {
      if (free[i].place != place) continue;
      const auto row = static_cast<Eigen::Index>(i);
      one.numbers.push_back(
          {free[i].key, valueOf(state.effects[place], free[i].key),
           std::sqrt(std::max(0.0, covariance(row, row))) * std::abs(free[i].step)});
    }
    result.fitted.push_back(std::move(one));
  }
  result.offset_mm = at.nuisances.coefficient[0], result.gain_percent = at.nuisances.coefficient[1];
  result.offset_error_mm = std::sqrt(std::max(0.0, at.nuisances.inverse(0, 0)) * size);
  return result;
}

Result<std::vector<std::shared_ptr<const TracedCapture>>> traceWhereTheyStood(
    const Declared& declared, const std::vector<MeasuredCapture>& captures,
    const std::vector<std::shared_ptr<const TracedCapture>>& traced, const TraceOptions& options,
    const std::function<void(double)>& tell) {
  constexpr Eigen::Index kOwn = 6;  // pose and light
  const Judged judged{declared, captures, traced, {}};
  const auto evidence = evidenceOf(judged, effectsWithoutNoise(declared.model), {});
  if (!evidence) return evidence.error();
  const Eigen::VectorXd common = stepOf(judged, *evidence, 0).nuisances.coefficient;
  std::vector<Stood> stood;
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const CaptureEvidence& one = evidence->captures[c];
    const Eigen::MatrixXd gram = one.gram.block<kOwn, kOwn>(2, 2) +
                                 Eigen::MatrixXd::Identity(kOwn, kOwn);  // prior deviations of 1
    const Eigen::VectorXd own =
        gram.ldlt().solve(one.moment.segment<kOwn>(2) - one.gram.block<kOwn, 2>(2, 0) * common);
    Stood& here = stood.emplace_back();
    for (std::size_t way = 0; way < here.size(); ++way)
      here[way] = std::clamp(own[static_cast<Eigen::Index>(way)], -10.0, 10.0);
  }
  TraceOptions again = options;
  again.seed += 0x2545f491U;
  return traceAll(declared, captures, again, tell, stood);
}

sim::AnyEffect startOf(const CampaignRows& rows, const Candidate& candidate,
                       std::span<const double> scales) {
  const Evidence evidence = rows.evidence({});
  const Marginal marginal = marginalise(evidence, scales);
  const Columns nuisances = nuisanceColumns(marginal);
  const double without = fit(marginal, nuisances).deviance;
  sim::AnyEffect best = candidate.example;
  double most = -1.0;
  for (const Group& group : marginal.groups) {
    if (group.name != nameOf(candidate.example) || group.kind != Kind::Catalogue) continue;
    for (std::size_t i = 0; i < group.count; ++i) {
      Columns columns = nuisances;
      columns.push_back(static_cast<Eigen::Index>(group.first + i));
      const Fit with = fit(marginal, columns);
      if (!(without - with.deviance > most)) continue;
      most = without - with.deviance;
      const Variation& variation = candidate.variations[i];
      const double by = with.coefficient[with.coefficient.size() - 1] * variation.step;
      best = withNumber(variation.off, variation.key, valueOf(variation.off, variation.key) + by);
    }
  }
  return best;
}

}  // namespace toftwin::discover
