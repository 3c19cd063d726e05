// SPDX-License-Identifier: Apache-2.0
// Whether an effect of the catalogue is to be named. One that merely goes with the right one fits worse than a
// free curve, or leaves something that goes with its own covariates.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/discover/shape_choice.h"

namespace toftwin::discover {
namespace {

/// Of what an effect explains: the light of a strong one's simulation is not known that well.
constexpr double kHundredth = 0.01;

/// How many shapes were tried for it: every place of a step, every time constant.
std::size_t triedFor(const Explanation& one) {
  if (one.is_catalogue) return 0;
  std::size_t tried = 1;
  for (const Inner& inner : one.fitted.form.inner) tried *= std::max<std::size_t>(1, inner.grid.size());
  return tried;
}

/// In-sample χ² of each catalogue group on top of what is known.
std::vector<std::pair<double, std::string>> byStatistic(const Context& context) {
  const Part part = prepare(context, {}, true);
  std::vector<std::pair<double, std::string>> order;
  for (const GroupScore& score : statistics(part.marginal, part.model)) {
    const Group& group = part.marginal.groups[score.group];
    if (group.kind == Kind::Catalogue) order.emplace_back(score.statistic, group.name);
  }
  std::ranges::sort(order, std::greater{});
  return order;
}

double bestGeneric(const std::vector<Explanation>& all) {
  double most = 0.0;
  for (const std::size_t i : eligible(all))
    if (!all[i].is_catalogue) most = std::max(most, all[i].gain.total);
  return most;
}

/// Groups of functions of the covariates that the effect goes with.
std::vector<TermGroup> ofItsCovariates(const Context& context, const Explanation& effect) {
  std::vector<TermGroup> groups;
  for (const TermGroup& group : context.generic) {
    const auto names = covariatesOf(group);
    const bool is_own = std::ranges::all_of(names, [&](const std::string& name) {
      const CovariateInfo* info = infoOf(context, name);
      const std::string word = info != nullptr ? info->word : context.source->wordOfCarrier(name);
      return (info == nullptr && word.empty()) || std::ranges::count(effect.covariates, word) > 0;
    });
    if (is_own) groups.push_back(group);
  }
  return groups;
}

/// The source with one more effect in its model; for a look only.
Context including(const Context& context, const Explanation& effect) {
  Context with = context;
  std::vector<const NamedFit*> fits;
  for (const auto& fit : context.included) fits.push_back(fit.get());
  fits.push_back(effect.named.get());
  with.source = context.original->named()->including(fits, false);
  return with;
}

/// Whether something remains that goes with the effect's own covariates, once it is in the model.
bool leavesSomething(const Context& with, const Explanation& effect) {
  const std::vector<TermGroup> groups = ofItsCovariates(with, effect);
  if (groups.empty()) return false;
  constexpr std::size_t kAtOnce = 4;
  Test test{with.test};
  for (std::size_t begin = 0; begin < groups.size(); begin += kAtOnce) {
    const Part part = prepare(
        with, std::span{groups}.subspan(begin, std::min(kAtOnce, groups.size() - begin)), false);
    test.add(part.marginal, part.model);
  }
  return test.result().p < with.alpha;
}

/// Whether what would be told instead of the effect says something beyond it, once it is in the model: more
/// than the best of so many shapes does by chance, and more than a hundredth of what the effect explains.
/// (The light of a strong effect's simulation is not known that well. And a formula that is the effect's own
/// leaves what it leaves.)
bool saysMore(const Context& with, const Explanation& rival, const Explanation& effect, std::size_t tried) {
  const std::vector<TermGroup> groups{rival.fitted.group};
  const Part part = prepare(with, groups, false);
  const std::size_t place = part.marginal.groups.size() - 1;
  for (const GroupScore& score : statistics(part.marginal, part.model)) {
    if (score.group != place) continue;
    const double by_chance = static_cast<double>(rival.numbers) + luckOfTheBestOf(tried);
    return score.statistic > std::max(by_chance, kHundredth * effect.gain.total);
  }
  return false;
}

}  // namespace

double luckOfTheBestOf(std::size_t tried) {
  return std::max(4.0, 2.0 * std::log(static_cast<double>(std::max<std::size_t>(1, tried))));
}

void fitCatalogue(const Context& context, std::vector<Explanation>& all) {
  // Columns explain about as much as the effect does, and more where they are freer than it.
  constexpr double kWorthIt = 0.7;
  constexpr std::size_t kMost = 8;
  const NamedEffects* named = context.source->named();
  if (named == nullptr) return;
  std::vector<std::string> names;
  const double least = kWorthIt * bestGeneric(all);
  for (const auto& [statistic, name] : byStatistic(context))
    if (statistic >= least && names.size() < kMost) names.push_back(name);
  std::vector<NamedFit> fits = named->fitNamed(names, context.known, context.scales);
  std::erase_if(all, [&](const Explanation& one) {
    return one.is_catalogue && std::ranges::find(fits, one.name, &NamedFit::name) == fits.end();
  });
  for (Explanation& one : all) {
    if (!one.is_catalogue) continue;
    NamedFit& fit = *std::ranges::find(fits, one.name, &NamedFit::name);
    one.gain = fit.gain, one.numbers = static_cast<int>(fit.numbers.size());
    one.named = std::make_shared<const NamedFit>(std::move(fit));
  }
}

std::optional<std::size_t> chooseNamed(const Context& context, std::vector<Explanation>& all) {
  std::optional<std::size_t> generic;
  std::vector<std::size_t> named;
  std::size_t curves = context.generic.size();  // those that were not on the shortlist were tried, too
  for (const Explanation& one : all) curves += triedFor(one);
  for (const std::size_t i : eligible(all)) {
    if (all[i].is_catalogue)
      named.push_back(i);
    else if (!generic || all[i].gain.total > all[*generic].gain.total)
      generic = i;
  }
  std::ranges::sort(named, std::greater{}, [&](std::size_t i) { return all[i].gain.total; });
  const auto instead = choose(all);
  const auto leavesWhatARivalSays = [&](const Context& without, const Explanation& one, std::size_t tried) {
    const Context with = including(without, one);
    return leavesSomething(with, one) && (!instead || saysMore(with, all[*instead], one, tried));
  };
  std::optional<std::size_t> chosen;
  for (const std::size_t i : named) {
    Explanation& one = all[i];
    const auto isWorseThan = [&](const Explanation& other, std::size_t tried) {
      return other.gain.total - one.gain.total >
             std::max(2.0 * difference(other.gain, one.gain).error, luckOfTheBestOf(tried));
    };
    const auto by = [&](const Explanation& other) {
      return fmt::format(" explains more, by {:.0f} ± {:.0f} in χ²", other.gain.total - one.gain.total,
                         difference(other.gain, one.gain).error);
    };
    if (std::ranges::count(context.withdrawn, one.name) > 0)
      one.refused = "beside it something was left along the curve that it was not told from";
    else if (one.named->is_at_bound)
      one.refused = "it would have to be stronger than it can be";
    else if (!holds(one.gain))
      one.refused = "it does not predict other captures";
    else if (generic && isWorseThan(all[*generic], curves) &&
             all[*generic].gain.total - one.gain.total > kHundredth * one.gain.total)
      one.refused = "a curve that goes with " + all[*generic].name + by(all[*generic]);
    else if (chosen && isWorseThan(all[*chosen], named.size()))
      one.refused = all[*chosen].name + by(all[*chosen]);
    else if (leavesWhatARivalSays(context, one, curves))
      one.refused = "what it leaves still goes with its covariates";
    if (!one.refused.empty()) continue;
    const bool is_simpler =
        chosen && one.numbers < all[*chosen].numbers &&
        all[*chosen].gain.total - one.gain.total < difference(all[*chosen].gain, one.gain).error;
    if (!chosen || is_simpler) chosen = i;
  }
  if (!chosen) return std::nullopt;
  // An effect with many numbers, such as a table, can look like anything: a formula with fewer that is as
  // good says what it is.
  for (const std::size_t i : eligible(all)) {
    const Explanation& one = all[i];
    if (one.is_catalogue || one.numbers >= all[*chosen].numbers) continue;
    const double by = all[*chosen].gain.total - one.gain.total;
    if (by < difference(all[*chosen].gain, one.gain).error) return std::nullopt;
  }
  return chosen;
}

}  // namespace toftwin::discover
