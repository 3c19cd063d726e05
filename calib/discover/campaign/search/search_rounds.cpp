// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/search/search_rounds.h"

#include <algorithm>
#include <map>
#include <variant>

#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/search/model_file.h"
#include "calib/discover/campaign/search/raw_witness.h"
#include "calib/discover/campaign/search/tell_stages.h"
#include "calib/discover/estimate.h"
#include "calib/discover/marginal.h"

namespace toftwin::discover {
namespace {

std::vector<TermGroup> termsOfUndeclared(const Finding& finding) {
  std::vector<TermGroup> terms;
  for (const Effect& effect : finding.effects) {
    if (!effect.is_catalogue) terms.push_back({effect.name, Kind::Generic, termsOf(effect), 0});
  }
  return terms;
}

/// Effects of the declared model whose numbers the data move by so much that it is no chance: χ² of
/// their columns, with everything that was found, over 25 more than their number (5 standard
/// errors).
std::vector<std::size_t> wrongNumbers(const Evidence& evidence, const Finding& finding,
                                      const std::vector<sim::AnyEffect>& effects) {
  const Marginal marginal = marginalise(evidence, finding.scales);
  Columns columns = nuisanceColumns(marginal);
  for (const Group& group : marginal.groups) {
    const bool is_found =
        group.kind == Kind::Catalogue && std::ranges::any_of(finding.effects, [&](const Effect& effect) {
          return effect.is_catalogue && effect.name == group.name;
        });
    if (is_found || group.kind == Kind::Generic) append(columns, group);
  }
  const Fit all = fit(marginal, columns);
  std::vector<std::size_t> places;
  std::map<std::string, std::size_t> next;  // of several with one name, each has its group
  for (const Group& group : marginal.groups) {
    if (group.kind != Kind::Declared) continue;
    const auto begin = effects.begin() + static_cast<std::ptrdiff_t>(next[group.name]);
    const auto place =
        std::find_if(begin, effects.end(), [&](const auto& effect) { return nameOf(effect) == group.name; });
    if (place == effects.end()) continue;
    next[group.name] = static_cast<std::size_t>(place - effects.begin()) + 1;
    Columns without;
    for (const Eigen::Index column : columns) {
      const auto c = static_cast<std::size_t>(column);
      if (c < group.first || c >= group.first + group.count) without.push_back(column);
    }
    const double gain = (fit(marginal, without).deviance - all.deviance) / std::max(1.0, all.dispersion());
    if (gain >= 25.0 + static_cast<double>(group.count)) places.push_back(next[group.name] - 1);
  }
  return places;
}

/// The effects without noise, with what was found in them.
struct WithFound {
  std::vector<sim::AnyEffect> effects;
  std::vector<std::size_t>
      fitted;  ///< places of those whose numbers are to be fitted: updates, then what was found
  std::map<std::size_t, std::vector<std::string>> only{};  ///< of those without a name, the numbers
};

std::size_t insert(WithFound& inserted, const sim::AnyEffect& effect) {
  const auto behind = std::ranges::find_if(
      inserted.effects, [&](const sim::AnyEffect& other) { return placeOf(other) > placeOf(effect); });
  const auto place = static_cast<std::size_t>(behind - inserted.effects.begin());
  inserted.effects.insert(behind, effect);
  for (std::size_t& other : inserted.fitted) other += other >= place ? 1 : 0;
  std::map<std::size_t, std::vector<std::string>> only;
  for (auto& [other, keys] : inserted.only) only.emplace(other + (other >= place ? 1 : 0), std::move(keys));
  inserted.only = std::move(only);
  return place;
}

/// The forms of what was found, as the simulator has them.
void putForms(const Round& round, WithFound& inserted, std::vector<FoundEffect>& effects) {
  std::vector<const NamedFit*> fits;
  for (const Effect& effect : round.finding.effects)
    if (effect.fit) fits.push_back(effect.fit.get());
  const auto included = round.rows->including(fits, false);
  const auto& with_found = dynamic_cast<const CampaignRows&>(*included);
  for (const Effect& effect : round.finding.effects) {
    FoundEffect found{effect, {}};
    if (effect.fit) {
      const CampaignFit& fit = campaignFitOf(*effect.fit);
      const std::size_t place = insert(inserted, fit.effect);
      // All of its numbers: one that was not needed is not known to be nothing.
      inserted.fitted.push_back(place);
      found.fitted = FittedEffect{fit.effect, {}};
    } else {
      for (const LearnedEffect& learned : learnedEffectsOf(effect, with_found, round.declared.model)) {
        const std::size_t place = insert(inserted, learned.effect);
        if (!learned.free.empty()) inserted.fitted.push_back(place), inserted.only[place] = learned.free;
        FittedEffect& form = found.fitted ? found.more.emplace_back(FittedEffect{learned.effect, {}})
                                          : found.fitted.emplace(FittedEffect{learned.effect, {}});
        form.is_as_learned = learned.free.empty();
      }
    }
    effects.push_back(std::move(found));
  }
}

/// What the simulator has no form for, as a rig's error: it would else come out of all numbers beside it.
std::vector<TermGroup> formless(const std::vector<FoundEffect>& effects) {
  std::vector<Effect> without;
  for (const FoundEffect& one : effects)
    if (!one.found.is_catalogue && !one.fitted) without.push_back(one.found);
  return groupsOf(without);
}

/// What was fitted, to where it belongs: in the order in which it was inserted.
void takeFitted(const std::vector<std::optional<std::size_t>>& updated, Round& round) {
  std::vector<FittedEffect*> forms;
  for (FoundEffect& found : round.effects) {
    if (found.fitted && !found.fitted->is_as_learned) forms.push_back(&*found.fitted);
    for (FittedEffect& more : found.more)
      if (!more.is_as_learned) forms.push_back(&more);
  }
  for (std::size_t i = 0; i < round.refitted.fitted.size(); ++i) {
    const FittedEffect& one = round.refitted.fitted[i];
    if (i < updated.size()) {
      round.updates.push_back(one);
      round.updates.back().of_file = updated[i];
    } else {
      *forms[i - updated.size()] = one;
    }
  }
}

/// The camera file as far as its numbers are right, where the round starts from as far as they are not.
Declared listedFor(const Declared& file, const Round& round, const std::vector<std::size_t>& wrong) {
  const auto in_file = placesInFile(file);
  std::vector<sim::AnyEffect> effects = file.model.effects();
  for (const std::size_t place : wrong)
    if (in_file[place]) effects[*in_file[place]] = round.declared.model.effects()[*in_file[place]];
  Declared listed = file;
  listed.model = file.model.withEffects(std::move(effects));
  listed.delay_mm = round.declared.delay_mm;
  return listed;
}

/// Where those effects of the file stand in a list of that `in_file`. Not where they stand in that of another delay of the
/// light, which has one effect more or fewer where one of the delays is none.
std::vector<std::size_t> placesIn(const std::vector<std::optional<std::size_t>>& in_file,
                                  const std::vector<std::optional<std::size_t>>& of_file) {
  std::vector<std::size_t> places;
  for (const auto& one : of_file)
    places.push_back(static_cast<std::size_t>(std::ranges::find(in_file, one) - in_file.begin()));
  return places;
}

/// `file_rows`: rows that start from the camera file's own numbers; null: the round's are that.
Result<> fitFound(const Declared& file, const CampaignRows* file_rows, const OpenCaptures& open,
                  Round& round) {
  const auto& of_file = file_rows != nullptr ? *file_rows : *round.rows;
  auto wrong =
      wrongNumbers(of_file.evidence(termsOfUndeclared(round.finding)), round.finding, declaredEffects(file));
  const auto in_file = placesInFile(file);
  std::erase_if(wrong, [&](std::size_t place) {
    return !in_file[place] || (open.has_steps && std::holds_alternative<sim::Quantisation>(
                                                     file.model.effects()[*in_file[place]]));
  });
  std::vector<std::optional<std::size_t>> updated;
  for (const std::size_t place : wrong) updated.push_back(in_file[place]);
  const Declared listed = listedFor(file, round, wrong);
  WithFound inserted{declaredEffects(listed), placesIn(placesInFile(listed), updated)};
  putForms(round, inserted, round.effects);
  // About which point a learned mirror turns the image is known to a pixel or two, and may be farther off.
  const bool has_mirror = std::ranges::any_of(inserted.fitted, [&](std::size_t place) {
    const auto* learned = std::get_if<sim::Learned>(&inserted.effects[place]);
    return learned != nullptr && learned->terms.mirror() != nullptr;
  });
  const std::vector<TermGroup> beside = formless(round.effects);
  auto refitted = refit(*round.rows, inserted.effects, inserted.fitted,
                        {.scales = round.finding.scales,
                         .terms = beside,
                         .looks_farther = has_mirror,
                         .of_file = wrong.size(),
                         .only = inserted.only});
  if (!refitted) return refitted.error();
  round.refitted = *std::move(refitted);
  takeFitted(updated, round);
  round.zero = zeroOf(round.refitted, round.declared.delay_mm, tellDelay(open.captures));
  return {};
}

/// Where a round ended: the numbers that were wrong as they were fitted, and the delay.
Declared endOf(const Round& round) {
  Declared end = round.declared;
  std::vector<sim::AnyEffect> effects = end.model.effects();
  for (const FittedEffect& one : round.updates) {
    // The delay of the light, which stands in the fitted list, is told by itself.
    const bool has_delay = std::holds_alternative<sim::FrequencyOffset>(one.effect);
    effects[*one.of_file] =
        has_delay ? withDelay(end.model, {one.effect}, -round.declared.delay_mm).front() : one.effect;
  }
  end.model = end.model.withEffects(std::move(effects));
  end.delay_mm += round.zero.delay_mm;
  return end;
}

/// The light where the cameras stood by what the round before found, or by the camera file.
Result<std::vector<std::shared_ptr<const TracedCapture>>> tracedFor(const Round& round, const Declared& file,
                                                                    const OpenCaptures& open,
                                                                    const Round* before,
                                                                    const std::function<void(double)>& tell) {
  if (before == nullptr && open.trusts_poses) {
    TraceOptions again = open.trace;
    again.seed += 0x61c88647U;
    return traceAll(file, open.captures, again, tell, std::vector<Stood>(open.captures.size()));
  }
  const auto stood_by = before != nullptr
                            ? withDelay(file.model, before->refitted.effects, before->zero.delay_mm)
                            : declaredEffects(file);
  return traceWhereTheyStood(round.declared, stood_by, open.captures, open.at_poses, open.trace, tell);
}

Result<std::unique_ptr<Round>> search(const Declared& file, const OpenCaptures& open, const Round* before,
                                      const std::function<void()>& begin,
                                      const std::function<void(double)>& tell) {
  auto round = std::make_unique<Round>(Round{before != nullptr ? endOf(*before) : file});
  begin();
  const auto half = [&](double begun) {
    return [&tell, begun](double share) {
      if (tell) tell(0.5 * (begun + share));
    };
  };
  auto traced = tracedFor(*round, file, open, before, half(0.0));
  if (!traced) return traced.error();
  round->traced = *std::move(traced);
  round->varied = traceBeside(round->declared, open.captures, round->traced, open.trace, half(1.0));
  begin();
  auto rows = CampaignRows::make(round->declared, {open.captures, round->traced, round->varied},
                                 {.left_out = open.left_out});
  if (!rows) return rows.error();
  round->rows = *std::move(rows);
  begin();
  FinderOptions finder = open.finder;
  if (open.trusts_poses) finder.most_scale = 1.0;
  round->finding = find(*round->rows, finder);
  begin();
  const Lit lit{open.captures, round->traced, round->varied};
  const JudgedCampaign judged{round->declared, lit, round->finding.scales};
  const auto witness = RawWitness::of(judged);
  if (!witness) return witness.error();
  if (*witness)
    if (auto named = (*witness)->chooseNames(round->finding.effects); !named) return named.error();
  if (auto fitted = fitFound(file, before != nullptr ? &*before->rows : nullptr, open, *round); !fitted)
    return fitted.error();
  if (auto told = tellStages(*witness ? &**witness : nullptr, *round); !told) return told.error();
  return round;
}

/// Whether much is left beside what was found, or poses came out far off: a strong effect may have gone into
/// them before it was found. Where nothing was found, poses are what the captures say.
bool isDoubtful(const Round& round) {
  constexpr double kMuch = 2.0;  // times the noise's variance
  constexpr double kFar = 2.0;   // times 1 mm and 0.1 degrees
  const auto& scales = round.finding.scales;
  return round.things() > 0 &&
         (round.refitted.dispersion > kMuch || (!scales.empty() && scales.front() > kFar));
}

/// `first`, or a second round from where it ended, whichever is better.
Result<std::unique_ptr<Round>> secondOf(std::unique_ptr<Round> first, const Declared& file,
                                        const OpenCaptures& open) {
  const double alpha = open.finder.alpha;
  const bool has_both = !first->effects.empty() && !first->updates.empty();
  if (first->things() == 0 || !(has_both || first->leavesSomething(alpha))) return first;
  auto second = search(file, open, first.get(), [] {}, {});
  if (!second) return second;
  const bool is_better = (*second)->things() <= first->things() || !(*second)->leavesSomething(alpha);
  return is_better ? std::move(second) : std::move(first);
}

}  // namespace

Result<std::unique_ptr<Round>> searchInRounds(const Declared& file, const OpenCaptures& open,
                                              const std::function<void()>& begin,
                                              const std::function<void(double)>& tell) {
  auto found = search(file, open, nullptr, begin, tell);
  if (!found) return found;
  if (isDoubtful(**found)) {
    OpenCaptures as_stated = open;
    as_stated.trusts_poses = true;
    Declared without_delay = file;  // which was fitted at poses that were free
    without_delay.delay_mm = 0.0;
    auto stated = search(without_delay, as_stated, nullptr, [] {}, {});
    if (!stated) return stated;
    auto twice = secondOf(*std::move(stated), without_delay, as_stated);
    if (!twice || !isDoubtful(**twice)) return twice;
  }
  return secondOf(*std::move(found), file, open);
}

}  // namespace toftwin::discover
