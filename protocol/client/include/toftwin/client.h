// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/facade_state.h>
#include <toftwin/frame.h>
#include <toftwin/parameter.h>
#include <toftwin/result.h>

namespace toftwin {

/// One source of a daemon, as `Client::sources` lists it.
struct SourceEntry {
  std::string name;
  std::string model;
  std::string serial;
  FrameKind kind = FrameKind::Real;
  bool streaming = false;
  std::string problem{};  ///< why the camera is not there now; empty: it is
};

/// All that a daemon says of one source.
struct SourceDetails {
  SourceEntry entry;
  std::string driver;
  CameraInfo camera;
  std::vector<PlaneKind> planes;
  std::optional<Duration> frame_interval;
  bool can_set_pose = false;
  bool can_trigger = false;
  bool can_lockstep = false;
  std::vector<Parameter> parameters;  ///< what setParameter takes, as it is now
  std::optional<Transform<World, Camera>> world_from_camera;  ///< that setPose sets, if it can
};

/// What a subscriber wants. The defaults: all planes, whole image, every frame, only the newest kept.
struct SubscribeOptions {
  enum class Policy : std::uint8_t { Latest = 0, Queue = 1, Lossless = 2, Lockstep = 3 };
  std::vector<PlaneKind> planes{};  ///< empty: all
  std::uint32_t x = 0, y = 0, width = 0, height = 0;  ///< region; width 0: whole image
  std::uint32_t decimation = 1;
  double max_rate_hz = 0.0;  ///< 0: every frame
  Policy policy = Policy::Latest;
  std::uint32_t queue = 4;  ///< frames that may wait, for Policy::Queue
};

struct SourceHealthEntry {
  std::string name;
  bool streaming = false;
  std::uint64_t frames = 0;
  std::uint64_t dropped_by_device = 0;
  std::uint32_t subscribers = 0;
  std::uint32_t reconnects = 0;
  std::string last_error;
  std::string lockstep_by{};   ///< for people: who holds it in lockstep; empty: nobody, or not told
  std::string recording_by{};  ///< for people: whose recording is being made; likewise
};
/// A language in which the daemon shows a source to programs that know nothing of toftwin.
struct FacadeHealthEntry {
  std::string kind;
  std::string source;
  std::string place;  ///< where clients find it, for people
  FacadeState state = FacadeState::Unknown;
  std::optional<std::uint32_t> clients;  ///< now; nothing: its language does not tell
  std::string problem;                   ///< why it is not there
};
struct DaemonHealth {
  std::string software;
  Duration uptime;
  std::uint32_t sessions = 0;
  std::vector<SourceHealthEntry> sources;
  std::vector<FacadeHealthEntry> facades;
};

/// A stream of frames. Ends when it is destroyed. Belongs to its Client and must not outlive it.
/// `next` may be called from one thread at a time, other than the Client's.
class Subscription {
 public:
  Subscription(Subscription&&) noexcept;
  Subscription& operator=(Subscription&&) noexcept;
  ~Subscription();

  /// Waits for the next frame. Errors: Timeout (ask again), EndOfStream, Overrun, Disconnected.
  /// Under Lockstep, asking for the next frame is what lets the daemon make it: a pose that was set
  /// before is the pose of that frame.
  Result<Frame> next(std::chrono::milliseconds timeout);

 private:
  friend class Client;
  struct State;
  explicit Subscription(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// A connection to a daemon. All calls may be made from any thread; each waits for its answer, at
/// most `timeout` of ClientOptions.
struct ClientOptions {
  std::chrono::milliseconds timeout{5000};
  std::uint64_t max_message_bytes = 256ull << 20;
  std::string token{};  ///< says who this is, where the daemon has roles; in clear text but over "tls:" and on this machine
  // Of "tls:", PEM files:
  std::string authorities{};  ///< whose daemons are trusted; empty: the system's
  std::string certificate{};  ///< of this client, where the daemon wants one; with its key
  std::string key{};
};

class Client {
 public:
  /// Address: "tcp:host:port", "unix:/path", "tls:host:port", or "host:port". Empty: the daemon's default Unix socket,
  /// then its default TCP port on loopback.
  static Result<Client> connect(std::string_view address = {}, ClientOptions options = {});
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  Result<std::vector<SourceEntry>> sources();
  Result<SourceDetails> describe(std::string_view source);
  Result<Subscription> subscribe(std::string_view source, SubscribeOptions options = {});
  Result<> setPose(std::string_view source, const Transform<World, Camera>& world_from_camera);
  Result<> setParameter(std::string_view source, std::string_view name, double value);
  /// Of a parameter that has a text; of one with choices, one of these.
  Result<> setParameter(std::string_view source, std::string_view name, std::string_view text);
  Result<> trigger(std::string_view source);
  /// Records on the daemon's side, into its recording folder; gives the path there.
  Result<std::string> startRecording(std::string_view source, std::string_view file_name);
  Result<std::string> stopRecording(std::string_view source);
  Result<DaemonHealth> health();

 private:
  struct State;
  explicit Client(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;  // shared with its subscriptions and the reading thread
};

/// Where a daemon listens unless told otherwise.
inline constexpr std::uint16_t kDefaultPort = 47800;
/// $RUNTIME_DIRECTORY, /run/toftwin, or $XDG_RUNTIME_DIR, whichever is there, + "/toftwin.sock".
std::string defaultSocketPath();

}  // namespace toftwin
