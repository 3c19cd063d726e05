// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/campaign/search_rounds.h"

/// A camera that was bumped stands elsewhere than its pose says, in one place of all: what its light then leaves, as a
/// straight line does not reach there, looks like something that the model lacks.
namespace toftwin::discover {

/// The one place that is farther from the others than chance, as an index. By Student's t of each of
/// `deviations` against all others (F. E. Grubbs, Ann. Math. Stat. 21 (1950) 27), so that where all are Gaussian
/// one is found in a share `wrong` of the lists at most; and all others are less than half as far from their mean.
/// So what moves two places alike is neither.
std::optional<std::size_t> oneFarOff(const std::vector<double>& deviations, double wrong);

/// The place off its pose, as what was found says of all of them. None: there is none, or its captures are more than
/// one and a twentieth of all. Error: an exposure that the model cannot have.
Result<std::optional<StoodOff>> stoodOff(const Round& round, const OpenCaptures& open);

/// Captures without those of a place that was set aside.
struct SomeCaptures {
  std::vector<MeasuredCapture> captures{};
  std::vector<std::shared_ptr<const TracedCapture>> at_poses{};
};

/// A search, and the captures that it is of.
struct SearchOf {
  std::unique_ptr<SomeCaptures> without{};  ///< null: all; outlives the round
  std::unique_ptr<Round> round{};
  std::optional<StoodOff> off{};
};

/// What a reader of the report should know of it.
std::string noteOf(const StoodOff& off);

/// searchInRounds; and where that finds something, or leaves something, beside one place that was bumped, once more
/// without it. That counts if it leaves nothing, where the first left something or found more.
Result<SearchOf> searchBesideBumped(const Declared& file, const OpenCaptures& open,
                                    const std::function<void()>& begin, const std::function<void(double)>& tell);

}  // namespace toftwin::discover
