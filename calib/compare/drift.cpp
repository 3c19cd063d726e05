// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/drift.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace toftwin::compare {
namespace {

Drift driftBetween(const std::vector<PoseComparison>& poses, std::size_t first, std::size_t last) {
  const PoseComparison &before = poses[first], &after = poses[last];
  const Image<float>& range = before.range_a_mm;
  Image<float> changed(range.width(), range.height(), std::numeric_limits<float>::quiet_NaN());
  Running a, difference;
  if (after.range_a_mm.size() != range.size()) return {.first = first, .last = last};
  for (std::size_t i = 0; i < range.size(); ++i) {
    if (!isCompared(before, i) || !isCompared(after, i)) continue;
    const float change = after.difference_mm[i] - before.difference_mm[i];
    if (!std::isfinite(change)) continue;
    changed[i] = change;
    difference.add(static_cast<double>(change));
    a.add(static_cast<double>(after.range_a_mm[i] - range[i]));
  }
  return {.first = first,
          .last = last,
          .pixels = difference.n(),
          .a_mm = a.mean(),
          .b_mm = a.mean() + difference.mean(),
          .difference_mm = difference.mean(),
          .error_mm = blockedError(changed)};
}

}  // namespace

std::vector<Drift> driftsOf(const std::vector<PoseComparison>& poses) {
  const std::vector<std::uint32_t> place = placesOf(poses);
  std::vector<Drift> drifts;
  for (std::size_t first = 0; first < poses.size(); ++first) {
    if (std::find(place.begin(), place.begin() + static_cast<std::ptrdiff_t>(first), place[first]) !=
        place.begin() + static_cast<std::ptrdiff_t>(first))
      continue;
    std::size_t last = first;
    for (std::size_t i = first + 1; i < poses.size(); ++i) {
      if (place[i] == place[first]) last = i;
    }
    if (last == first) continue;
    if (const Drift drift = driftBetween(poses, first, last); drift.pixels > 0)
      drifts.push_back(drift);
  }
  return drifts;
}

Json toJson(const std::vector<Drift>& drifts) {
  Json json = Json::array();
  for (const Drift& d : drifts) {
    Json row = Json::object();
    row.set("first_pose", d.first).set("last_pose", d.last).set("pixels", d.pixels);
    row.set("a_mm", d.a_mm).set("b_mm", d.b_mm);
    row.set("difference_mm", d.difference_mm).set("standard_error_mm", d.error_mm);
    json.push(std::move(row));
  }
  return json;
}

}  // namespace toftwin::compare
