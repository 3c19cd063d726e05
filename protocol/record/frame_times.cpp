// SPDX-License-Identifier: Apache-2.0
#include "protocol/record/frame_times.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace toftwin::record {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kMostStep_ns = 600 * kSecond_ns;                  ///< that a device's clock alone is believed
constexpr std::int64_t kMostGap_ns = 30ll * 24 * 3600 * kSecond_ns;      ///< that a host's is, where the device's does not go on
constexpr std::size_t kFramesToSettle = 30;  ///< within which a delay on the way is made up for

std::int64_t minus(std::int64_t a, std::int64_t b) {
  std::int64_t difference = 0;
  if (!__builtin_sub_overflow(a, b, &difference)) return difference;
  return b < 0 ? std::numeric_limits<std::int64_t>::max() : std::numeric_limits<std::int64_t>::min();
}

std::int64_t plus(std::int64_t a, std::int64_t b) {
  std::int64_t sum = 0;
  return __builtin_add_overflow(a, b, &sum) ? std::numeric_limits<std::int64_t>::max() : sum;
}

bool agree(std::int64_t device_ns, std::int64_t host_ns) {
  const std::int64_t apart = minus(host_ns, device_ns), most = kSecond_ns + device_ns / 20;
  return apart <= most && apart >= -most;
}

/// Half of the steps that one clock makes are shorter.
std::int64_t usualStep(std::span<const FrameTimes> frames) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const bool has_device = frames[i].device_ns && frames[i - 1].device_ns;
    const std::int64_t step = has_device ? minus(*frames[i].device_ns, *frames[i - 1].device_ns)
                                         : minus(frames[i].received_ns, frames[i - 1].received_ns);
    if (step > 0 && step <= kMostStep_ns) steps.push_back(step);
  }
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Whether the clocks stay apart after frame i, as a set clock does and a delayed frame does not.
bool staysApart(std::span<const FrameTimes> frames, std::size_t i, std::int64_t by_ns) {
  const auto apart = [&](std::size_t k) { return minus(frames[k].received_ns, frames[k].device_ns.value_or(0)); };
  if (!frames[i].device_ns || !frames[i - 1].device_ns) return true;
  const std::int64_t later = minus(apart(std::min(i + kFramesToSettle, frames.size() - 1)), apart(i - 1));
  return std::abs(later / 2) >= std::abs(by_ns / 4);
}

}  // namespace

FrameTimes FrameTimes::of(const Frame& frame) {
  FrameTimes times{.device_ns = {}, .received_ns = frame.moment.received.ns};
  if (!frame.moment.exposures.empty()) times.device_ns = frame.moment.exposures.front().start.ns;
  return times;
}

FrameStep stepBetween(const FrameTimes& before, const FrameTimes& now, std::int64_t usual_ns) {
  const std::int64_t host = minus(now.received_ns, before.received_ns);
  const bool has_host = host >= 0 && host <= kMostGap_ns;
  if (!before.device_ns || !now.device_ns) {
    if (has_host) return {host};
    return {usual_ns, Jumped::Host, minus(host, usual_ns)};
  }
  const std::int64_t device = minus(*now.device_ns, *before.device_ns);
  if (device > 0 && device <= kMostGap_ns && agree(device, host)) return {device};
  if (device > 0 && device <= kMostStep_ns) return {device, Jumped::Host, minus(host, device)};
  if (has_host) return {host, Jumped::Device, minus(device, host)};
  return {usual_ns, Jumped::Device, minus(device, usual_ns)};
}

RecordedTime recordedTime(std::span<const FrameTimes> frames) {
  RecordedTime time;
  const std::int64_t usual_ns = usualStep(frames);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const FrameStep step = stepBetween(frames[i - 1], frames[i], usual_ns);
    time.length_ns = plus(time.length_ns, step.elapsed_ns);
    time.longest_gap_ns = std::max(time.longest_gap_ns, step.elapsed_ns);
    if (step.jumped == Jumped::Neither || !staysApart(frames, i, step.by_ns)) continue;
    const bool is_host = step.jumped == Jumped::Host;
    time.jumps.push_back({i, step.jumped, step.by_ns, is_host ? frames[i - 1].received_ns : frames[i - 1].device_ns.value_or(0),
                          is_host ? frames[i].received_ns : frames[i].device_ns.value_or(0)});
  }
  return time;
}

}  // namespace toftwin::record
