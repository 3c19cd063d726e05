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

}  // namespace

std::vector<const Term*> carriersAlong(const Context& context, const Set& set) {
  std::vector<const Term*> carriers;
  for (const TermGroup& group : context.generic) {
    if (group.terms.empty() || sorted(covariatesOf(group)) != set) continue;
    const Term& first = group.terms.front();
    const bool is_one = std::ranges::all_of(
        group.terms, [&](const Term& term) { return term.carrier == first.carrier && !term.factors.empty(); });
    const bool is_new =
        std::ranges::none_of(carriers, [&](const Term* other) { return other->carrier == first.carrier; });
    if (is_one && is_new && !first.carrier.empty()) carriers.push_back(&first);
  }
  return carriers;
}

namespace {

/// The formulas of a covariate, for what light does along it: as likely as for the range.
std::vector<Form> carriedForms(const Context& context, const Set& set) {
  const auto carriers = carriersAlong(context, set);
  const auto covariate = std::ranges::find_if(
      set, [&](const std::string& name) { return infoOf(context, name) != nullptr; });
  if (set.size() != 2 || covariate == set.end()) return {};
  std::vector<Form> forms;
  for (const Term* carried : carriers) {
    std::vector<Form> of_one = formsIn(*infoOf(context, *covariate));
    for (Form& form : of_one) {
      form.name = fmt::format("{}: {}", carried->carrier, form.name);
      form.stage = carried->stage, form.carrier = carried->carrier;
      forms.push_back(std::move(form));
    }
  }
  return forms;
}

std::vector<Form> formsOf(const Context& context, const Set& set) {
  std::vector<const CovariateInfo*> infos;
  for (const std::string& name : set) infos.push_back(infoOf(context, name));
  if (std::ranges::find(infos, nullptr) != infos.end()) return carriedForms(context, set);
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

/// Smooth curves of more knots, which may be what light does along the covariate.
std::vector<TermGroup> finerCurves(const CovariateInfo& covariate, const Term* carried) {
  std::vector<TermGroup> all;
  for (const auto& [knots, name] :
       {std::pair{2 * kSmoothKnots - 1, "finer "}, {4 * kSmoothKnots - 3, "finest "}}) {
    TermGroup finer = smoothIn(covariate, knots);
    if (finer.terms.size() < kSmoothKnots) continue;
    if (carried != nullptr) {
      finer.name = fmt::format("a {} that is {}", carried->carrier, finer.name);
      for (Term& term : finer.terms) term.stage = carried->stage, term.carrier = carried->carrier;
    }
    finer.name = name + finer.name;
    all.push_back(std::move(finer));
  }
  return all;
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
    std::vector<const CovariateInfo*> infos;
    for (const std::string& name : set)
      if (const CovariateInfo* info = infoOf(context, name)) infos.push_back(info);
    const bool has_carrier = infos.size() < set.size();
    std::vector<const Term*> carriers{nullptr};
    if (has_carrier) carriers = carriersAlong(context, set);
    if (infos.size() == 1) {
      for (const Term* carried : carriers)
        for (TermGroup& finer : finerCurves(*infos[0], carried)) all.push_back(curve(std::move(finer)));
    } else if (!has_carrier) {
      all.push_back(sumOf(*infoOf(context, set[0]), *infoOf(context, set[1])));
    }
  }
  for (FittedForm& fitted :
       findInnerNumbers(*context.source, context.known, context.scales, std::move(forms))) {
    if (fitted.statistic > 0.0) all.push_back(explanationOf(std::move(fitted)));
  }
  return all;
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

bool isMoreThanParts(const Gain& together, const Gain& parts) {
  return together.total - parts.total >= std::max(2.5 * difference(together, parts).error, 0.05 * together.total);
}

const CovariateInfo* infoOf(const Context& context, const std::string& name) {
  const auto found = std::ranges::find(context.covariates, name, &CovariateInfo::name);
  return found == context.covariates.end() ? nullptr : &*found;
}

std::vector<TermGroup> withKnown(const Context& context, std::span<const TermGroup> groups) {
  std::vector<TermGroup> extra = context.known;
  extra.insert(extra.end(), groups.begin(), groups.end());
  return extra;
}

Part prepare(const Context& context, std::span<const TermGroup> groups, bool with_catalogue) {
  const std::vector<TermGroup> extra = withKnown(context, groups);
  Part out;
  const bool needs_catalogue = with_catalogue || !context.catalogue.empty();
  out.marginal =
      marginalise(needs_catalogue ? context.source->evidence(extra) : context.source->withoutCatalogue(extra),
                  context.scales);
  out.model = modelOf(context, out.marginal, extra.size());
  out.first = out.marginal.groups.size() - groups.size();
  out.end = groups.size();
  return out;
}

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

std::vector<Explanation> judged(const Context& context, std::vector<FittedForm> forms) {
  std::vector<Explanation> all;
  for (FittedForm& form : forms) all.push_back(explanationOf(std::move(form)));
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
    return !isMoreThanParts(best->gain, one.gain);
  });
}

}  // namespace

std::vector<std::size_t> eligible(const std::vector<Explanation>& all) {
  std::map<Set, bool> together;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].is_sum) continue;
    if (!all[i].is_catalogue && all[i].covariates.size() == 2 && all[i].carrier().empty()) {
      const auto [at, is_new] = together.try_emplace(all[i].covariates, false);
      if (is_new) at->second = actsTogether(all, all[i].covariates);
      if (!at->second) continue;
    }
    places.push_back(i);
  }
  return places;
}

namespace {

/// One that is not rare; fewer covariates; then fewer numbers; of as many, a straight line, which says least; else what
/// explains more.
bool isSimpler(const Explanation& one, const Explanation& other) {
  const auto isStraight = [](const Explanation& e) {
    const auto& terms = e.fitted.group.terms;
    return terms.size() == 1 && terms[0].factors.size() == 1 && terms[0].factors[0].basis == Basis::Power &&
           terms[0].factors[0].numbers[0] == 1.0;
  };
  if (one.fitted.group.is_rare != other.fitted.group.is_rare) return other.fitted.group.is_rare;
  if (one.covariates.size() != other.covariates.size()) return one.covariates.size() < other.covariates.size();
  if (one.numbers != other.numbers) return one.numbers < other.numbers;
  if (isStraight(one) != isStraight(other)) return isStraight(one);
  return one.gain.total > other.gain.total;
}

/// In place of a surface or a product over two covariates, the best of what light does by itself, such as raw
/// exposures that differ, if these data do not tell the two apart (two standard errors).
std::size_t orByItself(const std::vector<Explanation>& all, const std::vector<std::size_t>& places, std::size_t best) {
  if (all[best].covariates.size() != 2 || !all[best].carrier().empty()) return best;
  std::size_t simpler = best;
  for (const std::size_t i : places) {
    if (all[i].is_catalogue || all[i].covariates.size() != 1 || all[i].carrier().empty()) continue;
    if (all[best].gain.total - all[i].gain.total > 2.0 * difference(all[best].gain, all[i].gain).error) continue;
    if (simpler == best || all[i].gain.total > all[simpler].gain.total) simpler = i;
  }
  return simpler;
}

}  // namespace

std::optional<std::size_t> choose(const std::vector<Explanation>& all) {
  const auto places = eligible(all);
  std::optional<std::size_t> best, catalogue;
  for (const std::size_t i : places) {
    if (all[i].named) continue;  // chooseNamed() has judged it
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
  best = orByItself(all, places, *best);
  // The best explanation decides on the covariates, simplicity on the shape. What a carrier does (a charge,
  // say) need not change with anything: if it explains as much without, or its simpler form does, it does not.
  constexpr double kRounding = 1e-7;  // of a table without noise: to that the fit of an exact shape is exact
  std::size_t chosen = *best;
  const std::string carrier = all[*best].carrier();
  const auto isItsForm = [&](const Explanation& one) {
    const std::string& simpler_than = one.fitted.group.simpler_than;
    return !simpler_than.empty() && carrier.starts_with(simpler_than);
  };
  const auto isLess = [&](const Explanation& one) {
    return !one.carrier().empty() && one.carrier() == carrier && contains(all[*best].covariates, one.covariates);
  };
  for (const std::size_t i : places) {
    const bool is_same = all[i].covariates == all[*best].covariates, is_form = isItsForm(all[i]);
    if (all[i].is_catalogue || !(is_same || is_form || isLess(all[i]))) continue;
    const double by = all[*best].gain.total - all[i].gain.total;
    const double error = std::max(difference(all[*best].gain, all[i].gain).error, kRounding * all[*best].gain.total);
    // The simulator has the simpler form, and many cameras have what is not rare: taken unless the data tell the two
    // apart.
    const bool is_likelier = all[*best].fitted.group.is_rare && !all[i].fitted.group.is_rare;
    if (by > (is_form || is_likelier ? 2.0 : 1.0) * error) continue;
    if (isSimpler(all[i], all[chosen])) chosen = i;
  }
  return chosen;
}

}  // namespace toftwin::discover
