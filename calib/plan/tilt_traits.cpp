// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/tilt_traits.h"

#include <array>
#include <map>

#include <fmt/format.h>

#include "calib/compare/image_slopes.h"
#include "calib/compare/statistics.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/plan/seen.h"

namespace toftwin::plan {
namespace {

constexpr const char* kTilt = "tilt over the image";
constexpr std::array kWays{"left to right", "top to bottom"};
constexpr std::size_t kFewestConditions = 3;

}  // namespace

void addTilt(const ComparedRun& run, compare::TraitCollector& all) {
  // Repeats of a condition share their place, and what the wall is like there: their mean is one.
  std::map<CaptureRecord::Condition, std::array<compare::Running, 2>> conditions;
  bool is_seen = false;
  for (const ComparedCapture* one : capturesOf(run, nameOf(Kind::Distance))) {
    is_seen = is_seen || sharedPoseOf(one->record);
    const auto slopes = compare::imageSlopes_mm(one->thinned);
    if (!slopes) continue;
    auto& means = conditions[one->record.conditionInRun()];
    for (std::size_t way = 0; way < kWays.size(); ++way) means[way].add((*slopes)[way]);
  }
  if (is_seen)
    return all.untold(fmt::format("{}: poses were seen, and captures of a condition share their turn", kTilt));
  if (conditions.size() < kFewestConditions) {
    return all.untold(fmt::format(
        "{}: {} conditions of kind distance show over half of the image both ways, and it takes {}", kTilt,
        conditions.size(), kFewestConditions));
  }
  std::vector<compare::Trait> traits;
  for (std::size_t way = 0; way < kWays.size(); ++way) {
    std::vector<double> slopes_mm;
    for (const auto& [condition, means] : conditions) slopes_mm.push_back(means[way].mean());
    traits.push_back(compare::meanTrait(kWays[way], "mm", slopes_mm));
  }
  all.add(kTilt, "B − A", traits);
}

}  // namespace toftwin::plan
