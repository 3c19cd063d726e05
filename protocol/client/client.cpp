// SPDX-License-Identifier: Apache-2.0
#include <toftwin/client.h>

#include <cmath>
#include <optional>
#include <utility>

#include "protocol/client/connection.h"
#include "protocol/transport/address.h"
#include "protocol/wire/bounds.h"

namespace toftwin {
namespace {

using client::Connection;

Result<> checkName(std::string_view what, std::string_view name) {
  if (name.size() <= wire::kMaxName) return {};
  return Error{Error::Code::InvalidArgument, "the " + std::string{what} + " has " +
                                                 std::to_string(name.size()) +
                                                 " bytes, at most 255 are allowed"};
}

SourceEntry toEntry(wire::SourceSummary summary) {
  return {std::move(summary.name), std::move(summary.model), std::move(summary.serial),
          summary.kind, summary.streaming, std::move(summary.problem)};
}

wire::Subscribe toRequest(std::string_view source, SubscribeOptions options) {
  return {.id = 0,
          .source = std::string{source},
          .planes = std::move(options.planes),
          .region = {options.x, options.y, options.width, options.height},
          .decimation = options.decimation,
          .max_rate_hz = options.max_rate_hz,
          .policy = static_cast<wire::Policy>(options.policy),
          .queue = options.queue};
}

Result<> checkOptions(const SubscribeOptions& options) {
  const auto invalid = [](const char* what) {
    return Error{Error::Code::InvalidArgument, std::string{"subscribe: "} + what};
  };
  if (options.decimation == 0) return invalid("decimation is 0, but 1 means every pixel");
  if (!std::isfinite(options.max_rate_hz) || options.max_rate_hz < 0.0) {
    return invalid("max_rate_hz is not a finite number of at least 0 (0 means every frame)");
  }
  if (options.policy == SubscribeOptions::Policy::Queue && options.queue == 0) {
    return invalid("a queue of 0 frames holds none; ask for at least 1");
  }
  if (options.planes.size() > wire::kMaxPlanes) return invalid("more than 64 planes");
  return {};
}

/// Tries the daemon's places in order; the last error counts.
Result<std::shared_ptr<Connection>> connectToDefault(const ClientOptions& options) {
  auto local = Connection::open(transport::UnixAddress{defaultSocketPath()}, options);
  if (local) return local;
  auto tcp = Connection::open(transport::TcpAddress{"127.0.0.1", kDefaultPort}, options);
  if (tcp) return tcp;
  return Error{tcp.error().code, local.error().message + "; " + tcp.error().message};
}

}  // namespace

// ---- Subscription
// ----------------------------------------------------------------------------------

struct Subscription::State {
  std::shared_ptr<Connection> connection;  // shared with the Client
  Connection::Subscribed subscribed;
  std::optional<std::uint64_t> to_acknowledge;  ///< Lockstep: taken, but the next was not asked for
  ~State() { connection->unsubscribe(subscribed.id); }
};

Subscription::Subscription(std::unique_ptr<State> state) : state_(std::move(state)) {}
Subscription::Subscription(Subscription&&) noexcept = default;
Subscription& Subscription::operator=(Subscription&&) noexcept = default;
Subscription::~Subscription() = default;

Result<Frame> Subscription::next(std::chrono::milliseconds timeout) {
  const auto& [id, frames] = state_->subscribed;
  // Under Lockstep the next frame is made only when it is asked for: what the application says
  // after it took a frame, such as a new pose, must hold for the next.
  if (auto last = std::exchange(state_->to_acknowledge, std::nullopt)) {
    state_->connection->acknowledge(id, *last);
  }
  Result<Frame> frame = frames->pop(timeout);
  if (!frame || frames->isAcknowledgedOnArrival()) return frame;
  if (frames->isLockstep()) {
    state_->to_acknowledge = frame->sequence;
  } else {
    state_->connection->acknowledge(id, frame->sequence);
  }
  return frame;
}

// ---- Client
// ----------------------------------------------------------------------------------------

struct Client::State {
  std::shared_ptr<Connection> connection;  // shared with the subscriptions
  ~State() { connection->stop(); }
};

Client::Client(std::shared_ptr<State> state) : state_(std::move(state)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

Result<Client> Client::connect(std::string_view address, ClientOptions options) {
  Result<std::shared_ptr<Connection>> connection{nullptr};
  if (address.empty()) {
    connection = connectToDefault(options);
  } else {
    const auto parsed = transport::parseAddress(address, kDefaultPort);
    if (!parsed) return parsed.error();
    connection = Connection::open(*parsed, options);
  }
  if (!connection) return connection.error();
  return Client{std::make_shared<State>(std::move(*connection))};
}

Result<std::vector<SourceEntry>> Client::sources() {
  auto answer = state_->connection->ask<wire::SourceList>(wire::ListSources{});
  if (!answer) return answer.error();
  std::vector<SourceEntry> entries;
  for (auto& summary : answer->sources) entries.push_back(toEntry(std::move(summary)));
  return entries;
}

Result<SourceDetails> Client::describe(std::string_view source) {
  if (auto checked = checkName("source's name", source); !checked) return checked.error();
  auto answer = state_->connection->ask<wire::SourceDescription>(
      wire::DescribeSource{0, std::string{source}});
  if (!answer) return answer.error();
  return SourceDetails{.entry = toEntry(std::move(answer->summary)),
                       .driver = std::move(answer->driver),
                       .camera = std::move(answer->camera),
                       .planes = std::move(answer->planes),
                       .frame_interval = answer->frame_interval,
                       .can_set_pose = answer->can_set_pose,
                       .can_trigger = answer->can_trigger,
                       .can_lockstep = answer->can_lockstep,
                       .parameters = std::move(answer->parameters),
                       .world_from_camera = answer->world_from_camera};
}

Result<Subscription> Client::subscribe(std::string_view source, SubscribeOptions options) {
  if (auto checked = checkName("source's name", source); !checked) return checked.error();
  if (auto checked = checkOptions(options); !checked) return checked.error();
  if (auto checked = state_->connection->checkKnown(options.planes); !checked) return checked.error();
  auto subscribed = state_->connection->subscribe(toRequest(source, std::move(options)));
  if (!subscribed) return subscribed.error();
  return Subscription{std::unique_ptr<Subscription::State>{
      new Subscription::State{state_->connection, std::move(*subscribed), std::nullopt}}};
}

Result<> Client::setPose(std::string_view source,
                         const Transform<World, Camera>& world_from_camera) {
  if (auto checked = checkName("source's name", source); !checked) return checked;
  const auto& [w, x, y, z] = world_from_camera.rotation_wxyz;
  const double length2 = w * w + x * x + y * y + z * z;
  if (!(std::abs(length2 - 1.0) <= 1e-6)) {  // also catches what is not a number
    return Error{Error::Code::InvalidArgument,
                 "setPose: the rotation is not a unit quaternion (w, x, y, z)"};
  }
  if (!std::isfinite(norm(world_from_camera.translation_m))) {
    return Error{Error::Code::InvalidArgument, "setPose: the translation is not finite"};
  }
  auto answer =
      state_->connection->ask<wire::Done>(wire::SetPose{0, std::string{source}, world_from_camera});
  if (!answer) return answer.error();
  return {};
}

Result<> Client::setParameter(std::string_view source, std::string_view name, double value) {
  if (auto checked = checkName("source's name", source); !checked) return checked;
  if (auto checked = checkName("parameter's name", name); !checked) return checked;
  if (!std::isfinite(value)) {
    return Error{Error::Code::InvalidArgument,
                 "the value of \"" + std::string{name} + "\" is not a finite number"};
  }
  auto answer = state_->connection->ask<wire::Done>(
      wire::SetParameter{0, std::string{source}, std::string{name}, value});
  if (!answer) return answer.error();
  return {};
}

Result<> Client::setParameter(std::string_view source, std::string_view name, std::string_view text) {
  if (auto checked = checkName("source's name", source); !checked) return checked;
  if (auto checked = checkName("parameter's name", name); !checked) return checked;
  if (text.size() > wire::kMaxText) {
    return Error{Error::Code::InvalidArgument, "the text for \"" + std::string{name} + "\" is longer than " +
                                                   std::to_string(wire::kMaxText) + " bytes"};
  }
  if (auto known = state_->connection->checkKnowsTexts(); !known) return known;
  auto answer = state_->connection->ask<wire::Done>(
      wire::SetParameter{0, std::string{source}, std::string{name}, 0.0, std::string{text}});
  if (!answer) return answer.error();
  return {};
}

Result<> Client::trigger(std::string_view source) {
  if (auto checked = checkName("source's name", source); !checked) return checked;
  auto answer = state_->connection->ask<wire::Done>(wire::Trigger{0, std::string{source}});
  if (!answer) return answer.error();
  return {};
}

Result<std::string> Client::startRecording(std::string_view source, std::string_view file_name) {
  if (file_name.empty()) {
    return Error{Error::Code::InvalidArgument, "startRecording: the file's name is missing"};
  }
  if (auto checked = checkName("source's name", source); !checked) return checked.error();
  if (auto checked = checkName("file's name", file_name); !checked) return checked.error();
  auto answer = state_->connection->ask<wire::Done>(
      wire::Record{0, std::string{source}, std::string{file_name}});
  if (!answer) return answer.error();
  return std::move(answer->detail);
}

Result<std::string> Client::stopRecording(std::string_view source) {
  if (auto checked = checkName("source's name", source); !checked) return checked.error();
  auto answer = state_->connection->ask<wire::Done>(wire::Record{0, std::string{source}, ""});
  if (!answer) return answer.error();
  return std::move(answer->detail);
}

Result<DaemonHealth> Client::health() {
  auto answer = state_->connection->ask<wire::Health>(wire::AskHealth{});
  if (!answer) return answer.error();
  DaemonHealth health{state_->connection->software(), answer->uptime, answer->sessions, {}, {}};
  for (auto& s : answer->sources) {
    health.sources.push_back({std::move(s.name), s.streaming, s.frames, s.dropped_by_device,
                              s.subscribers, s.reconnects, std::move(s.last_error), std::move(s.lockstep_by),
                              std::move(s.recording_by)});
  }
  for (auto& f : answer->facades) {
    health.facades.push_back({std::move(f.kind), std::move(f.source), std::move(f.place), f.state, f.clients,
                              std::move(f.problem)});
  }
  return health;
}

}  // namespace toftwin
