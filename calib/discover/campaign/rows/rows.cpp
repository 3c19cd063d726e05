// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/rows.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <variant>

#include <fmt/format.h>

#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/captures/sites.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/rows/covariates.h"
#include "calib/discover/campaign/rows/light_tiles.h"
#include "calib/discover/campaign/rows/pose_errors.h"
#include "calib/discover/campaign/rows/smeared_ranges.h"
#include "calib/discover/campaign/rows/spilled_light.h"
#include "sim/images/rows.h"

namespace toftwin::discover {
namespace {

/// What the simulation says with other effects than the declared ones.
struct Variant {
  NoiselessCamera camera;
  Stage from = Stage::Light;  ///< where it begins to differ
};

Reading by(const StagedReading& base, const Variant& variant) { return base.by(variant.camera, variant.from); }

std::vector<sim::AnyEffect> replaced(std::vector<sim::AnyEffect> effects, std::size_t place,
                                     const sim::AnyEffect& by) {
  effects[place] = by;
  return effects;
}

/// Changes of some pixels' readings in about a millimetre: of captures that differ most.
class Probe {
 public:
  Probe(const Declared& declared, const std::vector<sim::AnyEffect>& effects,
        const std::vector<MeasuredCapture>& captures, const std::vector<const StagedReading*>& bases)
      : declared_(declared), effects_(effects), captures_(captures), bases_(bases) {}

  /// `declared_place`: of the effect among the declared ones that varies; past the end: it is
  /// inserted.
  [[nodiscard]] std::vector<float> operator()(const Variation& variation,
                                              std::size_t declared_place) const {
    const bool is_declared = declared_place < effects_.size();
    auto effects = is_declared ? replaced(effects_, declared_place, variation.on)
                               : withInserted(effects_, variation.on);
    const auto camera = NoiselessCamera::make(declared_.model, std::move(effects), captures_);
    if (!camera) return {};
    std::vector<float> changes;
    for (const StagedReading* base : bases_) {
      const Reading there = base->by(*camera, discover::stageOf(variation.on));
      const std::size_t count = there.range_m.size(), stride = 1 + count / kPixels;
      for (std::size_t i = 0; i < count; i += stride) {
        const float range = 1e3F * (there.range_m[i] - base->reading().range_m[i]);
        const float log = 1e2F * (there.log_amplitude[i] - base->reading().log_amplitude[i]);
        changes.push_back(std::isfinite(range) ? range : 0.0F);
        changes.push_back(std::isfinite(log) ? log : 0.0F);
      }
    }
    return changes;
  }

 private:
  static constexpr std::size_t kPixels = 1500;
  const Declared& declared_;
  const std::vector<sim::AnyEffect>& effects_;
  const std::vector<MeasuredCapture>& captures_;
  std::vector<const StagedReading*> bases_;
};

/// Captures that between them change most of what can be changed.
std::vector<std::size_t> probedOf(const std::vector<MeasuredCapture>& captures) {
  std::vector<std::size_t> chosen;
  const auto add = [&](auto&& of) {
    const auto [least, most] = std::ranges::minmax_element(captures, {}, of);
    for (const auto at : {least, most}) {
      const auto number = static_cast<std::size_t>(at - captures.begin());
      if (std::ranges::find(chosen, number) == chosen.end()) chosen.push_back(number);
    }
  };
  const auto timeOf = [](const MeasuredCapture& c) {
    return c.moment.since_power_on ? c.moment.since_power_on->in(second) : 0.0;
  };
  add(timeOf);
  // A time constant changes nothing at the beginning, and nothing at the end.
  if (!captures.empty()) {
    const double first = timeOf(captures[chosen.front()]), last = timeOf(captures[chosen.back()]);
    const auto between = std::ranges::min_element(captures, {}, [&](const MeasuredCapture& c) {
      return std::abs(timeOf(c) - (first + 0.2 * (last - first)));
    });
    const auto number = static_cast<std::size_t>(between - captures.begin());
    if (std::ranges::find(chosen, number) == chosen.end()) chosen.push_back(number);
  }
  add([](const MeasuredCapture& c) { return c.record.ambient_klx; });
  add([](const MeasuredCapture& c) { return c.record.exposure_us; });
  add([](const MeasuredCapture& c) {
    return std::isfinite(c.record.distance_m) ? c.record.distance_m : 1.0;
  });
  return chosen;
}

/// One effect that varies, as a group with a camera for each of its columns.
struct VariedEffect {
  Group group;
  std::vector<Variant> variants;
};

/// All effects that may be missing or have a wrong number, with the cameras that say what they
/// would do.
struct Varied {
  std::vector<Candidate> candidates;
  std::vector<VariedEffect> effects;
};

Group groupOf(const Candidate& candidate, Kind kind) {
  Group group{.name = nameOf(candidate.example), .kind = kind, .stage = discover::stageOf(candidate.example)};
  group.covariates = covariatesOf(candidate.example);
  group.count = candidate.variations.size(), group.numbers = static_cast<int>(group.count);
  return group;
}

Result<VariedEffect> variedOf(const Declared& declared, const std::vector<sim::AnyEffect>& effects,
                              const std::vector<MeasuredCapture>& captures,
                              const Candidate& candidate, std::size_t declared_place) {
  const bool is_declared = declared_place < effects.size();
  VariedEffect varied{groupOf(candidate, is_declared ? Kind::Declared : Kind::Catalogue), {}};
  for (const Variation& variation : candidate.variations) {
    auto camera =
        NoiselessCamera::make(declared.model,
                              is_declared ? replaced(effects, declared_place, variation.on)
                                          : withInserted(effects, variation.on),
                              captures);
    if (!camera) return camera.error();
    varied.variants.push_back({*std::move(camera), discover::stageOf(variation.on)});
  }
  return varied;
}

Result<Varied> varyAll(const Declared& declared, const std::vector<sim::AnyEffect>& effects,
                       const std::vector<MeasuredCapture>& captures,
                       const std::vector<const StagedReading*>& probed, std::vector<std::string> left_out) {
  const Probe probe{declared, effects, captures, probed};
  Varied all;
  const auto add = [&](Candidate candidate, std::size_t place) -> Result<> {
    auto varied = variedOf(declared, effects, captures, candidate, place);
    if (!varied) return varied.error();
    all.effects.push_back(*std::move(varied));
    all.candidates.push_back(std::move(candidate));
    return {};
  };
  for (std::size_t place = 0; place < effects.size(); ++place) {
    if (isOnlyDelay(declared, effects[place])) continue;  // a nuisance already
    Candidate candidate = declaredCandidate(
        effects[place], [&](const Variation& variation) { return probe(variation, place); });
    if (candidate.variations.empty()) continue;
    if (auto added = add(std::move(candidate), place); !added) return added.error();
  }
  left_out.emplace_back("delay");  // the nuisance "offset" says the same
  for (Candidate& candidate :
       candidatesOf([&](const Variation& variation) { return probe(variation, effects.size()); },
                    declared.model.effects(), left_out)) {
    if (auto added = add(std::move(candidate), effects.size()); !added) return added.error();
  }
  return all;
}

double periodOf(const sim::SensorModel& model) {
  Frequency highest = 0_MHz;
  for (const Frequency frequency : model.traceRequest().frequencies)
    highest = std::max(highest, frequency);
  return highest > 0_MHz ? unambiguousRange(highest).in(metre) : 0.0;
}

Reading changeOf(const Reading& from, Reading to) {
  for (std::size_t i = 0; i < to.range_m.size(); ++i)
    to.range_m[i] -= from.range_m[i], to.log_amplitude[i] -= from.log_amplitude[i];
  return to;
}

/// What a millimetre of delay in the light changes; `to`: with kDelay_mm.
Reading delayed(const Reading& from, Reading to) {
  to = changeOf(from, std::move(to));
  for (float& change : to.range_m.pixels()) change /= static_cast<float>(kDelay_mm);
  for (float& change : to.log_amplitude.pixels()) change /= static_cast<float>(kDelay_mm);
  return to;
}

/// The camera with a delay in its light, where that is another thing than an offset of the range.
Result<std::optional<Variant>> lateOf(const Declared& declared, const std::vector<sim::AnyEffect>& effects,
                                      const std::vector<MeasuredCapture>& captures,
                                      const std::vector<const StagedReading*>& probed) {
  if (!(periodOf(declared.model) > 0.0)) return std::optional<Variant>{};
  auto camera = NoiselessCamera::make(
      declared.model, withInserted(effects, delayInLight(declared.model, kDelay_mm)), captures);
  if (!camera) return camera.error();
  std::optional<Variant> late{{*std::move(camera), Stage::Light}};
  std::vector<Reading> changes;
  for (const StagedReading* base : probed)
    changes.push_back(delayed(base->reading(), by(*base, *late)));
  if (!isNoOffset(changes)) late.reset();
  return late;
}

/// The camera with each carrier's unit.
Result<std::vector<Variant>> unequalCameras(const Declared& declared, const std::vector<sim::AnyEffect>& effects,
                                            const std::vector<MeasuredCapture>& captures,
                                            const std::vector<UnequalExposure>& carriers) {
  std::vector<Variant> cameras;
  for (const auto& [carrier, units] : carriers) {
    auto list = effects;
    for (const sim::AnyEffect& unit : units) list = withInserted(std::move(list), unit);
    auto camera = NoiselessCamera::make(declared.model, std::move(list), captures);
    if (!camera) return camera.error();
    cameras.push_back({*std::move(camera), actsOnLight(units) ? Stage::Light : Stage::Samples});
  }
  return cameras;
}

/// Where zero lies nobody knows, neither of the poses nor of the light's start: what a delay of the light does
/// beyond an offset, which is free already.
Group delayGroup() {
  return {.name = "delay of the light", .kind = Kind::Nuisance, .stage = Stage::Light, .first = kCommon,
          .count = 1, .numbers = 1};
}

double exposureUsOf(const MeasuredCapture& capture) {
  const auto& exposures = capture.moment.exposures;
  return exposures.empty() ? capture.record.exposure_us : exposures.front().duration.in(microsecond);
}

/// Amplitude as measured, but for a thousandth of all pixels, which a hot one is of; 0: the camera tells none.
double brightestOf(const std::vector<MeasuredCapture>& captures) {
  std::vector<float> logs;
  for (const MeasuredCapture& capture : captures)
    for (const float value : capture.log_amplitude.mean.pixels())
      if (std::isfinite(value)) logs.push_back(value);
  if (logs.empty()) return 0.0;
  const auto most = logs.end() - 1 - static_cast<std::ptrdiff_t>(logs.size() / 1000);
  std::ranges::nth_element(logs, most);
  return std::exp(static_cast<double>(*most));
}

}  // namespace

void CampaignRows::fillFixed(std::size_t c, const std::vector<TemperatureRate>& rates, const Reading& declared,
                             Fixed& fixed) const {
  const MeasuredCapture& capture = lit_->captures[c];
  const sim::Light& varied = *lit_->varied[c];
  fixed.name = capture.record.name, fixed.block = capture.record.block;
  fixed.cells = Cells{capture, *lit_->traced[c], declared};
  fixed.covariates =
      covariatesOf(capture, rates, varied, lit_->traced[c]->multipath, fixed.varied, declared_->model.camera(),
                   fixed.cells);
  for (const auto& [name, change] :
       carriersOf(declared_->model, fixed.varied, std::max(period_m_, 1e-3), exposureUsOf(capture))) {
    fixed.carriers[name] = fixed.whitened(change);
  }
  for (const auto& [name, change] : smearedCarriers(fixed.varied)) fixed.carriers[name] = fixed.whitened(change);
  if (hasSpilledLight()) {
    const Phasors sources = withUnread(phasorOf(fixed.varied, period_m_), varied.phasor(highestOf(varied), 1));
    for (const auto& [name, change] : spilledCarriers(fixed.varied, sources, period_m_, brightest_))
      fixed.carriers[name] = fixed.whitened(change);
  }
}

CampaignRows::PerChannel CampaignRows::Fixed::whitened(const Reading& change) const {
  PerChannel columns;
  columns[kRange] = cells.whitened(Channel::Range, change.range_m);
  if (cells.has(Channel::LogAmplitude))
    columns[kLog] = cells.whitened(Channel::LogAmplitude, change.log_amplitude);
  return columns;
}

StagedReading CampaignRows::read(const NoiselessCamera& camera, std::size_t c, bool acts_on_light) const {
  return {camera, lit_->captures[c], *lit_->varied[c], acts_on_light ? nullptr : rows_[c].fixed->collected};
}

Result<NoiselessCamera> CampaignRows::cameraWith(std::vector<sim::AnyEffect> effects) const {
  return NoiselessCamera::make(declared_->model, std::move(effects), lit_->captures);
}

Result<CampaignRows> CampaignRows::make(const Declared& declared, const Lit& lit,
                                        const Options& options) {
  const std::vector<sim::AnyEffect> effects = declaredEffects(declared);
  const auto camera = NoiselessCamera::make(declared.model, effects, lit.captures);
  if (!camera) return camera.error();
  const auto baseOf = [&](std::size_t c) { return StagedReading{*camera, lit.captures[c], *lit.varied[c]}; };
  std::vector<StagedReading> probed;
  for (const std::size_t c : probedOf(lit.captures)) probed.push_back(baseOf(c));
  std::vector<const StagedReading*> probed_at;
  for (const StagedReading& base : probed) probed_at.push_back(&base);
  auto varied = varyAll(declared, effects, lit.captures, probed_at, options.left_out);
  if (!varied) return varied.error();
  const auto late = lateOf(declared, effects, lit.captures, probed_at);
  if (!late) return late.error();

  CampaignRows all;
  if (!probed.empty() && declared.model.hasPhasors())
    all.unequal_ = unequalExposures(probed.front().collected()->steps, probed.front().collected()->taps);
  const auto unequal = unequalCameras(declared, effects, lit.captures, all.unequal_);
  if (!unequal) return unequal.error();
  all.declared_ = &declared, all.lit_ = std::make_shared<const Lit>(lit), all.effects_ = effects;
  all.groups_ = commonGroups();
  all.has_delay_ = late->has_value();
  if (all.has_delay_) all.groups_.push_back(delayGroup()), ++all.common_columns_;
  const auto tiles = LightTiles::of(lit.captures);
  const std::size_t first_tile = all.common_columns_;
  if (tiles) {
    for (Group& group : tiles->groups(first_tile)) all.groups_.push_back(std::move(group));
    all.common_columns_ += tiles->columns();
  }
  std::size_t next = all.common_columns_;
  for (std::size_t i = 0; i < varied->effects.size(); ++i) {
    VariedEffect& effect = varied->effects[i];
    effect.group.first = next, next += effect.group.count;
    all.groups_.push_back(effect.group);
    if (effect.group.kind == Kind::Declared)
      all.base_columns_ = next;
    else
      all.candidates_.push_back(std::move(varied->candidates[i]));
  }
  all.base_columns_ = std::max(all.base_columns_, all.common_columns_);
  all.period_m_ = periodOf(declared.model), all.brightest_ = brightestOf(lit.captures);
  all.rows_.resize(lit.captures.size());
  const std::vector<std::size_t> sites =
      sitesOf(declared, lit, Cells::gridOf(declared.model.camera().width, declared.model.camera().height));
  const auto rates = temperatureRates(lit.captures);
  std::atomic<std::size_t> done{0};
  sim::inParallel(static_cast<int>(lit.captures.size()), 1, [&](int first, int last) {
    for (auto c = static_cast<std::size_t>(first); c < static_cast<std::size_t>(last); ++c) {
      const StagedReading base = baseOf(c);
      const Reading declared_reading = camera->read(lit.captures[c], lit.traced[c]->light);
      auto fixed = std::make_shared<Fixed>();
      fixed->varied = base.reading(), fixed->site = sites[c];
      all.fillFixed(c, rates[c], declared_reading, *fixed);
      WhitenedCapture columns{fixed->cells, next};
      columns.putCommon(fixed->cells, *lit.traced[c]);
      columns.putResidual(fixed->cells, lit.captures[c], *lit.traced[c], declared_reading);
      for (std::size_t k = 0; k < kChannels; ++k) {
        if (columns.columns[k].size() == 0) continue;
        for (auto& [carrier, column] :
             poseColumns(columns.columns[k].middleCols(2, 5), *lit.captures[c].moment.world_from_camera))
          fixed->carriers[carrier][k] = std::move(column);
      }
      if (tiles) tiles->put(fixed->cells, lit.captures[c], first_tile, columns.columns);
      for (const VariedEffect& effect : varied->effects) {
        for (std::size_t i = 0; i < effect.variants.size(); ++i) {
          columns.putChange(fixed->cells, effect.group.first + i, base.reading(), by(base, effect.variants[i]));
        }
      }
      if (*late) {
        const Reading delayed_reading = by(base, **late);
        fixed->carriers[std::string{kDelayCarrier}] = fixed->whitened(delayed(base.reading(), delayed_reading));
        columns.putDelay(fixed->cells, base.reading(), delayed_reading);
      }
      for (std::size_t u = 0; u < unequal->size(); ++u)
        fixed->carriers[all.unequal_[u].first] = fixed->whitened(changeOf(base.reading(), by(base, (*unequal)[u])));
      CaptureRows& rows = all.rows_[c];
      const auto in_base = static_cast<Eigen::Index>(all.base_columns_);
      for (std::size_t k = 0; k < kChannels; ++k) {
        if (columns.columns[k].size() == 0) continue;
        fixed->catalogue[k] =
            columns.columns[k].rightCols(columns.columns[k].cols() - in_base);
        columns.columns[k].conservativeResize(Eigen::NoChange, in_base);
      }
      fixed->collected = base.collected();
      fixed->residual = columns.residual;
      rows.base = std::move(columns);
      rows.fixed = std::move(fixed);
      rows.evidence = ownEvidence(rows);
      if (options.tell)
        options.tell(static_cast<double>(++done) / static_cast<double>(lit.captures.size()));
    }
  });
  all.findPatterns();
  return all;
}

}  // namespace toftwin::discover
