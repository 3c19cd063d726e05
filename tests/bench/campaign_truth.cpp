// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/campaign_truth.h"

#include <cstdio>
#include <cstdlib>
#include <utility>

#include <toftwin/nan.h>

#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/rows/rows.h"
#include "calib/discover/marginal.h"

namespace toftwin::discover::bench {
namespace {

template <class T>
T known(Result<T> result) {
  if (result) return *std::move(result);
  std::fprintf(stderr, "%s\n", result.error().message.c_str());
  std::exit(1);
}

}  // namespace

KnownCaptures::KnownCaptures(const Declared& declared, std::vector<MeasuredCapture> captures,
                             const TraceOptions& trace)
    : declared_(declared),
      captures_(std::move(captures)),
      traced_(known(traceAll(declared, captures_, trace))) {}

KnownCaptures KnownCaptures::open(const std::filesystem::path& run, const Declared& declared,
                                  const TraceOptions& trace) {
  return {declared, known(readCampaign(run, Side::A)).captures, trace};
}

KnownCaptures KnownCaptures::locked(const std::filesystem::path& run, const Declared& declared,
                                    const TraceOptions& trace) {
  return {declared, known(readLocked(known(readCampaign(run, Side::A)))), trace};
}

double KnownCaptures::between(const std::vector<sim::AnyEffect>& a,
                              const std::vector<sim::AnyEffect>& b) const {
  const auto grid =
      known(NoiselessCamera::make(declared_.model, effectsWithoutNoise(declared_.model), captures_));
  const auto from = known(NoiselessCamera::make(declared_.model, a, captures_));
  const auto to = known(NoiselessCamera::make(declared_.model, b, captures_));
  Evidence evidence{commonGroups(), {}};
  for (std::size_t c = 0; c < traced_.size(); ++c) {
    const MeasuredCapture& capture = captures_[c];
    const TracedCapture& traced = *traced_[c];
    const Cells cells{capture, traced, grid.read(capture, traced.light)};
    WhitenedCapture whitened{cells, kCommon};
    whitened.putCommon(cells, traced);
    whitened.putResidual(cells, whitened.residual, to.read(capture, traced.light),
                         from.read(capture, traced.light));  // to − from
    evidence.captures.push_back(whitened.evidence(capture.record.name, capture.record.block));
  }
  const Marginal marginal = marginalise(evidence, {});
  return fit(marginal, nuisanceColumns(marginal)).deviance;
}

Removed removedFrom(const KnownCaptures& locked, const Declared& declared, const sim::SensorModel& truth,
                    const CampaignFinding& finding) {
  // What nobody could see at three standard errors is no loss where it stays.
  constexpr double kLeast = 9.0;
  const auto as_found = known(sim::SensorModel::parse(finding.model_toml, "model.toml"));
  const auto real = effectsWithoutNoise(truth);
  const auto file = effectsWithoutNoise(declared.model);
  Removed removed;
  removed.explainable = locked.between(real, withDelay(declared.model, file, finding.zero.delay_mm));
  removed.share = removed.explainable < kLeast
                      ? kNaN
                      : 1.0 - locked.between(real, effectsWithoutNoise(as_found)) / removed.explainable;
  return removed;
}

}  // namespace toftwin::discover::bench
