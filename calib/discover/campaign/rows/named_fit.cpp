// SPDX-License-Identifier: Apache-2.0
// Effects of the catalogue, fitted to a campaign as they are.
#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/campaign/rows/rows.h"
#include "sim/images/rows.h"

namespace toftwin::discover {
namespace {

/// The list with one more, and its place.
struct Inserted {
  std::vector<sim::AnyEffect> effects;
  std::size_t place = 0;
};
Inserted inserted(std::vector<sim::AnyEffect> effects, const sim::AnyEffect& effect) {
  const auto behind = std::ranges::find_if(
      effects, [&](const sim::AnyEffect& other) { return placeOf(other) > placeOf(effect); });
  const auto place = static_cast<std::size_t>(behind - effects.begin());
  effects.insert(behind, effect);
  return {std::move(effects), place};
}

Columns allBut(const Marginal& marginal, std::size_t last) {
  Columns columns;
  for (Eigen::Index i = 0; i < marginal.moment.size() - static_cast<Eigen::Index>(last); ++i)
    columns.push_back(i);
  return columns;
}

/// By cross-validation, with the numbers' derivatives where the fit is: each fold moves them to where
/// the other folds want them.
Gain gainBeyond(const std::vector<double>& before, const Marginal& after) {
  return gainOf(before, heldOut(after, allBut(after, 0)));
}

}  // namespace

const CampaignFit& campaignFitOf(const NamedFit& fit) { return *std::any_cast<CampaignFit>(&fit.effect); }

sim::AnyEffect startOf(const CampaignRows& rows, const Candidate& candidate, std::span<const TermGroup> known,
                       std::span<const double> scales) {
  const Marginal marginal = marginalise(rows.evidence(known), scales);
  Columns others = nuisanceColumns(marginal);
  for (std::size_t g = marginal.groups.size() - known.size(); g < marginal.groups.size(); ++g)
    append(others, marginal.groups[g]);
  const double without = fit(marginal, others).deviance;
  sim::AnyEffect best = candidate.example;
  double most = -1.0;
  for (const Group& group : marginal.groups) {
    if (group.name != nameOf(candidate.example) || group.kind != Kind::Catalogue) continue;
    for (std::size_t i = 0; i < group.count; ++i) {
      Columns columns = others;
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

namespace {

/// Fits one effect of a list on top of the others and of what is known.
class OneEffect {
 public:
  OneEffect(const CampaignRows& rows, std::size_t place, RefitOptions options, std::vector<double> before)
      : rows_(rows), place_(place), options_(std::move(options)), before_(std::move(before)) {}

  struct Fitted {
    Refitted refitted;
    Gain gain;  ///< on held-out captures
  };
  std::optional<Fitted> fit(std::vector<sim::AnyEffect> effects) {
    auto refitted = refit(rows_, std::move(effects), {place_}, options_);
    options_.looks_farther = false;  // what has fewer strengths begins where this ends
    if (!refitted || refitted->free.empty()) return std::nullopt;
    const Gain gain = gainBeyond(before_, refitted->marginal);
    return Fitted{*std::move(refitted), gain};
  }

  /// Without the strengths that do not help to predict other captures, by one standard error, which is what a
  /// formula with fewer numbers has to be as good as; the last one stays. And so does one without which χ² rises as it
  /// does by no chance, though a few captures alone (of a cold camera) say so, which differ in how much.
  Fitted withoutNeedless(Fitted all) {
    constexpr double kNoChance = 25.0;  // five standard errors
    while (const auto least = leastStrength(all.refitted.fitted.front(), options_.droppable)) {
      std::vector<sim::AnyEffect> effects = all.refitted.effects;
      effects[place_] = without(effects[place_], least->key);
      std::vector<std::string>& only = options_.only[place_];
      only.clear();
      for (const FittedNumber& number : all.refitted.fitted.front().numbers)
        if (number.key != least->key) only.push_back(number.key);
      auto fewer = fit(std::move(effects));
      if (!fewer || all.gain.total - fewer->gain.total > difference(all.gain, fewer->gain).error) break;
      const double rise = fewer->refitted.deviance - all.refitted.deviance;
      if (rise > kNoChance * std::max(1.0, all.refitted.dispersion)) break;
      all = *std::move(fewer);
    }
    return all;
  }

 private:
  const CampaignRows& rows_;
  std::size_t place_;
  RefitOptions options_;
  std::vector<double> before_;
};

}  // namespace

std::vector<NamedFit> CampaignRows::fitNamed(std::span<const std::string> names,
                                             std::span<const TermGroup> known,
                                             std::span<const double> scales) const {
  std::vector<NamedFit> fits;
  const auto plain = evidenceLeft({.effects = effects_, .terms = known, .with_numbers = true});
  if (!plain) return fits;
  const Marginal without = marginalise(*plain, scales);
  const std::vector<double> before = heldOut(without, allBut(without, 0));
  std::optional<Gain> best;
  const auto maybeBest = [&](const Gain& gain) {
    constexpr double kErrors = 3.0;
    return !best || best->total - gain.total <= kErrors * difference(*best, gain).error;
  };
  for (const std::string& name : names) {
    const auto candidate =
        std::ranges::find_if(candidates_, [&](const Candidate& one) { return nameOf(one.example) == name; });
    if (candidate == candidates_.end()) continue;
    Inserted with = inserted(effects_, startOf(*this, *candidate, known, scales));
    OneEffect one{*this,
                  with.place,
                  {.scales = scales,
                   .terms = known,
                   .with_numbers = true,
                   .looks_farther = true,
                   .droppable = candidate->strengths},
                  before};
    auto fitted = one.fit(std::move(with.effects));
    if (!fitted) continue;
    // Which of its strengths are needless is of no matter where another effect explains far more.
    const auto [refitted, gain] =
        maybeBest(fitted->gain) ? one.withoutNeedless(*std::move(fitted)) : *std::move(fitted);
    if (!best || gain.total > best->total) best = gain;
    NamedFit fit{.name = name, .gain = gain};
    CampaignFit own{refitted.effects[with.place]};
    for (const FittedNumber& number : refitted.fitted.front().numbers) {
      fit.numbers.push_back({number.key, number.value, number.error});
      own.keys.push_back(number.key);
    }
    fit.is_at_bound = isAtBound(own.effect, own.keys);
    fit.effect = std::move(own);
    fits.push_back(std::move(fit));
  }
  return fits;
}

std::shared_ptr<const RowSource> CampaignRows::including(std::span<const NamedFit* const> fits,
                                                         bool with_catalogue) const {
  auto all = std::make_shared<CampaignRows>(*this);
  // Declared numbers' columns stay, those of what was included before go.
  std::erase_if(all->groups_, [](const Group& group) { return group.name.starts_with("included "); });
  std::vector<FreeNumber> free;
  all->effects_ = declaredEffects(*declared_);
  for (const NamedFit* fit : fits) {
    const auto& [effect, keys] = campaignFitOf(*fit);
    const Inserted with = inserted(all->effects_, effect);
    for (FreeNumber& one : free) one.place += one.place >= with.place ? 1 : 0;
    all->effects_ = with.effects;
    for (const FreeNumber& one : freeNumbersOf(with.effects, {with.place}))
      if (std::ranges::count(keys, one.key) > 0) free.push_back(one);
  }
  std::size_t declared_columns = all->common_columns_;
  for (const Group& group : all->groups_)
    if (group.kind == Kind::Declared)
      declared_columns = std::max(declared_columns, group.first + group.count);
  const auto here = cameraWith(all->effects_),
             late = cameraWith(withDelay(declared_->model, all->effects_, has_delay_ ? kDelay_mm : 0.0));
  if (!here || !late) return all;
  std::vector<NoiselessCamera> cameras;
  for (const FreeNumber& one : free) {
    auto camera = cameraWith(moved(all->effects_, one, one.step));
    if (!camera) return all;
    cameras.push_back(*std::move(camera));
  }
  std::vector<Group> groups;
  std::size_t next = declared_columns;
  for (Group& group : all->groups_) {
    if (group.first < declared_columns) groups.push_back(std::move(group));
  }
  for (const FreeNumber& one : free)
    groups.push_back(
        {.name = "included " + one.key, .kind = Kind::Declared, .first = next++, .count = 1, .numbers = 1});
  all->base_columns_ = next;
  std::size_t behind = next;
  for (Group group : groups_) {
    if (!with_catalogue || (group.kind != Kind::Catalogue && group.kind != Kind::Retired)) continue;
    group.first = behind, behind += group.count;
    const bool is_in =
        std::ranges::any_of(fits, [&](const NamedFit* fit) { return fit->name == group.name; });
    group.kind = is_in ? Kind::Retired : Kind::Catalogue;
    groups.push_back(std::move(group));
  }
  all->groups_ = std::move(groups);
  const bool on_light = actsOnLight(all->effects_);
  sim::inParallel(static_cast<int>(rows_.size()), 1, [&](int first, int last) {
    for (auto c = static_cast<std::size_t>(first); c < static_cast<std::size_t>(last); ++c) {
      CaptureRows& rows = all->rows_[c];
      const Fixed& fixed = *rows.fixed;
      const StagedReading staged = read(*here, c, on_light);
      const Reading& reading = staged.reading();
      for (std::size_t k = 0; k < kChannels; ++k) {
        if (rows.base.columns[k].size() != 0)
          rows.base.columns[k].conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(next));
      }
      rows.base.putResidual(fixed.cells, fixed.residual, fixed.varied, reading);
      if (has_delay_) rows.base.putDelay(fixed.cells, reading, staged.by(*late, Stage::Light));
      for (std::size_t i = 0; i < free.size(); ++i)
        rows.base.putChange(fixed.cells, declared_columns + i, reading,
                            staged.by(cameras[i], discover::stageOf(all->effects_[free[i].place])));
      rows.evidence = with_catalogue ? ownEvidence(rows) : rows.base.evidence(fixed.name, fixed.block);
    }
  });
  all->findPatterns();
  return all;
}

}  // namespace toftwin::discover
