// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/trend.h"

#include <algorithm>
#include <map>
#include <tuple>

#include <fmt/format.h>

#include "calib/compare/traits/difference.h"

namespace toftwin::plan {
namespace {

std::string camerasOf(const LoggedTrait& one) {
  if (one.trait.of == "A") return one.run.camera_a;
  if (one.trait.of == "B") return one.run.camera_b;
  return fmt::format("{} and {}", one.run.camera_a, one.run.camera_b);
}

auto keyOf(const LoggedTrait& one) {
  return std::tuple{one.trait.what,       one.trait.trait.name, one.trait.trait.unit, one.trait.of,
                    camerasOf(one), one.run.plan,         one.run.is_locked};
}

std::string titleOf(const LoggedTrait& one) {
  const compare::Trait& trait = one.trait.trait;
  return fmt::format("{}: {} [{}], {} {}, plan \"{}\"{}", one.trait.what, trait.name, trait.unit, one.trait.of,
                     camerasOf(one), one.run.plan, one.run.is_locked ? ", locked captures" : "");
}

TrendRow heldAgainst(const LoggedTrait& first, const LoggedTrait& now, double wider) {
  const auto change = compare::differenceOf(first.trait.trait, now.trait.trait, wider);
  return {.at = now, .change = change.value, .low = change.low, .high = change.high};
}

}  // namespace

std::vector<TrendSeries> trendsOf(const std::vector<LoggedTrait>& traits) {
  std::map<decltype(keyOf(traits.front())), std::vector<const LoggedTrait*>> series;
  for (const LoggedTrait& one : traits) series[keyOf(one)].push_back(&one);
  const double wider = compare::widenedFor(traits.size() - series.size());
  std::vector<TrendSeries> all;
  for (auto& [key, numbers] : series) {
    std::ranges::stable_sort(numbers, {}, [](const LoggedTrait* one) { return one->run.began; });
    TrendSeries& now = all.emplace_back(TrendSeries{.title = titleOf(*numbers.front())});
    for (const LoggedTrait* one : numbers) {
      now.rows.push_back(heldAgainst(*numbers.front(), *one, wider));
      now.rows.back().is_first = one == numbers.front();
    }
  }
  return all;
}

}  // namespace toftwin::plan
