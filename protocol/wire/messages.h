// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <toftwin/facade_state.h>
#include <toftwin/frame.h>
#include <toftwin/parameter.h>
#include <toftwin/result.h>

/// The messages of the protocol as values; docs/protocol.md says what each means. Every request
/// carries an `id` that its answer repeats. Frames and pushed messages have none.
namespace toftwin::wire {

inline constexpr std::uint16_t kVersionMajor = 1;
inline constexpr std::uint16_t kVersionMinor = 4;

/// Peers of an older minor version know parameters that are numbers, and no others.
inline constexpr std::uint16_t kFirstMinorWithTexts = 3;
/// Peers of an older minor version know no KeepAlive: their silence says nothing.
inline constexpr std::uint16_t kFirstMinorWithKeepAlive = 4;

/// The last kind of plane that a peer of this minor version knows: others must not be sent to it.
constexpr PlaneKind lastPlaneKindOf(std::uint16_t minor) {
  return minor < 2 ? PlaneKind::Color : kLastPlaneKind;
}

/// The first message of either side.
struct Hello {
  std::uint64_t id = 0;
  std::string software;               ///< "toftwind 0.1.0"
  std::vector<std::string> features;  ///< optional parts of the protocol that this side speaks
  std::uint16_t minor = kVersionMinor;  ///< of the sender, from the preamble; written, it is this side's
  std::string token{};                  ///< a client's: says who it is; empty: it has none
  std::optional<Duration> idle{};       ///< a daemon's: whoever is silent for so long is let go
};

struct ListSources { std::uint64_t id = 0; };

/// One line of the answer to ListSources.
struct SourceSummary {
  std::string name;
  std::string model;
  std::string serial;
  FrameKind kind = FrameKind::Real;
  bool streaming = false;
  std::string problem{};  ///< why the camera is not there now; empty: it is
};
struct SourceList { std::uint64_t id = 0; std::vector<SourceSummary> sources; };

struct DescribeSource { std::uint64_t id = 0; std::string source; };
struct SourceDescription {
  std::uint64_t id = 0;
  SourceSummary summary;
  std::string driver;
  CameraInfo camera;
  std::vector<PlaneKind> planes;
  std::optional<Duration> frame_interval;
  bool can_set_pose = false;
  bool can_trigger = false;
  bool can_lockstep = false;
  std::vector<Parameter> parameters;
  std::optional<Transform<World, Camera>> world_from_camera;  ///< that was set, if it can be set
};

/// What happens when a subscriber is slower than the source. On the wire as a byte.
enum class Policy : std::uint8_t {
  Latest = 0,    ///< only the newest frame waits; older ones are dropped and counted
  Queue = 1,     ///< up to `queue` frames wait, then the oldest is dropped and counted
  Lossless = 2,  ///< every frame, or the subscription ends with Overrun at the daemon's limit
  Lockstep = 3,  ///< the next frame is made only when all lockstep subscribers acknowledged the last
};

/// A rectangle of pixels; width 0 stands for the whole image.
struct Region {
  std::uint32_t x = 0, y = 0, width = 0, height = 0;
  bool operator==(const Region&) const = default;
};

struct Subscribe {
  std::uint64_t id = 0;
  std::string source{};
  std::vector<PlaneKind> planes{};  ///< empty: all
  Region region{};
  std::uint32_t decimation = 1;   ///< every n-th pixel in x and y, from the region's top left
  double max_rate_hz = 0.0;       ///< 0: every frame; frames left out for the rate are not "dropped"
  Policy policy = Policy::Latest;
  std::uint32_t queue = 0;        ///< for Policy::Queue
  /// How many frames may be sent but not yet acknowledged; what is beyond that waits in the daemon as
  /// the policy says, not in socket buffers. 0: no limit, and only Lockstep acknowledges. Bodies come
  /// in shared memory only for subscriptions with a window.
  std::uint32_t window = 0;
};
struct Subscribed { std::uint64_t id = 0; std::uint64_t subscription = 0; };
struct Unsubscribe { std::uint64_t id = 0; std::uint64_t subscription = 0; };

/// One frame of a subscription.
struct FrameMessage { std::uint64_t subscription = 0; Frame frame; };
/// This side has taken the frame with that sequence, and all before it. Sent for every frame of a
/// subscription that is Lockstep or has a window.
struct Acknowledge { std::uint64_t subscription = 0; std::uint64_t sequence = 0; };
/// The daemon ends a subscription, with the reason (EndOfStream, Overrun, Disconnected …).
struct SubscriptionEnded { std::uint64_t subscription = 0; Error reason; };

struct SetPose { std::uint64_t id = 0; std::string source; Transform<World, Camera> world_from_camera; };
struct SetParameter {
  std::uint64_t id = 0;
  std::string source, name;
  double value = 0.0;
  std::optional<std::string> text{};  ///< in place of the value
};
struct Trigger { std::uint64_t id = 0; std::string source; };
/// Starts (or, with an empty path, stops) recording a source on the daemon's machine, into the
/// daemon's recording folder: `file` is a bare name, never a path.
struct Record { std::uint64_t id = 0; std::string source; std::string file; };
/// The answer to requests that have nothing else to say.
struct Done { std::uint64_t id = 0; std::string detail; };

struct AskHealth { std::uint64_t id = 0; };
struct SourceHealth {
  std::string name;
  bool streaming = false;
  std::uint64_t frames = 0;
  std::uint64_t dropped_by_device = 0;
  std::uint32_t subscribers = 0;
  std::uint32_t reconnects = 0;
  std::string last_error;
  std::string lockstep_by{};   ///< for people: who holds the source in lockstep; empty: nobody
  std::string recording_by{};  ///< for people: whose recording it is being made; empty: nobody's
};
struct FacadeHealth {
  std::string kind;
  std::string source;
  std::string place;  ///< for people
  FacadeState state = FacadeState::Unknown;
  std::optional<std::uint32_t> clients{};  ///< nothing: not known
  std::string problem{};
};
struct Health {
  std::uint64_t id = 0;
  Duration uptime;
  std::uint32_t sessions = 0;
  std::vector<SourceHealth> sources;
  std::vector<FacadeHealth> facades{};
};

/// A request failed (`id` of the request) or bytes could not be understood (`id` 0; the connection
/// is closed after it).
struct Failure { std::uint64_t id = 0; Error error; };

/// A client that has nothing else to say is still there. No answer.
struct KeepAlive {};

using Message = std::variant<Hello, ListSources, SourceList, DescribeSource, SourceDescription, Subscribe,
                             Subscribed, Unsubscribe, FrameMessage, Acknowledge, SubscriptionEnded,
                             SetPose, SetParameter, Trigger, Record, Done, AskHealth, Health, Failure,
                             KeepAlive>;

}  // namespace toftwin::wire
