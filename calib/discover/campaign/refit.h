// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/campaign/campaign.h"
#include "calib/discover/campaign/catalogue.h"
#include "calib/discover/campaign/rows.h"

namespace toftwin::discover {

/// A number of an effect, as it was found.
struct FittedNumber {
  std::string key{};
  double value = 0.0, error = 0.0;
};

/// An effect that goes into the model.
struct FittedEffect {
  sim::AnyEffect effect;
  std::vector<FittedNumber> numbers{};  ///< those that were fitted
};

/// A campaign on which models are judged: what is needed of it again and again.
struct Judged {
  const Declared& declared;
  const std::vector<MeasuredCapture>& captures;
  const std::vector<std::shared_ptr<const TracedCapture>>& traced;
  std::vector<double> scales{};  ///< of poses and light, as estimated
  int most_cells = 2000;         ///< of each capture
};

/// What a list of effects, noise not among them, leaves of the measurement. Error: an exposure that
/// the model cannot have.
Result<Evidence> residualEvidence(const Judged& judged, const std::vector<sim::AnyEffect>& effects);

/// Fits the numbers of the effects at `places` of the list by least squares through the simulator
/// (Levenberg and Marquardt), and gives the list with the errors of what was fitted.
struct Refitted {
  std::vector<sim::AnyEffect> effects{};
  std::vector<FittedEffect> fitted{};  ///< by place
  double deviance = 0.0, dispersion = 1.0;
  double offset_mm = 0.0, offset_error_mm = 0.0;
  double gain_percent = 0.0;
};
Result<Refitted> refit(const Judged& judged, std::vector<sim::AnyEffect> effects,
                       const std::vector<std::size_t>& places);

/// Light traced again where the cameras probably stood: what a place off the pose changes is then
/// known to second order, which counts where a thousand pixels say the same.
Result<std::vector<std::shared_ptr<const TracedCapture>>> traceWhereTheyStood(
    const Declared& declared, const std::vector<MeasuredCapture>& captures,
    const std::vector<std::shared_ptr<const TracedCapture>>& traced, const TraceOptions& options,
    const std::function<void(double)>& tell = {});

/// Where to begin: the one variation of a candidate that explains most, as strong as it explains
/// most.
sim::AnyEffect startOf(const CampaignRows& rows, const Candidate& candidate,
                       std::span<const double> scales);

}  // namespace toftwin::discover
