// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/refit.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>

#include "calib/discover/campaign/rows/bounded_step.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/rows/told_apart.h"

namespace toftwin::discover {
namespace {

/// A step of a number: of half of what it or its default is at most, of a hundredth of its bounds where the default is
/// nothing and does not say how large it may be, within its bounds, and to the other side if there is more room.
double longestStep(const sim::AnyEffect& effect, const std::string& key, double step) {
  constexpr double kMost = 0.5, kMostOfBounds = 0.01;
  for (const EffectNumber& number : numbersOf(effect)) {
    if (number.key != key) continue;
    const double usual = kMost * std::abs(valueOf(defaultsOf(effect), key));
    const double large = usual > 0.0 ? usual : kMostOfBounds * (number.high - number.low);
    const double most = std::min(std::abs(step), std::max(kMost * std::abs(number.value), large));
    const double up = std::min(most, number.high - number.value),
                 down = std::min(most, number.value - number.low);
    return up > down || (up == down && step > 0.0) ? up : -down;
  }
  return step;
}

constexpr double kFirstDamping = 1e-3;
constexpr Eigen::Index kDelayColumn = 2;  ///< behind offset and gain, poses and light being integrated out

using Kept = std::set<std::pair<std::size_t, std::string>>;  ///< numbers that stay as they are

/// A list of effects while it is fitted.
struct State {
  std::vector<sim::AnyEffect> effects;
  double delay_mm = 0.0;  ///< of the light, besides: what it does is not proportional to it
  std::vector<FreeNumber> free{};
  std::vector<Untold> untold{};  ///< since what shows was looked for
  Marginal marginal{};
  NormalEquations at{};
  std::shared_ptr<const CampaignRows::FreeColumns> columns{};
  bool are_columns_its_own = true;  ///< or those of a state before it
};

double dispersionOf(const NormalEquations& at) { return at.deviance / std::max(1.0, at.freedom); }
/// By how much χ² changes by chance for a number's standard error: no less than the stated noise's.
double noiseOf(const NormalEquations& at) { return std::max(1.0, dispersionOf(at)); }

constexpr double kDone = 0.1;  ///< of that noise: what is left is no chance's size

/// What a number is that nothing tells: that of an effect switched off, where it does something alone, or where the
/// defaults have no other; else as it is.
double untoldOf(const sim::AnyEffect& effect, const std::string& key) {
  const sim::AnyEffect none = noneOf(effect);
  const bool is_usual = valueOf(none, key) == valueOf(defaultsOf(effect), key);
  return valueOf(is_usual || isStrength(effect, key) ? none : effect, key);
}

/// Whether a number's standard error is less than half of what it may be.
bool isTold(const sim::AnyEffect& effect, const FittedNumber& number) {
  const auto numbers = numbersOf(effect);
  const auto found = std::ranges::find(numbers, number.key, &EffectNumber::key);
  return found == numbers.end() || number.error < 0.5 * (found->high - found->low);
}

/// The numbers of the effect at that place, with their standard errors where what they are not told from is as it is.
FittedEffect fittedAt(const State& state, std::size_t place) {
  const Eigen::MatrixXd covariance =
      pseudoInverse(state.at.gram, 1e-7).inverse * noiseOf(state.at);
  FittedEffect fitted{state.effects[place], {}};
  for (std::size_t i = 0; i < state.free.size(); ++i) {
    const FreeNumber& one = state.free[i];
    if (one.place != place) continue;
    const auto row = static_cast<Eigen::Index>(i);
    fitted.numbers.push_back({one.key, valueOf(fitted.effect, one.key),
                              std::sqrt(std::max(0.0, covariance(row, row))) * std::abs(one.step)});
  }
  return fitted;
}

/// What that may be off makes them less certain: each as much as it is.
void addUntold(const State& state, std::size_t place, FittedEffect& fitted) {
  for (std::size_t i = 0; i < state.free.size(); ++i) {
    if (state.free[i].place != place) continue;
    FittedNumber& number = *std::ranges::find(fitted.numbers, state.free[i].key, &FittedNumber::key);
    for (const Untold& one : state.untold)
      number.error = std::hypot(number.error, valueOf(state.effects[one.number.place], one.number.key) *
                                                  one.change[static_cast<Eigen::Index>(i)]);
  }
}

class Descent {
 public:
  Descent(const CampaignRows& rows, const std::vector<std::size_t>& places, const RefitOptions& options)
      : rows_(rows), places_(places), options_(options) {}

  /// All numbers that can be told apart where the fit is now: a radius shows only once there is
  /// something that has it.
  Result<> freeWhatShows(State& state) const {
    state.free = withSteps(state, state.effects, candidates(state.effects));
    if (auto looked = look(state); !looked) return looked;
    ToldApart apart = toldApart(state.free, state.at, [this](const FreeNumber& one) {
      return untold_.contains({one.place, one.key});
    });
    state.untold = std::move(apart.untold);
    if (apart.kept.size() == state.free.size()) return {};
    state.free = std::move(apart.kept);
    return look(state);
  }

  /// Derivatives are those of the state that it began at, as long as χ² falls about as they promise: simulating them
  /// takes most of the time.
  Result<> descend(State& state) const {
    constexpr int kMostSteps = 12;
    constexpr double kNothing = 1e-3;  // of the noise is not worth a step
    constexpr double kAsPromised = 0.7;
    constexpr double kMostDelay_mm = 20.0;  // at once
    double damping = kFirstDamping;
    for (int k = 0; k < kMostSteps && !state.free.empty() && damping < 1e8; ++k) {
      const double noise = noiseOf(state.at), promised = promiseOf(state);
      if (promised < kNothing * noise) break;
      const BoundedStep step = boundedStep(state.effects, state.free, state.at, damping);
      State next{state.effects, state.delay_mm};
      if (rows_.hasDelay())
        next.delay_mm += std::clamp(
            (state.at.others.coefficient - state.at.others_by_free * step.change)[kDelayColumn] / (1.0 + damping),
            -kMostDelay_mm, kMostDelay_mm);
      for (std::size_t i = 0; i < state.free.size(); ++i)
        next.effects = moved(std::move(next.effects), state.free[i],
                             step.change[static_cast<Eigen::Index>(i)] * state.free[i].step);
      next.free = state.free;
      if (auto seen = evaluate(next, &state); !seen) return seen;
      const double better = state.at.deviance - next.at.deviance;
      if (better > 0.0) {
        state = std::move(next);
        damping = std::max(1e-9, 0.1 * damping);
        if (better < kDone * noise) break;
        if (better > kAsPromised * step.promised) continue;
      } else if (state.are_columns_its_own) {
        if (promised < kDone * noise) break;
        damping *= 30.0;
        continue;
      }
      state.free = again(state, state.effects);
      if (auto looked = look(state); !looked) return looked;
    }
    return {};
  }

  Result<> fit(State& state) const {
    if (auto shown = freeWhatShows(state); !shown) return shown;
    for (int round = 0; round < 3; ++round) {
      const std::size_t before = state.free.size();
      if (auto done = descend(state); !done) return done;
      if (auto shown = freeWhatShows(state); !shown) return shown;
      if (state.free.size() <= before && promiseOf(state) < kDone * noiseOf(state.at)) break;
    }
    return {};
  }

  /// What shapes an effect is looked for farther off, too: a ghost fits best at every half pixel, where it is between
  /// pixels least, and a descent ends at the first of them.
  Result<> lookFarther(State& state) const {
    constexpr int kMostTimes = 3;
    for (int k = 0; k < kMostTimes; ++k) {
      auto farther = bestFarther(state);
      if (!farther) return farther.error();
      if (!*farther) return {};
      if (auto done = fit(**farther); !done) return done;
      if (!((*farther)->at.deviance < state.at.deviance - 1.0)) return {};
      state = *std::move(*farther);
    }
    return {};
  }

  /// The strength that is least needed goes back to nothing, one after the other; the last one of an
  /// effect stays. Standard errors only say which: those of numbers that answer for each other are large, and yet
  /// there may be no doing without one of them.
  Result<> dropNeedless(State& state) {
    for (const std::size_t place : places_) {
      std::vector<std::string> needed;
      while (const auto least = leastStrength(fittedAt(state, place), options_.droppable, needed)) {
        if (least->errors >= kNeeded) break;
        State fewer = state;
        fewer.effects[place] = without(fewer.effects[place], least->key);
        kept_.emplace(place, least->key);
        if (auto done = fit(fewer); !done) return done;
        if (isWorse(fewer, state)) {
          needed.push_back(least->key);
          kept_.erase({place, least->key});
        } else {
          state = std::move(fewer);
        }
      }
    }
    return {};
  }

  /// Numbers that could be anything within their bounds, and those that moved before it showed that nothing tells them,
  /// stay as they `began`, what makes an effect strong at nothing, but in a camera file: rounding moved them, and what
  /// they do not change here they may change elsewhere (a waveform's second harmonic is in no range).
  Result<> keepWhatIsNotTold(const std::vector<sim::AnyEffect>& began, State& state) {
    bool is_any = false;  // what stays now does not come back, so that this ends
    const State before = state;
    const Kept untold = untold_;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const std::size_t place = places_[i];
      const std::vector<FittedNumber> fitted = fittedAt(state, place).numbers;
      for (const FreeNumber& one : freeNumbersOf(state.effects, {place})) {
        const double was =
            i < options_.of_file ? valueOf(began[place], one.key) : untoldOf(began[place], one.key);
        const auto number = std::ranges::find(fitted, one.key, &FittedNumber::key);
        if (valueOf(state.effects[place], one.key) == was) continue;
        if (number != fitted.end() && isTold(state.effects[place], *number)) continue;
        state.effects[place] = withNumber(state.effects[place], one.key, was);
        untold_.emplace(place, one.key);
        is_any = true;
      }
    }
    if (!is_any) return {};
    if (auto done = fit(state); !done) return done;
    if (isWorse(state, before)) {  // together the data tell them
      state = before, untold_ = untold;
      return {};
    }
    return keepWhatIsNotTold(began, state);
  }

 private:
  static constexpr double kNeeded = 2.0;  ///< standard errors

  /// By how much χ² may fall, the light's delay being moved, too.
  [[nodiscard]] double promiseOf(const State& state) const {
    const double promised = boundedStep(state.effects, state.free, state.at, kFirstDamping).promised;
    if (!rows_.hasDelay()) return promised;
    const Fit& others = state.at.others;
    const double delay = others.coefficient[kDelayColumn], variance = others.inverse(kDelayColumn, kDelayColumn);
    return promised + (variance > 0.0 ? delay * delay / variance : 0.0);
  }

  /// By more than those squared for each number that it has fewer.
  static bool isWorse(const State& fewer, const State& state) {
    const auto numbers = static_cast<double>(state.free.size()) - static_cast<double>(fewer.free.size());
    const double worse = (fewer.at.deviance - state.at.deviance) / noiseOf(state.at);
    return worse > kNeeded * kNeeded * std::max(1.0, numbers);
  }

  /// Where one number that does nothing by itself is a fifth, a half, once or twice of what it or its default is farther
  /// on or back, and from where most is promised by how strong the effect is there, which is what is linear; nothing
  /// where none promises a χ² that is 4 less.
  Result<std::optional<State>> bestFarther(const State& state) const {
    std::optional<State> best;
    double least = state.at.deviance - 4.0;
    for (const FreeNumber& one : state.free) {
      const sim::AnyEffect& effect = state.effects[one.place];
      const double size = std::max(std::abs(valueOf(effect, one.key)), std::abs(valueOf(defaultsOf(effect), one.key)));
      if (isStrength(effect, one.key) || std::ranges::count(options_.droppable, one.key) > 0) continue;
      for (const double share : {-2.0, -1.0, -0.5, -0.2, 0.2, 0.5, 1.0, 2.0}) {
        State there{moved(state.effects, one, share * size), state.delay_mm};
        there.free = again(state, there.effects);
        std::erase_if(there.free, [&](const FreeNumber& other) {
          return !isStrength(there.effects[other.place], other.key);
        });
        if (auto seen = evaluate(there); !seen) return seen.error();
        const double promised = there.at.deviance - boundedStep(there.effects, there.free, there.at, kFirstDamping).promised;
        if (promised < least) least = promised, best = std::move(there);
      }
    }
    return best;
  }

  Result<> look(State& state) const {
    constexpr int kMostTimes = 3;  // rounding alone does not grow with the step
    if (auto seen = evaluate(state); !seen) return seen;
    for (int k = 0; k < kMostTimes && suitSteps(state); ++k)
      if (auto seen = evaluate(state); !seen) return seen;
    return {};
  }

  /// With the derivatives of a state that has the same free numbers; null: with its own.
  Result<> evaluate(State& state, const State* like = nullptr) const {
    const auto made = like == nullptr ? std::make_shared<CampaignRows::FreeColumns>() : nullptr;
    const auto evidence = rows_.evidenceLeft({.effects = state.effects,
                                              .free = state.free,
                                              .terms = options_.terms,
                                              .with_numbers = options_.with_numbers,
                                              .delay_mm = state.delay_mm,
                                              .columns = like != nullptr ? like->columns.get() : nullptr,
                                              .made = made.get()});
    if (!evidence) return evidence.error();
    state.columns = like != nullptr ? like->columns : made, state.are_columns_its_own = like == nullptr;
    state.marginal = marginalise(*evidence, options_.scales);
    state.at = normalEquationsOf(state.marginal, state.free.size());
    return {};
  }

  /// Steps of half a standard error to four: of a change that hardly shows, rounding of images in single precision is a
  /// large part, and would pass for what no other number does; one that shows as hundreds is no derivative.
  static bool suits(double size) { return size >= 0.25 && size <= 16.0; }

  /// To a standard error, those that do not suit. Whether any was changed.
  static bool suitSteps(State& state) {
    bool is_any = false;
    for (std::size_t i = 0; i < state.free.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double size = state.at.gram(row, row);
      if (!(size > 0.0) || suits(size)) continue;
      FreeNumber& one = state.free[i];
      const double other = longestStep(state.effects[one.place], one.key, one.step / std::sqrt(size));
      const double ratio = std::abs(other / one.step);
      if (!(ratio > 1.5 || ratio < 1.0 / 1.5)) continue;
      one.step = other, is_any = true;
    }
    return is_any;
  }

  [[nodiscard]] std::vector<FreeNumber> candidates(const std::vector<sim::AnyEffect>& effects) const {
    std::vector<FreeNumber> all = freeNumbersOf(effects, places_);
    std::erase_if(all, [&](const FreeNumber& one) {
      const auto only = options_.only.find(one.place);
      return kept_.contains({one.place, one.key}) ||
             (only != options_.only.end() && std::ranges::count(only->second, one.key) == 0);
    });
    return all;
  }

  /// With the steps that suited before, or were as long as they may be.
  static std::vector<FreeNumber> withSteps(const State& before, const std::vector<sim::AnyEffect>& effects,
                                           std::vector<FreeNumber> numbers) {
    for (FreeNumber& one : numbers) {
      for (std::size_t i = 0; i < before.free.size(); ++i) {
        const FreeNumber& was = before.free[i];
        const auto row = static_cast<Eigen::Index>(i);
        if (was.place != one.place || was.key != one.key) continue;
        const double size = before.at.gram(row, row), step = longestStep(effects[one.place], one.key, was.step);
        if (suits(size) || (size < 1.0 && std::abs(step) > std::abs(one.step))) one.step = step;
      }
    }
    return numbers;
  }

  /// The same numbers.
  [[nodiscard]] std::vector<FreeNumber> again(const State& before,
                                              const std::vector<sim::AnyEffect>& effects) const {
    std::vector<FreeNumber> kept = candidates(effects);
    std::erase_if(kept, [&](const FreeNumber& one) {
      return std::ranges::none_of(before.free, [&](const FreeNumber& was) {
        return was.place == one.place && was.key == one.key;
      });
    });
    return withSteps(before, effects, std::move(kept));
  }

  const CampaignRows& rows_;
  const std::vector<std::size_t>& places_;
  const RefitOptions& options_;
  Kept kept_{};    ///< at nothing, as they are not needed
  Kept untold_{};  ///< as they began
};

}  // namespace

Result<Refitted> refit(const CampaignRows& rows, std::vector<sim::AnyEffect> effects,
                       const std::vector<std::size_t>& places, const RefitOptions& options) {
  const std::vector<sim::AnyEffect> began = effects;
  State state{std::move(effects)};
  Descent descent{rows, places, options};
  if (auto done = descent.fit(state); !done) return done.error();
  if (options.looks_farther)
    if (auto done = descent.lookFarther(state); !done) return done.error();
  if (!options.droppable.empty()) {
    if (auto done = descent.dropNeedless(state); !done) return done.error();
  }
  if (auto done = descent.keepWhatIsNotTold(began, state); !done) return done.error();
  const NormalEquations& at = state.at;
  Refitted result{
      .effects = state.effects, .free = state.free, .deviance = at.deviance, .dispersion = dispersionOf(at)};
  const double size = std::max(1.0, result.dispersion);
  for (const std::size_t place : places) {
    result.fitted.push_back(fittedAt(state, place));
    addUntold(state, place, result.fitted.back());
  }
  result.offset_mm = at.others.coefficient[0], result.gain_percent = at.others.coefficient[1];
  const Eigen::Index common = rows.hasDelay() ? kDelayColumn + 1 : kDelayColumn;
  result.moved_mm = state.delay_mm;
  if (rows.hasDelay()) result.delay_mm = state.delay_mm + at.others.coefficient[kDelayColumn];
  result.common_covariance.topLeftCorner(common, common) =
      size * at.others.inverse.topLeftCorner(common, common);
  result.marginal = std::move(state.marginal);
  return result;
}

Zero zeroOf(const Refitted& refitted, double known_mm, bool tells_delay) {
  constexpr Eigen::Index kOffset = 0, kGain = 1, kDelay = 2;
  Eigen::Matrix3d covariance = refitted.common_covariance;
  Eigen::Vector3d at{refitted.offset_mm, refitted.gain_percent, refitted.delay_mm};
  const double variance = covariance(kDelay, kDelay);
  const bool is_chance = std::abs(known_mm + at[kDelay]) <= 3.0 * std::sqrt(variance);
  if (variance > 0.0 && (is_chance || !tells_delay)) {
    // Offset and gain where the delay is known to be none.
    const Eigen::Vector3d with_delay = covariance.col(kDelay) / variance;
    at += with_delay * (-known_mm - at[kDelay]);
    covariance -= variance * with_delay * with_delay.transpose();
    at[kDelay] = -known_mm;
  }
  // The column of the delay is what it does beyond an offset; where the light was moved by it, it is all.
  const double offset_variance =
      covariance(kOffset, kOffset) + covariance(kDelay, kDelay) - 2.0 * covariance(kOffset, kDelay);
  return {at[kOffset] - (at[kDelay] - refitted.moved_mm), std::sqrt(std::max(0.0, offset_variance)),
          at[kDelay], at[kGain], std::sqrt(std::max(0.0, covariance(kGain, kGain)))};
}

}  // namespace toftwin::discover
