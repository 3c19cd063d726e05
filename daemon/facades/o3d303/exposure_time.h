// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <numeric>
#include <span>

#include <toftwin/units.h>

namespace toftwin::daemon::o3d303 {

/// For how long the camera is busy with the exposures of a frame, of which 1 / MaxAllowedLEDFrameRate is to
/// be made. All six published configurations [1], with up to two frequencies and two exposures, have it to
/// their last digit:
///   busy = 2 ms + 8 f Σ t       f: frequencies, t: the different exposure times
///
/// [1] lovepark/libo3d3xx, modules/oem/doc/data; ifm/ifm3d, doc/jitter
inline Duration exposuresTake(int frequencies, std::span<const std::uint32_t> exposures_us) {
  const double sum_us = std::accumulate(exposures_us.begin(), exposures_us.end(), 0.0);
  return 2_ms + 8.0 * frequencies * (sum_us * microsecond);
}

/// The longest exposure with which a frame takes no longer than that: `sum` is that of all exposure times in
/// units of the longest.
inline Duration longestExposure(int frequencies, double sum, Duration frame_interval) {
  return (frame_interval - 2_ms) / (8.0 * frequencies * sum);
}

}  // namespace toftwin::daemon::o3d303
