// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/campaign/captures/campaign.h"
#include "calib/discover/campaign/captures/catalogue.h"
#include "calib/discover/campaign/captures/effect_numbers.h"
#include "calib/discover/campaign/rows/rows.h"
#include "calib/discover/marginal.h"

namespace toftwin::discover {

/// A campaign on which models are judged: what is needed of it again and again.
struct JudgedCampaign {
  const Declared& declared;
  const Lit& lit;
  std::vector<double> scales{};  ///< of poses and light, as estimated
  int most_cells = 2000;         ///< of each capture
};

/// What a list of effects, noise not among them, leaves of the measurement. Error: an exposure that
/// the model cannot have.
Result<Evidence> residualEvidence(const JudgedCampaign& judged, const std::vector<sim::AnyEffect>& effects);

struct RefitOptions {
  std::span<const double> scales{};    ///< of poses and light
  std::span<const TermGroup> terms{};  ///< known besides
  bool with_numbers = false;           ///< the source's effects' own numbers are nuisances
  bool looks_farther = false;          ///< what shapes an effect may be far from where it is
  /// Numbers of these names, each of which makes an effect strong, go if the data do not need them: less than
  /// two standard errors from nothing, and χ² rises by no more than 4 for each number that goes.
  std::vector<std::string> droppable{};
  /// So many of the places, the first ones, are a camera file's: what nothing tells of them stays as it says.
  std::size_t of_file = 0;
  /// Of the effects at these places, only these numbers.
  std::map<std::size_t, std::vector<std::string>> only{};
};

/// Fits the numbers of the effects at `places` of the list by least squares through the simulator
/// (Levenberg and Marquardt), and gives the list with the errors of what was fitted.
struct Refitted {
  std::vector<sim::AnyEffect> effects{};
  std::vector<FittedEffect> fitted{};  ///< by place
  std::vector<FreeNumber> free{};      ///< what was fitted
  Marginal marginal{};                 ///< of what is left, the free numbers' columns last
  double deviance = 0.0, dispersion = 1.0;
  double offset_mm = 0.0, gain_percent = 0.0;
  double delay_mm = 0.0;  ///< of the light, beyond an offset of the range; 0 where that is the same
  double moved_mm = 0.0;  ///< that of it by which the light was moved when the rest was fitted
  Eigen::Matrix3d common_covariance = Eigen::Matrix3d::Zero();  ///< of offset, gain and delay
};
Result<Refitted> refit(const CampaignRows& rows, std::vector<sim::AnyEffect> effects,
                       const std::vector<std::size_t>& places, const RefitOptions& options);

/// What a campaign says of where zero lies: an offset of the range, and a delay of the light where that is another
/// thing and no chance (3 standard errors).
struct Zero {
  double offset_mm = 0.0, offset_error_mm = 0.0;
  double delay_mm = 0.0;
  double gain_percent = 0.0, gain_error_percent = 0.0;
  /// Whether the amplitude's unit, or its light, is no chance another one than the camera file's.
  [[nodiscard]] bool hasGain() const { return std::abs(gain_percent) > 3.0 * gain_error_percent; }
  /// Whether the offset is no chance, so that it is written.
  [[nodiscard]] bool hasOffset() const { return std::abs(offset_mm) > 3.0 * offset_error_mm; }
};
/// `known_mm`: the delay that the fitted effects have already. It is tested with what was fitted beyond it, and taken
/// back where both together are no more than chance. The zero's delay is the one beyond it.
/// `tells_delay`: whether the captures can; otherwise there is none.
Zero zeroOf(const Refitted& refitted, double known_mm, bool tells_delay = true);

/// Whether captures are of so many places, three, that what a delay of the light does is told from what else the model
/// lacks: in one image both are some curve over the range.
bool tellDelay(const std::vector<MeasuredCapture>& captures);

/// The delay of the light that fits best, offset and gain being free, in millimetres: what it does to the cyclic error
/// is not proportional to it. 0 where it is an offset of the range and nothing else, no more than chance, or not told.
Result<double> delayThatFits(const JudgedCampaign& judged);

/// Light traced again where the cameras probably stood, if these were their effects: what a place off the
/// pose changes is then known to second order, which counts where a thousand pixels say the same.
Result<std::vector<std::shared_ptr<const TracedCapture>>> traceWhereTheyStood(
    const Declared& declared, const std::vector<sim::AnyEffect>& effects,
    const std::vector<MeasuredCapture>& captures,
    const std::vector<std::shared_ptr<const TracedCapture>>& traced, const TraceOptions& options,
    const std::function<void(double)>& tell = {});

/// Where to begin: the one variation of a candidate that explains most beyond nuisances and `known`, as
/// strong as it explains most.
sim::AnyEffect startOf(const CampaignRows& rows, const Candidate& candidate,
                       std::span<const TermGroup> known, std::span<const double> scales);

}  // namespace toftwin::discover
