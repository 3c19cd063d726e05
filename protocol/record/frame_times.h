// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <toftwin/frame.h>

/// How much time passes in a recording. Two clocks tell it: the device's, in each frame's exposures, and the
/// host's, when the frame was received. Either may be set, or begin anew, while it is recorded.
namespace toftwin::record {

struct FrameTimes {
  std::optional<std::int64_t> device_ns;  ///< start of the first exposure; none if the frame does not say it
  std::int64_t received_ns = 0;

  static FrameTimes of(const Frame& frame);
};

enum class Jumped { Neither, Host, Device };

/// From a frame to the next one of its source.
struct FrameStep {
  std::int64_t elapsed_ns = 0;  ///< what passed; not negative
  Jumped jumped = Jumped::Neither;
  std::int64_t by_ns = 0;  ///< how much more (or less) than that the clock that jumped says
};

/// The device's clock is believed where it goes on, by less than ten minutes or as far as the host's does. Where it
/// does not, the host's is, up to thirty days; where neither goes on, `usual_ns` has passed. Clocks that differ by
/// more than a second and a twentieth of what passed have jumped apart. Sums stop at what can be expressed.
FrameStep stepBetween(const FrameTimes& before, const FrameTimes& now, std::int64_t usual_ns);

struct ClockJump {
  std::size_t frame = 0;  ///< the first after it, counted from 0
  Jumped clock = Jumped::Host;
  std::int64_t by_ns = 0;
  std::int64_t from_ns = 0, to_ns = 0;  ///< what that clock said before and after
};

/// What the frames of one source tell, in their order.
struct RecordedTime {
  std::int64_t length_ns = 0;         ///< from the first to the last
  std::int64_t longest_gap_ns = 0;    ///< between two frames
  std::vector<ClockJump> jumps;       ///< those after which the clocks stay apart: a delay on the way is none
};
RecordedTime recordedTime(std::span<const FrameTimes> frames);

}  // namespace toftwin::record
