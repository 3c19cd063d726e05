// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/tell_stages.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "calib/discover/campaign/carriers.h"

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
bool isOfPixels(const Effect& effect) {
  return std::ranges::any_of(effect.covariates, [](const std::string& name) {
    return name == "amplitude_e" || name == "ambient_klx";
  });
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
  std::erase_if(effect.alternatives, [&](const Alternative& other) {
    return other.named && isElsewhere(stageOf(campaignFitOf(*other.named).effect), is_before);
  });
}

/// Where else than at its stage an effect may act: range and amplitude do not say more than that an error of the range
/// leaves amplitudes as they are, and is otherwise the same as a delay before decoding.
std::vector<Stage> stagesAlike(bool may_be_of_range, bool may_be_of_light, const Effect& effect) {
  std::vector<Stage> alike;
  for (const Stage stage : {Stage::Light, Stage::Samples, Stage::Range}) {
    const bool may_be = stage == Stage::Range ? may_be_of_range : stage == Stage::Samples || may_be_of_light;
    if (may_be && stage != effect.stage) alike.push_back(stage);
  }
  return alike;
}

/// Where an effect without a name acts. `is_only_one`: of several it cannot be said which makes the samples contradict
/// each other.
void tellStage(const std::optional<RawSays>& raw, bool is_only_one, Effect& effect) {
  const auto is_before = raw ? raw->isBeforeDecoding() : std::nullopt;
  const bool is_as_range = effect.stage == Stage::Range, is_charge = effect.stage == Stage::Samples;
  if (is_before == false) {
    effect.stage = Stage::Range;
    return;
  }
  if (is_before == true && effect.stage == Stage::Range) effect.stage = Stage::Light;
  const bool contradicts = raw && is_only_one && raw->contradicts(), is_of_pixels = contradicts || isOfPixels(effect);
  if (effect.stage == Stage::Light && is_of_pixels) effect.stage = Stage::Samples;
  if (!is_charge) effect.stages_alike = stagesAlike(is_as_range && !is_before, !is_of_pixels, effect);
}

/// Of several explanations each acts at its own stage.
void addStagesOfOthers(std::optional<bool> is_before, Effect& effect) {
  for (const Alternative& other : effect.alternatives) {
    const auto stage = other.named ? std::optional{stageOf(campaignFitOf(*other.named).effect)}
                                   : other.group.terms.front().stage;
    const bool is_known = !stage || stage == effect.stage || (is_before && isElsewhere(*stage, *is_before)) ||
                          std::ranges::find(effect.stages_alike, *stage) != effect.stages_alike.end();
    if (!is_known) effect.stages_alike.push_back(*stage);
  }
}

}  // namespace

std::optional<bool> RawSays::isBeforeDecoding() const {
  constexpr double kSure = 3.0;
  if (!share) return std::nullopt;
  if (share->mean > 0.5 && share->mean > kSure * share->error) return true;
  if (share->mean < 0.5 && 1.0 - share->mean > kSure * share->error) return false;
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
    addStagesOfOthers(is_before, one.found);
  }
  return {};
}

}  // namespace toftwin::discover
