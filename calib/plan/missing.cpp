// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/missing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>


namespace toftwin::plan {
namespace {

constexpr double kMissing = 0.05;    ///< a smaller share is in the table of valid pixels
constexpr double kMoreThanOther = 2.0;  ///< noise makes equal cameras lack alike

using Condition = std::vector<const ComparedCapture*>;

/// In their order; captures whose images are of another size than the first one's are left out.
std::vector<Condition> conditionsOf(const ComparedRun& run) {
  std::map<CaptureRecord::Condition, std::size_t> places;
  std::vector<Condition> conditions;
  for (const ComparedCapture& one : run.captures) {
    if (one.record.kind == nameOf(Kind::Dark) || one.thinned.valid_a.empty()) continue;
    const auto [place, is_new] =
        places.try_emplace(one.record.conditionInRun(), conditions.size());
    if (is_new) conditions.emplace_back();
    Condition& condition = conditions[place->second];
    if (condition.empty() || condition.front()->thinned.valid_a.size() == one.thinned.valid_a.size())
      condition.push_back(&one);
  }
  return conditions;
}

/// Whether each camera has a pixel in all captures of a condition, and whether in any.
struct Seen {
  std::array<bool, 2> all{true, true}, any{};

  Seen(const Condition& condition, std::size_t pixel) {
    for (const ComparedCapture* one : condition) {
      const std::array has{one->thinned.valid_a[pixel] >= 0.5F, one->thinned.valid_b[pixel] >= 0.5F};
      for (std::size_t k = 0; k < has.size(); ++k) all[k] = all[k] && has[k], any[k] = any[k] || has[k];
    }
  }
};

/// Of all pixels that both look at and either has, the share that each camera lacks.
std::array<double, 2> lackedBy(const Condition& condition) {
  std::array<double, 2> lacked{};
  double either = 0.0;
  for (std::size_t i = 0; i < condition.front()->thinned.valid_b.size(); ++i) {
    const auto looksAt = [i](const ComparedCapture* one) { return std::isfinite(one->thinned.valid_b[i]); };
    if (!std::ranges::all_of(condition, looksAt)) continue;
    const Seen seen{condition, i};
    either += seen.any[0] || seen.any[1];
    for (std::size_t k = 0; k < lacked.size(); ++k) lacked[k] += !seen.any[k] && seen.all[1 - k];
  }
  for (double& share : lacked) share /= std::max(1.0, either);
  return lacked;
}

}  // namespace

std::vector<compare::MissingAt> missingOf(const ComparedRun& run) {
  std::vector<compare::MissingAt> missing;
  for (const Condition& condition : conditionsOf(run)) {
    const auto lacked = lackedBy(condition);
    for (std::size_t k = 0; k < lacked.size(); ++k) {
      if (lacked[k] > kMissing && lacked[k] > kMoreThanOther * lacked[1 - k])
        missing.push_back({condition.front()->record.name, kCameras[k], lacked[k], condition.size()});
    }
  }
  std::ranges::stable_sort(missing, std::ranges::greater{}, &compare::MissingAt::share);
  return missing;
}

}  // namespace toftwin::plan
