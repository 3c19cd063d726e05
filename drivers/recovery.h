// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "drivers/pace.h"
#include "drivers/source.h"

namespace toftwin::drivers {

/// What becomes of a camera that is lost and comes back; the same for all drivers. It is told what
/// happens to the source and says what to do; it calls nobody and waits for nothing.
///
///            opened                      lost, hung
///   Absent ─────────► Present  ─────────────────────────► Absent
///     │  ▲               │ frame: counts what the gap cost
///     └──┘ openFailed    └ settings that a client changed are set again
///   (later, and later)
class Recovery {
 public:
  struct Options {
    std::chrono::milliseconds first_retry{100};
    std::chrono::milliseconds longest_retry{250};  ///< so that a camera is back within a second
    std::chrono::milliseconds hung_after{3000};  ///< without a frame, in free run; or ten intervals
  };
  explicit Recovery(Options options) : options_(options), retry_after_(options.first_retry) {}

  [[nodiscard]] bool isPresent() const { return is_present_; }
  /// When to open it next, if it is absent.
  [[nodiscard]] SteadyTime retryAt() const { return retry_at_; }

  void opened(const SourceInfo& info, const SourceState& state);
  void openFailed(SteadyTime now);
  /// Frames are wanted from now on, or no longer: what is lost then costs nobody a frame.
  void started(SteadyTime now) { waiting_since_ = now; }
  void unwanted() {
    waiting_since_ = gap_since_ = std::nullopt;
    gap_because_.clear();
  }
  /// A command is done: what has changed is remembered, to be set again when the camera comes back.
  void changed(const SourceState& state);
  /// What to set on the camera that has just been opened again.
  struct Restore {
    std::vector<Parameter> parameters;
    std::optional<Transform<World, Camera>> world_from_camera;
  };
  [[nodiscard]] Restore settings() const;

  /// Fills in what the frame says of a gap before it, and why there is one, and keeps a real camera's device time
  /// increasing if its clock began anew.
  void frame(Frame& frame, SteadyTime now);
  /// The driver waited in vain. An error if the camera must have come to a standstill: it is lost.
  [[nodiscard]] std::optional<Error> timedOut(SteadyTime now) const;
  /// `why`, in words, is for the first frame that comes again.
  void lost(SteadyTime now, std::string_view why);

 private:
  void retryLater(SteadyTime now);
  [[nodiscard]] std::int64_t shiftStillDue(std::int64_t advance_ns);
  [[nodiscard]] std::uint64_t framesWithin(std::chrono::nanoseconds time) const;

  Options options_;
  bool is_present_ = false;
  SteadyTime retry_at_{};
  std::chrono::milliseconds retry_after_;

  std::optional<SourceInfo> info_;
  SourceState state_;
  std::map<std::string, Parameter> set_;  ///< what clients changed since the first opening
  std::optional<Transform<World, Camera>> pose_;

  std::optional<SteadyTime> gap_since_;
  std::string gap_because_;  ///< the first loss of it, whatever keeps the camera away after that
  std::optional<SteadyTime> last_frame_;
  std::optional<SteadyTime> waiting_since_;  ///< since the start or the last frame; none: stopped
  std::optional<DeviceTime> last_device_time_;
  bool is_shift_ending_ = false;
  std::optional<std::int64_t> device_shift_ns_;  ///< decided by the first frame after an opening; never grows
};

}  // namespace toftwin::drivers
