// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/search/tell_stages.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/rows/carriers.h"

namespace toftwin::discover {
namespace {

using Effects = std::vector<sim::AnyEffect>;

/// The round's declared effects, with the numbers that were fitted.
Effects updatedOf(const Round& round) {
  Effects effects = declaredEffects(round.declared);
  const auto in_file = placesInFile(round.declared);
  for (const FittedEffect& update : round.updates)
    for (std::size_t place = 0; place < effects.size(); ++place)
      if (in_file[place] == update.of_file) effects[place] = update.effect;
  return effects;
}

Effects withForms(Effects effects, const FoundEffect& found) {
  if (found.fitted) effects = withInserted(std::move(effects), found.fitted->effect);
  for (const FittedEffect& more : found.more) effects = withInserted(std::move(effects), more.effect);
  return effects;
}

/// Light adds up and does not know how bright it is, nor what else shines: what bends it as it goes with either happens
/// in the pixels.
bool isOfPixels(const std::vector<std::string>& covariates) {
  return std::ranges::any_of(covariates, [](const std::string& name) {
    return name == "amplitude_e" || name == "ambient_klx";
  });
}

/// Light that is another in each raw exposure makes them contradict each other, too.
bool isOfSingleExposures(const Effect& effect) {
  const std::vector<Term> terms = termsOf(effect);
  return !terms.empty() && std::ranges::all_of(terms, [](const Term& term) {
    return term.carrier.starts_with(fmt::format("{}:", kUnequalCarrier));
  });
}

/// Where something without a name may act, the likeliest first. An error of the range is the same as a delay before
/// decoding, and a filter of the decoded image may change amplitudes, too: only raw exposures say. A charge is of
/// the samples.
std::vector<Stage> stagesOf(Stage form, std::optional<bool> is_before, bool is_of_pixels) {
  if (form == Stage::Samples) return {Stage::Samples};
  if (is_before == false) return {Stage::Range};
  std::vector<Stage> stages;
  if (!is_of_pixels) stages.push_back(Stage::Light);
  stages.push_back(Stage::Samples);
  if (!is_before) stages.insert(form == Stage::Range ? stages.begin() : stages.end(), Stage::Range);
  return stages;
}

/// Whether an effect of the catalogue acts elsewhere than the raw exposures say.
bool isElsewhere(Stage stage, bool is_before) { return is_before != (stage != Stage::Range); }

/// An effect whose name acts elsewhere than it does has none, nor any of its other names that do. What it is fitted by
/// stays in the model.
void takeNameBack(bool is_before, Effect& effect) {
  effect.refused.push_back(effect.name + ": the raw exposures say that it acts elsewhere");
  effect.name = fmt::format("like {}, but {} decoding", effect.name, is_before ? "before" : "behind");
  effect.is_catalogue = false;
  effect.stage = is_before ? Stage::Light : Stage::Range;
  if (is_before) effect.stages_alike.push_back(Stage::Samples);
  std::erase_if(effect.alternatives, [&](const Alternative& other) {
    return other.named && isElsewhere(discover::stageOf(campaignFitOf(*other.named).effect), is_before);
  });
}

/// Where an effect without a name acts. `is_only_one`: of several it cannot be said which makes the samples contradict
/// each other.
void tellStage(const std::optional<RawSays>& raw, bool is_only_one, Effect& effect) {
  const auto is_before = raw ? raw->isBeforeDecoding() : std::nullopt;
  const bool contradicts = raw && is_only_one && raw->contradicts() && !isOfSingleExposures(effect);
  // What contradicts itself was so before it was decoded.
  const std::vector<Stage> stages =
      contradicts && is_before != false
          ? std::vector{Stage::Samples}
          : stagesOf(effect.stage.value_or(Stage::Range), is_before, isOfPixels(effect.covariates));
  effect.stage = stages.front();
  effect.stages_alike.assign(stages.begin() + 1, stages.end());
}

/// Of several explanations each acts at its own stage. `contradict`: the samples do, and what has no name is theirs.
void addStagesOfOthers(std::optional<bool> is_before, bool contradict, Effect& effect) {
  for (const Alternative& other : effect.alternatives) {
    std::vector<Stage> stages;
    if (other.named)
      stages.push_back(discover::stageOf(campaignFitOf(*other.named).effect));
    else if (!other.group.terms.empty() && !contradict)
      stages = stagesOf(other.group.terms.front().stage.value_or(Stage::Range), is_before,
                        isOfPixels(other.covariates));
    for (const Stage stage : stages) {
      const bool is_known = stage == effect.stage || (is_before && isElsewhere(stage, *is_before)) ||
                            std::ranges::find(effect.stages_alike, stage) != effect.stages_alike.end();
      if (!is_known) effect.stages_alike.push_back(stage);
    }
  }
}

}  // namespace

std::optional<bool> RawSays::isBeforeDecoding() const {
  // What is neither, though it is known well, is not what the form says, of which the phase shows a part.
  constexpr double kSure = 3.0, kNear = 0.25, kNearErrors = 2.0;
  if (!share) return std::nullopt;
  const double behind = std::abs(share->mean), before = std::abs(1.0 - share->mean);
  const double sure = kSure * share->error, near = std::max(kNear, kNearErrors * share->error);
  if (before < behind && behind > sure && before < near) return true;
  if (behind < before && before > sure && behind < near) return false;
  return std::nullopt;
}

Result<> tellStages(const RawWitness* witness, Round& round) {
  const auto hasNoName = [](const FoundEffect& one) { return !one.found.is_catalogue; };
  const bool is_only_one = std::ranges::count_if(round.effects, hasNoName) == 1;
  if (witness != nullptr && !round.effects.empty()) {
    const Effects declared = updatedOf(round);
    Effects all = declared;
    std::vector<Effects> with;
    for (const FoundEffect& one : round.effects)
      all = withForms(std::move(all), one), with.push_back(withForms(declared, one));
    // A number that ranges hardly tell may be off by what samples show at once: the better of both.
    const auto by_file = witness->contradiction(declared), by_all = witness->contradiction(all);
    if (!by_file || !by_all) return by_file ? by_all.error() : by_file.error();
    const double contradiction = std::min(*by_file, *by_all);
    const auto shares = witness->sharesBeforeDecoding(declared, with, all);
    if (!shares) return shares.error();
    for (std::size_t e = 0; e < round.effects.size(); ++e) round.effects[e].raw = RawSays{(*shares)[e], contradiction};
  }
  for (FoundEffect& one : round.effects) {
    const auto is_before = one.raw ? one.raw->isBeforeDecoding() : std::nullopt;
    if (hasNoName(one))
      tellStage(one.raw, is_only_one, one.found);
    else if (is_before && one.found.stage && isElsewhere(*one.found.stage, *is_before))
      takeNameBack(*is_before, one.found);
    addStagesOfOthers(is_before, is_only_one && one.raw && one.raw->contradicts(), one.found);
  }
  return {};
}

}  // namespace toftwin::discover
