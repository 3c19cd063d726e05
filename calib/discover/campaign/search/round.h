// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/campaign/rows/rows.h"
#include "calib/discover/campaign/search/campaign_finding.h"

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

}  // namespace toftwin::discover
