// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/search/next_capture.h"

#include <algorithm>
#include <functional>

#include <fmt/format.h>

#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/search/model_file.h"
#include "calib/discover/marginal.h"

namespace toftwin::discover {
namespace {

/// How a capture could be taken again with as much light, so that its noise is known.
struct Again {
  std::string words;
  std::function<void(MeasuredCapture&)> change;
};

void warm(MeasuredCapture& capture, double degrees) {
  for (NamedTemperature& one : capture.moment.temperatures) one.value = one.value + degrees * celsius;
}

/// The camera as it was at another capture, switched on just now.
std::function<void(MeasuredCapture&)> switchedOnAs(const MeasuredCapture& other) {
  return [temperatures = other.moment.temperatures](MeasuredCapture& capture) {
    capture.moment.temperatures = temperatures;
    if (capture.moment.since_power_on) capture.moment.since_power_on = 0.0 * second;
  };
}

std::vector<Again> waysToTake(const std::vector<MeasuredCapture>& captures) {
  const auto [coldest, warmest] = std::ranges::minmax_element(captures, {}, [](const MeasuredCapture& one) {
    return one.moment.since_power_on ? one.moment.since_power_on->in(second) : 0.0;
  });
  return {{"", [](MeasuredCapture&) {}},
          {"just after switching the cold camera on", switchedOnAs(*coldest)},
          {"just after switching the warm camera off and on", switchedOnAs(*warmest)},
          {"in a room 10 degrees warmer", [](MeasuredCapture& one) { warm(one, 10.0); }}};
}

/// One capture of each block and place; captures that only differ in their time are the same experiment.
std::vector<std::size_t> differentOnes(const std::vector<MeasuredCapture>& captures) {
  constexpr std::size_t kMost = 16;
  std::vector<std::size_t> all;
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const bool is_known = std::ranges::any_of(all, [&](std::size_t k) {
      const plan::CaptureRecord &a = captures[k].record, &b = captures[c].record;
      return a.block == b.block && a.pose == b.pose && a.exposure_us == b.exposure_us;
    });
    if (!is_known) all.push_back(c);
  }
  std::vector<std::size_t> some;
  const std::size_t stride = 1 + all.size() / kMost;
  for (std::size_t i = 0; i < all.size(); i += stride) some.push_back(all[i]);
  return some;
}

/// By how much two models differ in captures.
class Differing {
 public:
  Differing(const JudgedCampaign& judged, const std::vector<sim::AnyEffect>& one,
            const std::vector<sim::AnyEffect>& other)
      : judged_(judged), one_(one), other_(other) {}

  /// One capture each; empty where the camera cannot be simulated so.
  [[nodiscard]] std::vector<CaptureEvidence> in(const std::vector<MeasuredCapture>& captures,
                                                const std::vector<std::size_t>& places) const {
    const sim::SensorModel& model = judged_.declared.model;
    const auto here = NoiselessCamera::make(model, one_, captures),
               there = NoiselessCamera::make(model, other_, captures);
    if (!here || !there) return {};
    std::vector<CaptureEvidence> all;
    for (std::size_t i = 0; i < captures.size(); ++i) {
      const TracedCapture& traced = *judged_.lit.traced[places[i]];
      const Reading a = here->read(captures[i], traced.light), b = there->read(captures[i], traced.light);
      const Cells cells{captures[i], traced, a, judged_.most_cells};
      WhitenedCapture whitened{cells, kCommon};
      whitened.putCommon(cells, traced);
      whitened.putResidual(cells, whitened.residual, b, a);  // a − b
      all.push_back(whitened.evidence(captures[i].record.name, captures[i].record.block));
    }
    return all;
  }

  [[nodiscard]] Marginal marginalOf(std::vector<CaptureEvidence> captures) const {
    return marginalise({commonGroups(), std::move(captures)}, judged_.scales);
  }

 private:
  const JudgedCampaign& judged_;
  const std::vector<sim::AnyEffect>&one_, &other_;
};

std::vector<sim::AnyEffect> with(std::vector<sim::AnyEffect> effects,
                                 const std::vector<sim::AnyEffect>& more) {
  for (const sim::AnyEffect& one : more) effects = withInserted(std::move(effects), one);
  return effects;
}

/// What the simulator says of it; nothing where it has no form, or one whose strength is still to be fitted.
std::vector<sim::AnyEffect> formsOf(const Effect& effect, const CampaignRows& rows,
                                    const sim::SensorModel& model) {
  if (effect.fit) return {campaignFitOf(*effect.fit).effect};
  std::vector<sim::AnyEffect> forms;
  for (const LearnedEffect& learned : learnedEffectsOf(effect, rows, model)) {
    if (!learned.free.empty()) return {};
    forms.push_back(learned.effect);
  }
  return forms;
}

Effect asEffect(const Alternative& other) {
  Effect effect{.name = other.name, .coefficient = other.coefficient, .fit = other.named};
  effect.parts.push_back({.group = other.group});
  return effect;
}

}  // namespace

std::optional<NextCapture> nextCapture(const JudgedCampaign& judged, const std::vector<sim::AnyEffect>& one,
                                       const std::vector<sim::AnyEffect>& other) {
  const std::vector<MeasuredCapture>& captures = judged.lit.captures;
  const Differing differing{judged, one, other};
  std::vector<std::size_t> every(captures.size());
  for (std::size_t c = 0; c < every.size(); ++c) every[c] = c;
  const Marginal campaign = differing.marginalOf(differing.in(captures, every));
  if (campaign.captures.empty()) return std::nullopt;
  const Eigen::VectorXd common = fit(campaign, nuisanceColumns(campaign)).coefficient;
  std::optional<NextCapture> best;
  double taken_chi2 = 0.0;
  const std::vector<std::size_t> places = differentOnes(captures);
  for (const Again& again : waysToTake(captures)) {
    std::vector<MeasuredCapture> taken;
    for (const std::size_t c : places) again.change(taken.emplace_back(captures[c]));
    const Marginal marginal = differing.marginalOf(differing.in(taken, places));
    for (const CaptureEvidence& capture : marginal.captures) {
      const double chi2 =
          capture.energy - 2.0 * common.dot(capture.moment) + common.dot(capture.gram * common);
      if (again.words.empty()) taken_chi2 = std::max(taken_chi2, chi2);
      if (!best || chi2 > best->chi2)
        best = NextCapture{.like = capture.name, .change = again.words, .chi2 = chi2};
    }
  }
  constexpr double kTold = 9.0;  // three standard errors
  if (!best || best->chi2 < kTold) return std::nullopt;
  best->taken_chi2 = taken_chi2;
  return best;
}

void addNextCaptures(const JudgedCampaign& judged, const CampaignRows& rows,
                     std::vector<FoundEffect>& effects) {
  const sim::SensorModel& model = judged.declared.model;
  for (FoundEffect& found : effects) {
    const auto own = formsOf(found.found, rows, model);
    if (own.empty() || found.found.is_rest) continue;
    for (const Alternative& other : found.found.alternatives) {
      const auto forms = formsOf(asEffect(other), rows, model);
      if (forms.empty()) continue;
      const auto as_declared = declaredEffects(judged.declared);
      found.next = nextCapture(judged, with(as_declared, own), with(as_declared, forms));
      if (found.next) found.next->other = other.name;
      break;
    }
  }
}

}  // namespace toftwin::discover
