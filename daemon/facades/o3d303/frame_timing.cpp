// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/frame_timing.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/facades/o3d303/exposure_time.h"
#include "daemon/faults.h"

namespace toftwin::daemon::o3d303 {
namespace {

constexpr std::int64_t kHurried_ns = 40'000'000, kAtLeisure_ns = 50'000'000;  // asked intervals

/// Quantiles of a frame's distance from an even grid (a running median of 21), in ms.
constexpr std::array kShares{0.0, 0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 1.0};
using Quantiles = std::array<double, kShares.size()>;
constexpr Quantiles kHurried_ms{-4.4, -3.4, -2.0, -1.5, -0.6, 0.0, 0.9, 3.2, 4.4, 6.2, 9.5};
/// Of the five runs from 50 ms on.
constexpr Quantiles kAtLeisure_ms{-1.6, -1.0, -0.7, -0.44, -0.12, 0.0, 0.1, 0.36, 0.57, 1.1, 2.2};

double quantileOf(const Quantiles& quantiles, double share) {
  std::size_t i = 1;
  while (i + 1 < kShares.size() && kShares[i] < share) ++i;
  return std::lerp(quantiles[i - 1], quantiles[i], (share - kShares[i - 1]) / (kShares[i] - kShares[i - 1]));
}

Duration jitterOf(std::uint64_t frame, std::int64_t asked_ns) {
  constexpr std::uint64_t kOfTiming = 0x03D3;
  const double share = static_cast<double>(faultBits(0, kOfTiming, frame, 0) >> 11U) * 0x1p-53;
  const double leisure = std::clamp(
      static_cast<double>(asked_ns - kHurried_ns) / static_cast<double>(kAtLeisure_ns - kHurried_ns), 0.0,
      1.0);
  return std::lerp(quantileOf(kHurried_ms, share), quantileOf(kAtLeisure_ms, share), leisure) * millisecond;
}

std::int64_t nanosecondsOf(Duration time) { return std::llround(time.in(nanosecond)); }

}  // namespace

std::optional<Duration> FrameTiming::next(DeviceTime began, const Setting& setting) {
  if (offered_ && began.ns <= offered_->ns) *this = {};
  const std::int64_t asked_ns = offered_ ? began.ns - offered_->ns : kAtLeisure_ns;
  offered_ = began;
  // With the exposures done it waits in the first stage for the second.
  if (busy_ && began.ns < busy_->exposing_until_ns) return std::nullopt;
  const std::int64_t exposed_ns =
      began.ns + nanosecondsOf(exposuresTake(setting.frequencies, setting.exposures_us));
  const std::int64_t goes_on_ns = busy_ ? std::max(exposed_ns, busy_->processing_until_ns) : exposed_ns;
  const std::int64_t leaves_ns = goes_on_ns + nanosecondsOf(kProcessing + jitterOf(taken_++, asked_ns));
  busy_ = Stages{goes_on_ns, leaves_ns};
  return static_cast<double>(leaves_ns - began.ns) * nanosecond;
}

}  // namespace toftwin::daemon::o3d303
