// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include <toftwin/nan.h>

#include "calib/suit/suit.h"

namespace toftwin::suit {
namespace {

std::string nameOf(const sim::AnyEffect& effect) {
  return std::visit([]<class E>(const E&) { return std::string{E::about.name}; }, effect);
}

bool moves(const Case& use, const sim::Scene& scene) {
  const std::array<double, 3> still{};
  return scene.moves() || std::ranges::any_of(use.spec.poses, [&](const StationSpec& pose) {
           return pose.velocity_m_per_s != still || pose.rotation_rate_deg_per_s != still;
         });
}

/// The variant itself, and then without each thing. Those that see the same light stand together.
std::vector<Variant> variantsOf(const Case& use, const sim::Scene& scene, const Variant& whole) {
  std::vector<Variant> variants{whole};
  const auto& effects = whole.model.effects();
  std::multiset<std::string> met;
  for (std::size_t i = 0; i < effects.size(); ++i) {
    auto others = effects;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    std::string name = nameOf(effects[i]);
    met.insert(name);
    if (met.count(name) > 1) name += fmt::format(" {}", met.count(name));
    Variant& without = variants.emplace_back(whole);
    without.name = name;
    without.model = whole.model.withEffects(std::move(others));
  }
  Variant all = whole;
  all.name = "all of these";
  all.model = whole.model.withEffects({});
  if (whole.max_surfaces > 1) {
    Variant& without = variants.emplace_back(whole);
    without.name = "light over several surfaces";
    without.max_surfaces = all.max_surfaces = 1;
  }
  if (whole.pixel_extent > 0.0) {
    Variant& without = variants.emplace_back(whole);
    without.name = "mixed pixels";
    without.pixel_extent = all.pixel_extent = 0.0;
  }
  if (moves(use, scene)) {
    Variant& without = variants.emplace_back(whole);
    without.name = "motion";
    without.stands_still = all.stands_still = true;
  }
  variants.push_back(std::move(all));
  return variants;
}

/// What failed, each requirement at its worst condition alone.
struct Failures {
  Case use;
  std::vector<std::size_t> numbers{};  ///< of its requirements in the whole use case
};

Failures failuresOf(const Case& use, const std::vector<RequirementResult>& results) {
  Failures part{.use = use};
  std::set<std::size_t> poses, lightings;
  part.use.spec.requirements.clear();
  for (std::size_t r = 0; r < results.size(); ++r) {
    const RequirementResult& result = results[r];
    if (!result.is_judged || result.verdict.is_met || result.conditions.empty()) continue;
    const AtCondition& worst = result.conditions[result.worst];
    RequirementSpec& requirement = part.use.spec.requirements.emplace_back(use.spec.requirements[r]);
    requirement.poses = {use.spec.poses[worst.pose].name};
    requirement.lightings = {use.spec.lightings[worst.lighting].name};
    part.numbers.push_back(r);
    poses.insert(worst.pose), lightings.insert(worst.lighting);
  }
  part.use.spec.poses.clear();
  part.use.spec.lightings.clear();
  part.use.pose_numbers.assign(poses.begin(), poses.end());
  for (const std::size_t pose : poses) part.use.spec.poses.push_back(use.spec.poses[pose]);
  for (const std::size_t lighting : lightings)
    part.use.spec.lightings.push_back(use.spec.lightings[lighting]);
  return part;
}

/// Of the one condition that a requirement of `part` is about.
const ConditionValues& at(const Case& part, std::size_t r, const std::vector<ConditionValues>& values) {
  return *std::ranges::find_if(values, [&](const ConditionValues& one) {
    return concerns(part.spec.requirements[r], part, one.pose, one.lighting);
  });
}

double marginOf(const RequirementSpec& requirement, double value) {
  return verdictOf(requirement, exactly(value)).margin;
}

/// A repeat in which nothing is valid has no margin: what is met without the effect, and without a value in
/// some repeats with it, is spoiled by it without a gain that could be told.
/// `level`: of the gain's interval.
Spoiler spoilerOf(const RequirementSpec& requirement, std::size_t r, const std::string& name,
                  const ConditionValues& whole, const ConditionValues& without, double level) {
  std::vector<double> gains;
  std::size_t revealed = 0, hidden = 0;
  for (std::size_t i = 0; i < whole.repeats[r].size(); ++i) {
    const double with = marginOf(requirement, whole.repeats[r][i]),
                 left = marginOf(requirement, without.repeats[r][i]);
    revealed += std::isnan(with) && !std::isnan(left) ? 1 : 0;
    hidden += !std::isnan(with) && std::isnan(left) ? 1 : 0;
    if (!std::isnan(with) && !std::isnan(left)) gains.push_back(left - with);
  }
  const Estimate untold{.value = kNaN, .low = kNaN, .high = kNaN, .repeats = 0};
  Estimate gain = gains.empty() ? untold : estimateOf(gains, std::nullopt, level);
  if (isShare(requirement.kind))  // more than all of it cannot be gained
    gain.low = std::max(-1.0, gain.low), gain.high = std::min(1.0, gain.high);
  const Verdict then = verdictOf(requirement, estimateAt(requirement, without, r));
  return {.what = name,
          .gain = gain,
          .is_met_without = then.is_met,
          .is_certain_without = then.is_certain,
          .is_valid_only_without =
              hidden == 0 && (revealed == whole.repeats[r].size() || (revealed > 0 && then.is_met))};
}

/// What gives a value at all is before what gains, and of it what is met; what cannot be told (nothing valid
/// in either) is last.
double spoilerRank(const Spoiler& one) {
  if (one.is_valid_only_without) return one.is_met_without ? -2e300 : -1e300;
  return std::isnan(one.gain.value) ? 1e300 : -one.gain.value;
}

}  // namespace

Result<std::vector<std::vector<Spoiler>>> spoilersOf(const Case& use, const sim::Scene& scene,
                                                     const Variant& variant,
                                                     const std::vector<RequirementResult>& results,
                                                     const Watch& watch, KeptLight* kept) {
  std::vector<std::vector<Spoiler>> spoilers(results.size());
  const Failures failures = failuresOf(use, results);
  if (failures.numbers.empty()) return spoilers;
  const std::vector<Variant> variants = variantsOf(use, scene, variant);
  const auto values =
      simulate(failures.use, scene, variants, {.first = 0, .count = use.spec.repeats}, watch, kept);
  if (!values) return values.error();
  // As many gains are looked at: all of their intervals together hold with 95 % (Šidák).
  const double level =
      std::pow(0.95, 1.0 / static_cast<double>((variants.size() - 1) * failures.numbers.size()));
  for (std::size_t f = 0; f < failures.numbers.size(); ++f) {
    auto& found = spoilers[failures.numbers[f]];
    for (std::size_t v = 1; v < variants.size(); ++v) {
      found.push_back(spoilerOf(failures.use.spec.requirements[f], f, variants[v].name,
                                at(failures.use, f, values->front()), at(failures.use, f, (*values)[v]),
                                level));
    }
    // "all of these" keeps its place at the end.
    std::ranges::stable_sort(found.begin(), found.end() - 1, {}, spoilerRank);
  }
  return spoilers;
}

}  // namespace toftwin::suit
