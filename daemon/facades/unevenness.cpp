// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/unevenness.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>

#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

/// Of a frame, with what it has beside its planes, rounded up.
std::uint64_t bytesOf(const Frame& frame) {
  std::uint64_t bytes = 4096;
  for (const Plane& plane : frame.planes) bytes += plane.data.size();
  return bytes;
}

}  // namespace

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

UnevenFrames::UnevenFrames(boost::asio::io_context& io, std::string name, Unevenness unevenness,
                           Duration latency, Put put)
    : name_(std::move(name)),
      unevenness_(std::move(unevenness)),
      latency_(std::llround(latency.in(nanosecond))),
      put_(std::move(put)),
      timer_(io) {}

/// They may share memory with other subscribers, and are counted as if they did not.
void UnevenFrames::take(const Frame& frame) {
  if (unevenness_.isNone() && latency_.count() == 0) return put_(frame);
  const std::uint64_t bytes = bytesOf(frame);
  if (!held_.empty() && held_bytes_ + bytes > kMostHeldBytes) return noteLost();
  auto leaves = std::chrono::steady_clock::now() + latency_ + unevenness_.delay(taken_++);
  if (!held_.empty()) leaves = std::max(leaves, held_.back().leaves);
  held_.push_back({leaves, frame});
  held_bytes_ += bytes;
  if (held_.size() == 1) wait();
}

void UnevenFrames::wait() {
  timer_.expires_at(held_.front().leaves);
  timer_.async_wait([this](boost::system::error_code cancelled) {
    if (cancelled || held_.empty()) return;
    const Held next = std::move(held_.front());
    held_.pop_front();
    held_bytes_ -= bytesOf(next.frame);
    if (!held_.empty()) wait();
    put_(next.frame);
  });
}

void UnevenFrames::noteLost() {
  if (lost_++ > 0) return;
  logging::warn(
      "{}: {} MB of frames wait for their time, and those that come meanwhile are lost; make latency_ms less",
      name_, kMostHeldBytes >> 20U);
}

}  // namespace toftwin::daemon
