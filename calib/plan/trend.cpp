// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/trend.h"

#include <algorithm>
#include <map>
#include <tuple>

#include <fmt/format.h>

#include "calib/compare/traits/difference.h"

namespace toftwin::plan {
namespace {

std::string camerasOf(const std::string& of, const LoggedRun& run) {
  if (of == "A") return run.camera_a;
  if (of == "B") return run.camera_b;
  return fmt::format("{} and {}", run.camera_a, run.camera_b);
}

bool isOfTheSame(const LoggedRun& run, const LoggedTrait& one) {
  return run.plan == one.run.plan && run.is_locked == one.run.is_locked &&
         camerasOf(one.trait.of, run) == camerasOf(one.trait.of, one.run);
}

auto keyOf(const LoggedTrait& one) {
  return std::tuple{one.trait.what,       one.trait.trait.name, one.trait.trait.unit, one.trait.of,
                    camerasOf(one.trait.of, one.run), one.run.plan, one.run.is_locked};
}

std::string titleOf(const LoggedTrait& one) {
  const compare::Trait& trait = one.trait.trait;
  return fmt::format("{}: {} [{}], {} {}, plan \"{}\"{}", one.trait.what, trait.name, trait.unit, one.trait.of,
                     camerasOf(one.trait.of, one.run), one.run.plan, one.run.is_locked ? ", locked captures" : "");
}

/// Of parts of a noise law, whose signal is that: its details; empty: of none, or not known, as of an older log.
std::string signalOf(const TrendRow& row) {
  std::string details = compare::withoutDoubt(row.at.trait.detail);
  return details.starts_with(compare::kAtSignalOf) ? details : "";
}

/// Rows by when their runs began, and which of them is the first.
TrendSeries seriesOf(const std::vector<const LoggedTrait*>& numbers, const std::vector<LoggedRun>& runs) {
  TrendSeries series{.title = titleOf(*numbers.front())};
  for (const LoggedTrait* one : numbers) series.rows.push_back({.at = *one});
  for (const LoggedRun& run : runs) {
    const bool is_told = std::ranges::any_of(numbers, [&](const auto* one) { return one->run.id == run.id; });
    if (!is_told && isOfTheSame(run, *numbers.front())) series.rows.push_back({.at = {.run = run}, .is_told = false});
  }
  std::ranges::stable_sort(series.rows, {}, [](const TrendRow& row) { return row.at.run.began; });
  const auto isInDoubt = [](const TrendRow& row) { return compare::isInDoubt(row.at.trait.detail); };
  const auto isWhole = [](const TrendRow& row) {
    return row.is_told && !row.at.run.isUnfinished() && !row.at.run.isOfOneCamera();
  };
  auto first = std::ranges::find_if(series.rows, [&](const TrendRow& row) { return isWhole(row) && !isInDoubt(row); });
  if (first == series.rows.end()) first = std::ranges::find_if(series.rows, isWhole);
  if (first == series.rows.end()) first = std::ranges::find(series.rows, true, &TrendRow::is_told);
  first->is_first = true;
  const bool is_first_in_doubt = isInDoubt(*first), is_first_of_one = first->at.run.isOfOneCamera();
  const std::string signal = signalOf(*first);
  for (TrendRow& row : series.rows) {
    row.is_first_of_one_camera = is_first_of_one, row.first_planned = first->at.run.planned;
    const std::string own = row.is_told ? signalOf(row) : "";
    row.is_of_another_signal = !own.empty() && !signal.empty() && own != signal;
  }
  for (TrendRow& row : series.rows) row.is_in_doubt = row.is_told && (is_first_in_doubt || isInDoubt(row));
  return series;
}

void holdAgainstFirst(TrendSeries& series, double wider) {
  const compare::Trait first = std::ranges::find(series.rows, true, &TrendRow::is_first)->at.trait.trait;
  for (TrendRow& row : series.rows) {
    if (!row.is_told) continue;
    const auto change = compare::differenceOf(first, row.at.trait.trait, wider);
    row.change = change.value, row.low = change.low, row.high = change.high;
  }
}

}  // namespace

std::vector<TrendSeries> trendsOf(const std::vector<LoggedTrait>& traits, const std::vector<LoggedRun>& runs) {
  std::map<decltype(keyOf(traits.front())), std::vector<const LoggedTrait*>> numbers;
  for (const LoggedTrait& one : traits) numbers[keyOf(one)].push_back(&one);
  std::vector<TrendSeries> all;
  std::size_t judged = 0;
  for (const auto& [key, of_key] : numbers) {
    all.push_back(seriesOf(of_key, runs));
    judged += static_cast<std::size_t>(std::ranges::count_if(all.back().rows, &TrendRow::isJudged));
  }
  for (TrendSeries& series : all) holdAgainstFirst(series, compare::widenedFor(judged));
  return all;
}

}  // namespace toftwin::plan
