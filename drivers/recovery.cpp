// SPDX-License-Identifier: Apache-2.0
#include "drivers/recovery.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace toftwin::drivers {

using std::chrono::duration_cast;
using std::chrono::nanoseconds;

void Recovery::opened(const SourceInfo& info, const SourceState& state) {
  is_present_ = true;
  info_ = info;
  state_ = state;
  device_shift_ns_.reset();
  is_shift_ending_ = false;
}

void Recovery::openFailed(SteadyTime now) {
  is_present_ = false;
  retryLater(now);
}

void Recovery::changed(const SourceState& state) {
  // The driver's order is that of info(), so that equal places are equal parameters.
  for (std::size_t i = 0; i < std::min(state.parameters.size(), state_.parameters.size()); ++i) {
    const Parameter &now = state.parameters[i], &before = state_.parameters[i];
    const bool is_other = (now.value && now.value != before.value) || (now.text && now.text != before.text);
    if (is_other) set_[now.name] = now;
  }
  if (info_ && info_->can_set_pose && state.world_from_camera &&
      state.world_from_camera != state_.world_from_camera) {
    pose_ = state.world_from_camera;
  }
  state_ = state;
}

Recovery::Restore Recovery::settings() const {
  Restore restore{.parameters = {}, .world_from_camera = pose_};
  for (const Parameter& now : state_.parameters) {
    const auto found = set_.find(now.name);
    if (found == set_.end() || (found->second.value == now.value && found->second.text == now.text)) continue;
    restore.parameters.push_back(found->second);
    restore.parameters.back().bounds = now.bounds;
  }
  return restore;
}

void Recovery::frame(Frame& frame, SteadyTime now) {
  retry_after_ = options_.first_retry;
  if (gap_since_) {
    frame.dropped_by_device = std::max(frame.dropped_by_device, framesWithin(now - *gap_since_));
    if (!frame.dropped_because.empty()) gap_because_ += ", then " + frame.dropped_because;
    frame.dropped_because = std::exchange(gap_because_, {});
    gap_since_.reset();
  }
  if (frame.provenance.kind == FrameKind::Real && !frame.moment.exposures.empty()) {
    auto& exposures = frame.moment.exposures;
    const std::int64_t start_ns = exposures.front().start.ns;
    if (!device_shift_ns_) {
      device_shift_ns_ = 0;
      if (last_device_time_ && start_ns <= last_device_time_->ns) {
        const nanoseconds since = now - last_frame_.value_or(now);
        device_shift_ns_ = last_device_time_->ns + std::max<std::int64_t>(1, since.count()) - start_ns;
      }
    } else {
      device_shift_ns_ = shiftStillDue(start_ns + *device_shift_ns_ - last_device_time_->ns);
    }
    for (Exposure& exposure : exposures) exposure.start.ns += *device_shift_ns_;
    frame.moment.clock.host_minus_device_ns -= *device_shift_ns_;
    last_device_time_ = exposures.back().start;
  }
  last_frame_ = waiting_since_ = now;
}

/// A clock that follows a master begins anew with the camera and is set to the master's time some seconds
/// later. Then the frame continues the last one better without the shift, and `advance_ns`, its time since
/// then with the shift, is absurd. What is left, for the shift was as exact as a frame's arrival, goes at
/// half the speed of time.
std::int64_t Recovery::shiftStillDue(std::int64_t advance_ns) {
  const std::int64_t shift_ns = *device_shift_ns_;
  if (shift_ns == 0 || advance_ns <= 0) return shift_ns;
  if (is_shift_ending_) return std::max<std::int64_t>(0, shift_ns - advance_ns / 2);
  is_shift_ending_ = std::abs(advance_ns - shift_ns) < advance_ns;
  return is_shift_ending_ ? std::max<std::int64_t>(0, shift_ns - advance_ns + 1) : shift_ns;
}

std::optional<Error> Recovery::timedOut(SteadyTime now) const {
  const bool comes_by_itself = info_ && info_->kind == FrameKind::Real && info_->frame_interval &&
                               !info_->can_trigger && !info_->can_lockstep;
  if (!comes_by_itself || !waiting_since_) return std::nullopt;
  const nanoseconds ten_intervals{std::llround(10.0 * info_->frame_interval->in(nanosecond))};
  const nanoseconds silence = now - *waiting_since_;
  if (silence < std::max<nanoseconds>(options_.hung_after, ten_intervals)) return std::nullopt;
  return Error{Error::Code::Disconnected,
               fmt::format("{} hangs: no frame for {} ms, and no error either", info_->model,
                           duration_cast<std::chrono::milliseconds>(silence).count())};
}

void Recovery::lost(SteadyTime now, std::string_view why) {
  is_present_ = false;
  if (waiting_since_ && !gap_since_) {
    gap_since_ = waiting_since_;
    gap_because_ = why;
  }
  waiting_since_.reset();
  retryLater(now);
}

void Recovery::retryLater(SteadyTime now) {
  retry_at_ = now + retry_after_;
  retry_after_ = std::min(2 * retry_after_, options_.longest_retry);
}

/// That a camera takes between two that are so far apart. None if it does not take them by itself.
std::uint64_t Recovery::framesWithin(nanoseconds time) const {
  if (!info_ || !info_->frame_interval || info_->can_trigger) return 0;
  const double intervals =
      static_cast<double>(time.count()) / info_->frame_interval->in(nanosecond);
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, std::llround(intervals) - 1));
}

}  // namespace toftwin::drivers
