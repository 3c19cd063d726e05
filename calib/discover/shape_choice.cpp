// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/shape_choice.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

#include "calib/discover/candidates.h"

namespace toftwin::discover {
namespace {

using Set = std::vector<std::string>;
constexpr std::size_t kSumKnots = 7;

Set sorted(Set names) {
  std::ranges::sort(names);
  return names;
}

const CovariateInfo* find(const Context& context, const std::string& name) {
  const auto found = std::ranges::find(context.covariates, name, &CovariateInfo::name);
  return found == context.covariates.end() ? nullptr : &*found;
}

std::vector<Form> formsOf(const Context& context, const Set& set) {
  std::vector<const CovariateInfo*> infos;
  for (const std::string& name : set) infos.push_back(find(context, name));
  if (std::ranges::find(infos, nullptr) != infos.end()) return {};
  if (infos.size() == 1) return formsIn(*infos[0]);
  return infos.size() == 2 ? formsIn(*infos[0], *infos[1]) : std::vector<Form>{};
}

Explanation explanationOf(FittedForm fitted) {
  Explanation out;
  out.name = fitted.group.name;
  out.covariates = sorted(covariatesOf(fitted.group));
  if (!fitted.group.terms.empty()) out.stage = fitted.group.terms.front().stage;
  out.numbers = static_cast<int>(fitted.group.terms.size() + fitted.inner.size());
  for (const Inner& inner : fitted.form.inner) out.price += inner.price;
  out.fitted = std::move(fitted);
  return out;
}

Explanation curve(TermGroup group) {
  FittedForm fitted;
  fitted.group = std::move(group);
  return explanationOf(std::move(fitted));
}

/// Both functions on their own, added up.
Explanation sumOf(const CovariateInfo& a, const CovariateInfo& b) {
  TermGroup both = smoothIn(a, kSumKnots);
  for (Term& term : smoothIn(b, kSumKnots).terms) both.terms.push_back(std::move(term));
  both.name = fmt::format("smooth in {} plus smooth in {}", a.name, b.name);
  Explanation out = curve(std::move(both));
  out.is_sum = true;
  return out;
}

/// Explanations without their gains, for some sets of covariates.
std::vector<Explanation> explanationsFor(const Context& context, const std::vector<Set>& sets) {
  std::vector<Explanation> all;
  std::vector<Form> forms;
  for (const Set& set : sets) {
    for (Form& form : formsOf(context, set)) forms.push_back(std::move(form));
    for (const TermGroup& group : context.generic) {
      if (sorted(covariatesOf(group)) == set) all.push_back(curve(group));
    }
    if (set.size() == 1) {
      for (const auto& [knots, name] :
           {std::pair{2 * kSmoothKnots - 1, "finer "}, {4 * kSmoothKnots - 3, "finest "}}) {
        TermGroup finer = smoothIn(*find(context, set[0]), knots);
        finer.name = name + finer.name;
        if (finer.terms.size() >= kSmoothKnots) all.push_back(curve(std::move(finer)));
      }
    } else {
      all.push_back(sumOf(*find(context, set[0]), *find(context, set[1])));
    }
  }
  for (FittedForm& fitted :
       findInnerNumbers(context.source, context.known, context.scales, std::move(forms))) {
    if (fitted.statistic > 0.0) all.push_back(explanationOf(std::move(fitted)));
  }
  return all;
}

Part prepare(const Context& context, std::span<const TermGroup> groups, bool with_catalogue) {
  std::vector<TermGroup> extra = context.known;
  extra.insert(extra.end(), groups.begin(), groups.end());
  Part out;
  const bool needs_catalogue = with_catalogue || !context.catalogue.empty();
  out.marginal =
      marginalise(needs_catalogue ? context.source.evidence(extra) : context.source.withoutCatalogue(extra),
                  context.scales);
  out.model = modelOf(context, out.marginal, extra.size());
  out.first = out.marginal.groups.size() - groups.size();
  out.end = groups.size();
  return out;
}

/// The catalogue's effects that are not in the model yet; their groups are appended to `which`.
std::vector<Explanation> catalogueOf(const Context& context, const Part& part,
                                     std::vector<std::size_t>& which) {
  std::vector<Explanation> all;
  for (std::size_t g = 0; g < part.first; ++g) {
    const Group& group = part.marginal.groups[g];
    const bool is_known = std::ranges::find(context.catalogue, group.name) != context.catalogue.end();
    if (group.kind != Kind::Catalogue || is_known) continue;
    which.push_back(g);
    Explanation one;
    one.name = group.name, one.covariates = sorted(group.covariates), one.stage = group.stage;
    one.is_catalogue = true;
    one.numbers = std::max(group.numbers, static_cast<int>(group.count));
    all.push_back(std::move(one));
  }
  return all;
}

/// Fills the gains, on the same folds for all; adds the catalogue's effects.
void judge(const Context& context, std::vector<Explanation>& all) {
  std::vector<TermGroup> groups;
  for (const Explanation& one : all) groups.push_back(one.fitted.group);
  std::vector<Explanation> catalogue;
  inParts(context, groups, [&](const Part& part) {
    std::vector<std::size_t> which;
    std::vector<Explanation*> whose;
    for (std::size_t i = part.begin; i < part.end; ++i)
      which.push_back(part.first + i - part.begin), whose.push_back(&all[i]);
    if (part.begin == 0) catalogue = catalogueOf(context, part, which);
    for (Explanation& one : catalogue)
      if (part.begin == 0) whose.push_back(&one);
    auto gains = crossValidate(part.marginal, part.model, which);
    for (std::size_t i = 0; i < whose.size(); ++i) {
      whose[i]->gain = std::move(gains[i]);
      whose[i]->gain.total -= whose[i]->price;
    }
  });
  for (Explanation& one : catalogue) all.push_back(std::move(one));
}

/// Sets of covariates whose generic groups do nearly as well as the best group, at most eight.
std::vector<Set> shortlist(const Context& context) {
  std::vector<Gain> gains;
  inParts(context, context.generic, [&](const Part& part) {
    std::vector<std::size_t> which;
    for (std::size_t i = part.begin; i < part.end; ++i) which.push_back(part.first + i - part.begin);
    for (Gain& gain : crossValidate(part.marginal, part.model, which)) gains.push_back(std::move(gain));
  });
  std::map<Set, double> best;
  double most = 0.0;
  const Gain* leader = nullptr;
  for (std::size_t i = 0; i < gains.size(); ++i) {
    const auto [at, is_new] = best.try_emplace(sorted(covariatesOf(context.generic[i])), gains[i].total);
    if (!is_new) at->second = std::max(at->second, gains[i].total);
    if (leader == nullptr || gains[i].total > most) most = gains[i].total, leader = &gains[i];
  }
  if (leader == nullptr) return {};
  const double tolerance = std::max(0.2 * most, 3.0 * against0(*leader).error);
  std::vector<std::pair<double, Set>> order;
  for (const auto& [set, gain] : best)
    if (gain >= most - tolerance) order.emplace_back(-gain, set);
  std::ranges::sort(order);
  std::vector<Set> chosen;
  // The best functions of one covariate always compete: a surface over two may only look better for having
  // more.
  for (const std::size_t size : {1U, 2U}) {
    std::size_t taken = 0;
    for (const auto& [gain, set] : order)
      if (set.size() == size && taken < 4) chosen.push_back(set), ++taken;
  }
  std::vector<std::pair<double, Set>> singles;
  for (const auto& [set, gain] : best)
    if (set.size() == 1) singles.emplace_back(-gain, set);
  std::ranges::sort(singles);
  for (std::size_t i = 0; i < std::min<std::size_t>(2, singles.size()); ++i)
    if (std::ranges::find(chosen, singles[i].second) == chosen.end()) chosen.push_back(singles[i].second);
  return chosen;
}

bool contains(const Set& large, const Set& small) { return std::ranges::includes(large, small); }

}  // namespace

Columns modelOf(const Context& context, const Marginal& marginal, std::size_t extra) {
  Columns columns = nuisanceColumns(marginal);
  for (const Group& group : marginal.groups) {
    if (group.kind == Kind::Catalogue &&
        std::ranges::find(context.catalogue, group.name) != context.catalogue.end())
      append(columns, group);
  }
  const std::size_t first = marginal.groups.size() - extra;
  for (std::size_t i = 0; i < context.known.size(); ++i) append(columns, marginal.groups[first + i]);
  return columns;
}

void inParts(const Context& context, const std::vector<TermGroup>& groups,
             const std::function<void(const Part&)>& use) {
  constexpr std::size_t kColumnsAtOnce = 64;
  std::size_t begin = 0;
  do {
    std::size_t end = begin;
    for (std::size_t columns = 0; end < groups.size() && (columns < kColumnsAtOnce || end == begin); ++end)
      columns += groups[end].terms.size();
    Part part = prepare(context, std::span{groups}.subspan(begin, end - begin), begin == 0);
    part.begin = begin, part.end = end;
    use(part);
    begin = end;
  } while (begin < groups.size());
}

std::vector<Explanation> compete(const Context& context) {
  auto all = explanationsFor(context, shortlist(context));
  judge(context, all);
  return all;
}

std::vector<Explanation> competeFor(const Context& context, const std::vector<std::string>& covariates) {
  auto all = explanationsFor(context, {sorted(covariates)});
  judge(context, all);
  std::erase_if(all, [](const Explanation& one) { return one.is_catalogue; });
  return all;
}

namespace {

const Explanation* bestOf(const std::vector<Explanation>& all, const auto& isMeant) {
  const Explanation* best = nullptr;
  for (const Explanation& one : all)
    if (isMeant(one) && (best == nullptr || one.gain.total > best->gain.total)) best = &one;
  return best;
}

/// A pair acts together only if it explains more than both on their own, and more than either alone.
bool actsTogether(const std::vector<Explanation>& all, const Set& pair) {
  const Explanation* best = bestOf(all, [&](const Explanation& one) {
    return !one.is_sum && !one.is_catalogue && one.covariates == pair;
  });
  if (best == nullptr) return true;
  return std::ranges::none_of(all, [&](const Explanation& one) {
    const bool is_part = one.covariates.size() == 1 && !one.is_catalogue && contains(pair, one.covariates);
    if (!is_part && !(one.is_sum && one.covariates == pair)) return false;
    const Difference better = difference(best->gain, one.gain);
    return best->gain.total - one.gain.total < std::max(2.5 * better.error, 0.05 * best->gain.total);
  });
}

/// Places of explanations that may be chosen.
std::vector<std::size_t> eligible(const std::vector<Explanation>& all) {
  std::map<Set, bool> together;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].is_sum) continue;
    if (!all[i].is_catalogue && all[i].covariates.size() == 2) {
      const auto [at, is_new] = together.try_emplace(all[i].covariates, false);
      if (is_new) at->second = actsTogether(all, all[i].covariates);
      if (!at->second) continue;
    }
    places.push_back(i);
  }
  return places;
}

}  // namespace

std::optional<std::size_t> choose(const std::vector<Explanation>& all) {
  const auto places = eligible(all);
  std::optional<std::size_t> best, catalogue;
  for (const std::size_t i : places) {
    auto& leader = all[i].is_catalogue ? catalogue : best;
    if (!leader || all[i].gain.total > all[*leader].gain.total) leader = i;
  }
  if (!best || !catalogue) {
    if (!best) return catalogue;
  } else {
    const double most = all[*best].gain.total;
    const double error = difference(all[*best].gain, all[*catalogue].gain).error;
    if (most - all[*catalogue].gain.total <= std::max(std::min(error, 0.25 * most), 0.03 * most))
      return catalogue;
  }
  // The best explanation decides on the covariates, simplicity on the shape.
  std::size_t chosen = *best;
  for (const std::size_t i : places) {
    if (all[i].is_catalogue || all[i].covariates != all[*best].covariates) continue;
    const double by = all[*best].gain.total - all[i].gain.total;
    if (by > difference(all[*best].gain, all[i].gain).error) continue;
    const bool is_simpler = all[i].numbers != all[chosen].numbers
                                ? all[i].numbers < all[chosen].numbers
                                : all[i].gain.total > all[chosen].gain.total;
    if (is_simpler) chosen = i;
  }
  return chosen;
}

namespace {

/// The best explanation of each other set of covariates.
std::vector<std::size_t> rivals(const std::vector<Explanation>& all, std::size_t chosen) {
  std::map<std::pair<Set, bool>, std::size_t> best;
  for (const std::size_t i : eligible(all)) {
    if (all[i].covariates == all[chosen].covariates && all[i].is_catalogue == all[chosen].is_catalogue)
      continue;
    if (!all[i].is_catalogue && contains(all[i].covariates, all[chosen].covariates)) continue;
    const auto key = std::pair{all[i].covariates, all[i].is_catalogue};
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
    return Eigen::MatrixXd(prepared.marginal.gram(x, y) - prepared.marginal.gram(x, prepared.model) *
                                                              model.inverse *
                                                              prepared.marginal.gram(prepared.model, y));
  };
  const Eigen::VectorXd fa = coefficients(prepared, a), fb = coefficients(prepared, b);
  const double aa = fa.dot(left(of_a, of_a) * fa), bb = fb.dot(left(of_b, of_b) * fb);
  return aa > 0.0 && bb > 0.0 ? fa.dot(left(of_a, of_b) * fb) / std::sqrt(aa * bb) : 0.0;
}

double valueOf(const TermGroup& group, const std::vector<double>& coefficient,
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

/// One covariate is held in the middle of its spread, the other goes from end to end: where do they differ
/// most?
std::optional<Experiment> experimentOf(const Context& context, const Effect& effect,
                                       const Alternative& other) {
  std::set<std::string> names(effect.covariates.begin(), effect.covariates.end());
  names.insert(other.covariates.begin(), other.covariates.end());
  std::map<std::string, double> middle;
  for (const std::string& name : names) {
    const CovariateInfo* info = find(context, name);
    if (info == nullptr || info->quantiles.empty()) return std::nullopt;
    middle[name] = info->quantiles[info->quantiles.size() / 2];
  }
  std::optional<Experiment> best;
  const TermGroup& mine = effect.parts.front().group;
  for (const std::string& vary : names) {
    const auto& q = find(context, vary)->quantiles;
    for (std::size_t i = 0; i < q.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        auto low = middle, high = middle;
        low[vary] = q[k], high[vary] = q[i];
        const double difference =
            (valueOf(mine, effect.coefficient, high) - valueOf(mine, effect.coefficient, low)) -
            (valueOf(other.group, other.coefficient, high) - valueOf(other.group, other.coefficient, low));
        if (best && std::abs(difference) <= std::abs(best->difference)) continue;
        std::string hold;
        double held_at = 0.0;
        for (const std::string& name : names)
          if (name != vary) hold = name, held_at = middle[name];
        best = Experiment{vary, hold, q[k], q[i], held_at, difference};
      }
    }
  }
  return best;
}

}  // namespace

Effect effectOf(const Context& context, const std::vector<Explanation>& all, std::size_t chosen) {
  const Explanation& mine = all[chosen];
  std::vector<TermGroup> groups;
  std::vector<std::size_t> shown{chosen};
  const auto others = rivals(all, chosen);
  for (const std::size_t i : others) {
    const Difference worse = difference(mine.gain, all[i].gain);
    const double by = mine.gain.total - all[i].gain.total;
    if (by < 2.0 * worse.error) shown.push_back(i);
  }
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
  effect.coefficient = plain(coefficients(prepared, *in_marginal[0]));
  effect.gain = against0(mine.gain);
  effect.gain.mean -= mine.price;
  effect.frequency = stability(all, chosen, others);
  for (std::size_t s = 1; s < shown.size(); ++s) {
    const Explanation& other = all[shown[s]];
    Alternative alternative{other.name,
                            other.covariates,
                            other.fitted.group,
                            plain(coefficients(prepared, *in_marginal[s])),
                            difference(mine.gain, other.gain),
                            correlationOf(prepared, *in_marginal[0], *in_marginal[s])};
    effect.alternatives.push_back(std::move(alternative));
  }
  std::ranges::sort(effect.alternatives, {}, [](const Alternative& a) { return a.worse.mean; });
  if (!effect.alternatives.empty() && !effect.is_catalogue && !effect.alternatives[0].group.terms.empty())
    effect.experiment = experimentOf(context, effect, effect.alternatives[0]);
  double best = mine.gain.total;
  for (const Explanation& one : all) best = std::max(best, one.gain.total);
  for (const Explanation& one : all) {
    if (one.covariates != mine.covariates && !one.is_catalogue) continue;
    effect.tried.push_back({one.name, one.numbers, against0(one.gain), difference(mine.gain, one.gain)});
    effect.tried.back().gain.mean = one.gain.total;
  }
  std::ranges::sort(effect.tried, std::ranges::greater{}, [](const TriedShape& t) { return t.gain.mean; });
  return effect;
}

}  // namespace toftwin::discover
