// SPDX-License-Identifier: Apache-2.0
// What became of the choice: its numbers, what else it could be, the experiment that would tell.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "calib/discover/shape_choice.h"

namespace toftwin::discover {
namespace {

/// Whether these data do not tell it from the chosen one: two standard errors over captures.
bool isAsGood(const Explanation& other, const Explanation& chosen) {
  return chosen.gain.total - other.gain.total <= 2.0 * difference(chosen.gain, other.gain).error;
}

/// Whether the catalogue has several effects that do what is seen. Then its cause need not be one of them,
/// and a formula that is theirs is one more explanation.
bool hasManyNames(const std::vector<Explanation>& all, std::size_t chosen) {
  return all[chosen].named && std::ranges::any_of(eligible(all), [&](std::size_t i) {
           return i != chosen && all[i].named && all[i].refused.empty() && isAsGood(all[i], all[chosen]);
         });
}

/// The best explanation of each other set of covariates; `with_own`: of the chosen one's, too.
std::vector<std::size_t> rivals(const std::vector<Explanation>& all, std::size_t chosen, bool with_own) {
  std::map<std::pair<std::vector<std::string>, bool>, std::size_t> best;
  for (const std::size_t i : eligible(all)) {
    if (i == chosen) continue;
    const bool is_same =
        all[i].covariates == all[chosen].covariates && !all[i].is_catalogue && !all[chosen].is_catalogue;
    if (is_same) continue;
    if (!all[i].refused.empty()) continue;
    if (!with_own && !all[i].is_catalogue && std::ranges::includes(all[i].covariates, all[chosen].covariates))
      continue;
    const auto key =
        std::pair{all[i].is_catalogue ? std::vector{all[i].name} : all[i].covariates, all[i].is_catalogue};
    const auto [at, is_new] = best.try_emplace(key, i);
    if (!is_new && all[i].gain.total > all[at->second].gain.total) at->second = i;
  }
  std::vector<std::size_t> places;
  for (const auto& [key, place] : best) places.push_back(place);
  return places;
}

/// How often the chosen one beats all rivals when captures are drawn with replacement.
double stability(const std::vector<Explanation>& all, std::size_t chosen,
                 const std::vector<std::size_t>& others) {
  const auto& own = all[chosen].gain.by_capture;
  if (own.empty()) return 0.0;
  constexpr int kDraws = 200;
  std::uint64_t state = 0x9e3779b97f4a7c15ULL;
  int wins = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<int> times(own.size());
    for (std::size_t c = 0; c < own.size(); ++c) {
      state ^= state << 13, state ^= state >> 7, state ^= state << 17;  // Marsaglia's xorshift
      ++times[state % own.size()];
    }
    const auto sum = [&](const Explanation& one) {
      double total = -one.price;
      for (std::size_t c = 0; c < own.size(); ++c) total += times[c] * one.gain.by_capture[c];
      return total;
    };
    const double mine = sum(all[chosen]);
    wins += mine > 0.0 && std::ranges::none_of(others, [&](std::size_t i) { return sum(all[i]) > mine; });
  }
  return wins / static_cast<double>(kDraws);
}

/// Coefficients of one group on top of the context's model.
Eigen::VectorXd coefficients(const Part& prepared, const Group& group) {
  Columns columns = prepared.model;
  append(columns, group);
  return fit(prepared.marginal, columns).coefficient.tail(static_cast<Eigen::Index>(group.count));
}

/// Correlation of two fitted curves over the captures, the model projected out.
double correlationOf(const Part& prepared, const Group& a, const Group& b) {
  Columns of_a, of_b;
  append(of_a, a), append(of_b, b);
  const Fit model = fit(prepared.marginal, prepared.model);
  const auto left = [&](const Columns& x, const Columns& y) {
    Eigen::MatrixXd all = prepared.marginal.gram(x, y);
    const Eigen::MatrixXd to_x = prepared.marginal.gram(x, prepared.model),
                          to_y = prepared.marginal.gram(prepared.model, y), known = to_x * model.inverse;
    all -= known * to_y;
    return all;
  };
  const Eigen::VectorXd fa = coefficients(prepared, a), fb = coefficients(prepared, b);
  const double aa = fa.dot(left(of_a, of_a) * fa), bb = fb.dot(left(of_b, of_b) * fb);
  return aa > 0.0 && bb > 0.0 ? fa.dot(left(of_a, of_b) * fb) / std::sqrt(aa * bb) : 0.0;
}

constexpr double kAlike = 0.5;  ///< correlation of two curves that may be one
constexpr double kTheSame =
    1.0 - 0.0025;  ///< its square of two that are one: a twentieth of their size is not

double curveAt(const TermGroup& group, const std::vector<double>& coefficient,
               const std::map<std::string, double>& at) {
  double sum = 0.0;
  for (std::size_t t = 0; t < group.terms.size(); ++t) {
    sum += coefficient[t] * group.terms[t].at([&](const std::string& name) {
      const auto found = at.find(name);
      return found == at.end() ? 0.0 : found->second;
    });
  }
  return sum;
}

/// One covariate goes from end to end, the others are held in the middle of their spread: where do they differ most?
/// What is told to be held is what only one of both explanations has, if there is such. Carriers are none.
std::optional<Experiment> experimentOf(const Context& context, const Effect& effect,
                                       const Alternative& other) {
  std::set<std::string> names(effect.covariates.begin(), effect.covariates.end());
  names.insert(other.covariates.begin(), other.covariates.end());
  std::erase_if(names, [&](const std::string& name) { return infoOf(context, name) == nullptr; });
  std::map<std::string, double> middle;
  for (const std::string& name : names) {
    const CovariateInfo* info = infoOf(context, name);
    if (info->quantiles.empty()) return std::nullopt;
    middle[name] = info->quantiles[info->quantiles.size() / 2];
  }
  const auto isOfOne = [&](const std::string& name) {
    return std::ranges::count(effect.covariates, name) != std::ranges::count(other.covariates, name);
  };
  std::optional<Experiment> best;
  const TermGroup& mine = effect.parts.front().group;
  for (const std::string& vary : names) {
    const auto& q = infoOf(context, vary)->quantiles;
    for (std::size_t i = 0; i < q.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        auto low = middle, high = middle;
        low[vary] = q[k], high[vary] = q[i];
        const double difference =
            (curveAt(mine, effect.coefficient, high) - curveAt(mine, effect.coefficient, low)) -
            (curveAt(other.group, other.coefficient, high) - curveAt(other.group, other.coefficient, low));
        if (best && std::abs(difference) <= std::abs(best->difference)) continue;
        std::string hold;
        double held_at = 0.0;
        for (const std::string& name : names)
          if (name != vary && (hold.empty() || isOfOne(name))) hold = name, held_at = middle[name];
        best = Experiment{vary, hold, q[k], q[i], held_at, difference};
      }
    }
  }
  return best;
}

}  // namespace

double correlationOf(const Context& context, const TermGroup& a, const TermGroup& b) {
  const TermGroup both[]{a, b};
  const Part prepared = prepare(context, both, false);
  return correlationOf(prepared, prepared.marginal.groups[prepared.first],
                       prepared.marginal.groups[prepared.first + 1]);
}

Effect effectOf(const Context& context, const std::vector<Explanation>& all, std::size_t chosen) {
  const Explanation& mine = all[chosen];
  std::vector<TermGroup> groups;
  std::vector<std::size_t> shown{chosen};
  const bool has_many_names = hasManyNames(all, chosen);
  const auto others = rivals(all, chosen, has_many_names);
  for (const std::size_t i : others)
    if (isAsGood(all[i], mine)) shown.push_back(i);
  for (const std::size_t i : shown)
    if (!all[i].is_catalogue) groups.push_back(all[i].fitted.group);
  const bool needs_catalogue = std::ranges::any_of(shown, [&](std::size_t i) { return all[i].is_catalogue; });
  const Part prepared = prepare(context, groups, needs_catalogue);
  std::size_t next = prepared.first;
  std::vector<const Group*> in_marginal;
  for (const std::size_t i : shown) {
    const Group* group = &prepared.marginal.groups[next];
    if (all[i].is_catalogue) {
      group = &*std::ranges::find(prepared.marginal.groups, all[i].name, &Group::name);
    } else {
      ++next;
    }
    in_marginal.push_back(group);
  }
  const auto plain = [](const Eigen::VectorXd& v) { return std::vector<double>(v.begin(), v.end()); };
  Effect effect;
  effect.name = mine.name, effect.is_catalogue = mine.is_catalogue;
  effect.covariates = mine.covariates, effect.stage = mine.stage;
  if (!mine.is_catalogue) effect.parts.push_back(mine.fitted);
  if (mine.named) {
    effect.fit = mine.named, effect.numbers = mine.named->numbers;
  } else {
    effect.coefficient = plain(coefficients(prepared, *in_marginal[0]));
  }
  effect.gain = against0(mine.gain);
  effect.gain.mean -= mine.price;
  effect.predicts = holds(mine.gain);
  effect.frequency = stability(all, chosen, others);
  for (std::size_t s = 1; s < shown.size(); ++s) {
    const Explanation& other = all[shown[s]];
    const double correlation = correlationOf(prepared, *in_marginal[0], *in_marginal[s]);
    // Curves that have little in common explain different things, of which one may be nothing.
    if (!mine.is_catalogue && !other.is_catalogue && std::abs(correlation) < kAlike) continue;
    // A formula that is the effect's own is no other explanation, if it has one name.
    if (mine.named && !has_many_names && !other.is_catalogue && correlation * correlation > kTheSame)
      continue;
    Alternative alternative{other.name,
                            other.covariates,
                            other.fitted.group,
                            plain(coefficients(prepared, *in_marginal[s])),
                            difference(mine.gain, other.gain),
                            other.named,
                            correlation};
    effect.alternatives.push_back(std::move(alternative));
  }
  std::ranges::sort(effect.alternatives, {}, [](const Alternative& a) { return a.worse.mean; });
  if (!effect.alternatives.empty() && !effect.is_catalogue && !effect.alternatives[0].group.terms.empty())
    effect.experiment = experimentOf(context, effect, effect.alternatives[0]);
  for (const Explanation& one : all) {
    if (!one.refused.empty()) effect.refused.push_back(one.name + ": " + one.refused);
    if (one.covariates != mine.covariates && !one.is_catalogue) continue;
    effect.tried.push_back({one.name, one.numbers, against0(one.gain), difference(mine.gain, one.gain)});
    effect.tried.back().gain.mean = one.gain.total;
  }
  std::ranges::sort(effect.tried, std::ranges::greater{}, [](const TriedShape& t) { return t.gain.mean; });
  return effect;
}

}  // namespace toftwin::discover
