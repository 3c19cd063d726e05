// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <toftwin/clock.h>
#include <toftwin/units.h>

namespace toftwin::daemon::o3d303 {

/// When a real O3D303's frames leave, by how it is set. Two stages, of which the second works on a frame
/// while the first has the next; the asked interval is the time between two frames that are offered:
///   exposures    begin with a frame that is offered, unless the frame before has not gone on to
///                processing: then this one is left out. How long they take: exposure_time.h
///   processing   35.8 ms + jitter, then the frame leaves
/// The mean processing time is fitted to the two runs of [1] in which the camera did not keep up. The jitter
/// is how far frames were from an even grid in the runs in which it did: at 40 ms it had little time to
/// spare, from 50 ms on it had enough. docs/facades/o3d303.md has what is left against [1].
///
/// [1] lovepark/libo3d3xx, modules/oem/doc/data: a thousand intervals of an O3D303 (firmware 1.8.904) each
class FrameTiming {
 public:
  /// What processing takes in the mean.
  static constexpr Duration kProcessing = 35.8_ms;
  /// How the frame is exposed.
  struct Setting {
    int frequencies = 1;
    std::span<const std::uint32_t> exposures_us;  ///< the different ones
  };
  /// By how much later than its first exposure began the frame leaves; nothing: the camera was busy and did
  /// not take it. A beginning before the last one's is another camera's.
  std::optional<Duration> next(DeviceTime began, const Setting& setting);

 private:
  struct Stages {
    std::int64_t exposing_until_ns, processing_until_ns;
  };
  std::optional<DeviceTime> offered_;  ///< the last one
  std::optional<Stages> busy_;
  std::uint64_t taken_ = 0;  ///< keys the jitter
};

}  // namespace toftwin::daemon::o3d303
