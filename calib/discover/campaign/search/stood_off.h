// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/campaign/search/places.h"
#include "calib/discover/campaign/search/search_rounds.h"

/// A camera that was bumped stands elsewhere than its pose says, in a place or two of all: what its light then leaves,
/// as a straight line does not reach there, looks like something that the model lacks.
namespace toftwin::discover {

/// Places that are farther from all others than chance, as indices, ascending: the largest such set of `most` or fewer,
/// since two hide each other where each is compared with all others (B. Rosner, Technometrics 25 (1983) 165).
/// `ways`: deviations of the places in each way, NaN where it is not told. In one way at least, each is off the others'
/// mean by Student's t of which chance exceeds one in a share `wrong` of the lists, and twice as far as any of
/// them: what moves more places alike is no bump.
std::vector<std::size_t> farOff(const std::vector<std::vector<double>>& ways, std::size_t most, double wrong);

/// Whether a deviation is so far from the others' mean; `wrong` for this one alone.
bool isFarOff(double deviation, const std::vector<double>& others, double wrong);

/// Deviations in each way, NaN where captures do not tell it.
std::vector<std::vector<double>> waysOf(const std::vector<Place>& places);

/// What is told of a place and its captures; `stands` says where each capture stood.
StoodOff describe(std::size_t stand, const std::vector<std::size_t>& stands, const std::vector<MeasuredCapture>& all,
                  const Place& place);

/// The places off their poses, as what was found says of all of them. None: there is none, or their captures are more
/// than one and a twentieth of all. Error: an exposure that the model cannot have.
Result<std::vector<StoodOff>> stoodOff(const Round& round, const OpenCaptures& open);

/// Captures without those of places that were set aside.
struct SomeCaptures {
  std::vector<MeasuredCapture> captures{};
  std::vector<std::shared_ptr<const TracedCapture>> at_poses{};
};

/// A search, and the captures that it is of.
struct SearchOf {
  std::unique_ptr<SomeCaptures> without{};  ///< null: all; outlives the round
  std::unique_ptr<Round> round{};
  std::vector<StoodOff> off{};
};

/// What a reader of the report should know of it.
std::string noteOf(const StoodOff& off);

/// searchInRounds; and where that finds something, or leaves something, beside places that were bumped, once more
/// without them. That counts if it leaves nothing, where the first left something or found more.
Result<SearchOf> searchBesideBumped(const Declared& file, const OpenCaptures& open,
                                    const std::function<void()>& begin, const std::function<void(double)>& tell);

}  // namespace toftwin::discover
