// SPDX-License-Identifier: Apache-2.0
// What a list of effects leaves of a campaign, and what is fitted to that alone: the light's delay, and where the
// cameras stood.
#include <algorithm>
#include <cmath>

#include "calib/compare/stack.h"
#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/rows/light_tiles.h"
#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/campaign/search/places.h"
#include "sim/images/rows.h"

namespace toftwin::discover {
namespace {

/// Of offset and gain.
Fit commonFit(const Evidence& evidence, std::span<const double> scales) {
  const Marginal marginal = marginalise(evidence, scales);
  return fit(marginal, nuisanceColumns(marginal));
}

/// Whether a delay of the light does more to some of the captures than an offset of the range.
Result<bool> isDelayNoOffset(const JudgedCampaign& judged, const std::vector<sim::AnyEffect>& as_declared) {
  constexpr std::size_t kSome = 8;
  const sim::SensorModel& model = judged.declared.model;
  const auto here = NoiselessCamera::make(model, as_declared, judged.lit.captures);
  const auto late =
      NoiselessCamera::make(model, withDelay(model, as_declared, kDelay_mm), judged.lit.captures);
  if (!here || !late) return here ? late.error() : here.error();
  std::vector<Reading> changes;
  const std::size_t stride = 1 + judged.lit.captures.size() / kSome;
  for (std::size_t c = 0; c < judged.lit.captures.size(); c += stride) {
    const MeasuredCapture& capture = judged.lit.captures[c];
    const sim::Light& light = *judged.lit.varied[c];
    const Reading before = here->read(capture, light);
    Reading change = late->read(capture, light);
    for (std::size_t i = 0; i < change.range_m.size(); ++i) change.range_m[i] -= before.range_m[i];
    changes.push_back(std::move(change));
  }
  return isNoOffset(changes);
}

}  // namespace

Result<Evidence> residualEvidence(const JudgedCampaign& judged, const std::vector<sim::AnyEffect>& effects) {
  const Lit& lit = judged.lit;
  const auto declared =
      NoiselessCamera::make(judged.declared.model, declaredEffects(judged.declared), lit.captures);
  if (!declared) return declared.error();
  const auto here = NoiselessCamera::make(judged.declared.model, effects, lit.captures);
  if (!here) return here.error();
  const auto tiles = LightTiles::of(lit.captures);
  const std::size_t columns = kCommon + (tiles ? tiles->columns() : 0);
  Evidence evidence;
  evidence.groups = commonGroups();
  if (tiles)
    for (Group& group : tiles->groups(kCommon)) evidence.groups.push_back(std::move(group));
  evidence.captures.resize(lit.captures.size());
  sim::inParallel(static_cast<int>(lit.captures.size()), 1, [&](int first, int last) {
    for (auto c = static_cast<std::size_t>(first); c < static_cast<std::size_t>(last); ++c) {
      const MeasuredCapture& capture = lit.captures[c];
      const TracedCapture& traced = *lit.traced[c];
      // Which pixels count must not depend on what is fitted.
      const Cells cells{capture, traced, declared->read(capture, traced.light), judged.most_cells};
      WhitenedCapture whitened{cells, columns};
      whitened.putCommon(cells, traced);
      if (tiles) tiles->put(cells, capture, kCommon, whitened.columns);
      whitened.putResidual(cells, capture, traced,
                           readingOf(*declared, *here, capture, traced.light, *lit.varied[c]));
      evidence.captures[c] = whitened.evidence(capture.record.name, capture.record.block);
    }
  });
  evidence.captures = joined(std::move(evidence.captures), standsOf(lit.captures));
  return evidence;
}

bool tellDelay(const std::vector<MeasuredCapture>& captures) {
  constexpr std::size_t kEnough = 3;
  std::vector<Transform<World, Camera>> places;
  for (const MeasuredCapture& capture : captures) {
    const auto& pose = capture.moment.world_from_camera;
    const auto isThere = [&](const auto& place) { return pose && compare::samePose(*pose, place); };
    if (pose && std::ranges::none_of(places, isThere)) places.push_back(*pose);
  }
  return places.size() >= kEnough;
}

Result<double> delayThatFits(const JudgedCampaign& judged) {
  constexpr double kStep_mm = 2.0, kMost_mm = 100.0, kDone_mm = 0.1;
  const sim::SensorModel& model = judged.declared.model;
  if (model.traceRequest().frequencies.empty()) return 0.0;  // a pulsed camera's gates know no cyclic error
  if (!tellDelay(judged.lit.captures)) return 0.0;
  const auto as_declared = effectsWithoutNoise(model);
  const auto is_told = isDelayNoOffset(judged, as_declared);
  if (!is_told) return is_told.error();
  if (!*is_told) return 0.0;
  std::vector<double> weights;  // the same for all delays
  const auto fitAt = [&](double delay_mm) -> Result<Fit> {
    auto evidence = residualEvidence(judged, withDelay(model, as_declared, delay_mm));
    if (!evidence) return evidence.error();
    if (weights.empty()) weights = temperOf(*evidence, judged.scales);
    return commonFit(weighed(*std::move(evidence), weights), judged.scales);
  };
  const auto start = fitAt(0.0);
  if (!start) return start.error();
  double delay_mm = 0.0, deviance = start->deviance;
  for (int k = 0; k < 6; ++k) {
    const auto before = fitAt(delay_mm - kStep_mm), behind = fitAt(delay_mm + kStep_mm);
    if (!before || !behind) return before ? behind.error() : before.error();
    const double slope = 0.5 * (behind->deviance - before->deviance) / kStep_mm;
    const double bend = (behind->deviance + before->deviance - 2.0 * deviance) / (kStep_mm * kStep_mm);
    if (!(bend > 1e-9 * deviance)) break;
    const double by = std::clamp(-slope / bend, -kMost_mm, kMost_mm);
    const auto next = fitAt(delay_mm + by);
    if (!next) return next.error();
    if (!(next->deviance < deviance)) break;
    delay_mm += by, deviance = next->deviance;
    if (std::abs(by) < kDone_mm) break;
  }
  const double dispersion = std::max(1.0, deviance / std::max(1.0, start->freedom));
  return start->deviance - deviance > 9.0 * dispersion ? delay_mm : 0.0;
}

Result<std::vector<std::shared_ptr<const TracedCapture>>> traceWhereTheyStood(
    const Declared& declared, const std::vector<sim::AnyEffect>& effects,
    const std::vector<MeasuredCapture>& captures,
    const std::vector<std::shared_ptr<const TracedCapture>>& traced, const TraceOptions& options,
    const std::function<void(double)>& tell) {
  const Lights lights = lightsOf(traced);
  const Lit lit{captures, traced, lights};
  const auto evidence = residualEvidence({declared, lit, {}}, effects);
  if (!evidence) return evidence.error();
  const std::vector<Place> places = placesBy(*evidence, {});
  std::vector<Stood> stood;
  for (const std::size_t stand : standsOf(captures)) {
    Stood& here = stood.emplace_back(places[stand].off);
    for (double& way : here) way = std::clamp(way, -10.0, 10.0);
  }
  TraceOptions again = options;
  again.seed += 0x2545f491U;
  return traceAll(declared, captures, again, tell, stood);
}

}  // namespace toftwin::discover
