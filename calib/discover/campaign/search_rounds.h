// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/campaign/discover_campaign.h"
#include "calib/discover/campaign/refit.h"
#include "calib/discover/campaign/rows.h"

namespace toftwin::discover {

/// The open captures, and how they are to be searched.
struct OpenCaptures {
  const std::vector<MeasuredCapture>& captures;
  const std::vector<std::shared_ptr<const TracedCapture>>& at_poses;
  const TraceOptions& trace;
  const FinderOptions& finder;
  std::vector<std::string> left_out{};  ///< effects that are no candidates
  bool has_steps = false;               ///< single frames tell the converter's steps
  bool trusts_poses = false;            ///< begins where the cameras were said to stand, nearly
};

/// What a search found, fitted, and from where it started: everything is linear about there.
struct Round {
  Declared declared;  ///< the camera file's numbers, or where the round before left those that were wrong
  std::vector<std::shared_ptr<const TracedCapture>> traced{};  ///< where the cameras then stood
  Lights varied{};  ///< there, along other paths: what effects are tried on
  std::optional<CampaignRows> rows{};
  Finding finding{};
  std::vector<FoundEffect> effects{};
  std::vector<FittedEffect> updates{};  ///< of the camera file's numbers
  Refitted refitted{};
  Zero zero{};  ///< its delay is beyond declared.delay_mm

  [[nodiscard]] bool leavesSomething(double alpha) const { return finding.last_p <= alpha; }
  [[nodiscard]] std::size_t things() const { return effects.size() + updates.size(); }
};

/// Searches, and once more from where the fit ended, if something is left beside what was found or if effects
/// were found beside wrong numbers: poses, delay and numbers that are far off leave what is not linear in
/// them, and that looks like an effect. Where the first round leaves much, or poses far off, a strong effect
/// may have gone into them before it was found: all begins again at the poses as they were stated, and that
/// counts if it leaves neither. `file`: the camera file, with the delay of the light as it fits without any
/// effect. `begin` is called between the first round's phases: trace, vary, find, fit.
Result<std::unique_ptr<Round>> searchInRounds(const Declared& file, const OpenCaptures& open,
                                              const std::function<void()>& begin,
                                              const std::function<void(double)>& tell);

}  // namespace toftwin::discover
