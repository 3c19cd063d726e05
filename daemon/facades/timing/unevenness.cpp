// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/timing/unevenness.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <numeric>

namespace toftwin::daemon {

/// Frame i left at the sum of the intervals before it, evenly spaced ones leave at i times their mean; the
/// earliest against that is held back by nothing.
Unevenness::Unevenness(const std::vector<Time>& intervals) {
  const Time round = std::accumulate(intervals.begin(), intervals.end(), Time{0});
  const auto count = static_cast<std::int64_t>(intervals.size());
  Time leaves{0};
  for (std::int64_t i = 0; i < count; ++i) {
    delays_.push_back(leaves - round * i / count);
    leaves += intervals[static_cast<std::size_t>(i)];
  }
  if (delays_.empty()) return;
  const Time earliest = *std::ranges::min_element(delays_);
  for (Time& delay : delays_) delay -= earliest;
}

Result<Unevenness> Unevenness::load(const std::filesystem::path& file) {
  constexpr double kLongest_ms = 600'000.0;
  constexpr std::size_t kMost = 1'000'000;
  std::ifstream in{file};
  if (!in) return Error{Error::Code::NotFound, fmt::format("{} cannot be read", file.string())};
  std::vector<Time> intervals;
  double ms = 0.0;
  while (intervals.size() < kMost && in >> ms) {
    if (!(ms > 0.0 && ms < kLongest_ms)) {
      return Error{Error::Code::InvalidArgument, fmt::format("{}: number {} is no interval in milliseconds",
                                                             file.string(), intervals.size() + 1)};
    }
    intervals.emplace_back(static_cast<std::int64_t>(ms * 1e6));
  }
  if (intervals.empty() || !in.eof()) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("{} must have one interval in milliseconds per line, and nothing else", file.string())};
  }
  return Unevenness{intervals};
}

Unevenness Unevenness::read(settings::Table& table, const std::string& intervals) {
  if (intervals.empty()) return {};
  auto loaded = load(table.resolve(intervals));
  if (loaded) return *std::move(loaded);
  table.complain("intervals", "= " + loaded.error().message);
  return {};
}

}  // namespace toftwin::daemon
