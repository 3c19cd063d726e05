// SPDX-License-Identifier: Apache-2.0
#include "daemon/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "protocol/wire/message_id.h"

namespace toftwin::daemon {
namespace {

template <class T, class... Of>
constexpr bool kIsOneOf = (std::is_same_v<T, Of> || ...);
template <class T>
constexpr bool kIsRequest = kIsOneOf<T, wire::ListSources, wire::DescribeSource, wire::Subscribe, wire::Unsubscribe, wire::SetPose,
                                     wire::SetParameter, wire::Trigger, wire::Record, wire::AskHealth>;

constexpr std::uint32_t kDeepestQueue = 1024;
/// Frames on their way are in the kernel's memory, each perhaps with a memfd, which nobody counts.
constexpr std::uint32_t kWidestWindow = 64;

wire::Message failure(std::uint64_t id, Error error) { return wire::Failure{id, std::move(error)}; }

/// How a backlog serves the policy asked for, or why that policy makes no sense.
Result<Backlog::Settings> backlogFor(const wire::Subscribe& request, std::uint64_t byte_limit,
                                     const std::shared_ptr<Account>& account) {
  const auto invalid = [](std::string why) {
    return Error{Error::Code::InvalidArgument, std::move(why)};
  };
  if (!std::isfinite(request.max_rate_hz) || request.max_rate_hz < 0.0 ||
      (request.max_rate_hz > 0.0 && request.max_rate_hz < 1e-3)) {
    return invalid("max_rate_hz must be 0 (every frame) or at least 0.001");
  }
  if (request.window > kWidestWindow) {
    return invalid(
        fmt::format("window = {} is out of bounds: it must be 0 (no limit, and no shared memory) "
                    "to {}",
                    request.window, kWidestWindow));
  }
  if (request.policy == wire::Policy::Lockstep && request.max_rate_hz > 0.0) {
    return invalid(
        "a lockstep subscriber says itself when the next frame is made: max_rate_hz must be 0");
  }
  if (request.policy == wire::Policy::Queue &&
      (request.queue < 1 || request.queue > kDeepestQueue)) {
    return invalid(fmt::format("queue = {} is out of bounds: it must be 1 to {}", request.queue,
                               kDeepestQueue));
  }
  return Backlog::Settings{.policy = request.policy,
                           .depth = request.queue,
                           .max_rate_hz = request.max_rate_hz,
                           .byte_limit = byte_limit,
                           .account = account};
}

}  // namespace

void Outbox::put(wire::Message message) {
  {
    const std::scoped_lock lock{mutex_};
    messages_.push_back(std::move(message));
  }
  wake_();
}

std::optional<wire::Message> Outbox::take() {
  const std::scoped_lock lock{mutex_};
  if (messages_.empty()) return std::nullopt;
  wire::Message message = std::move(messages_.front());
  messages_.pop_front();
  return message;
}

Session::Session(Hub& hub, Options options, std::function<void()> wake)
    : hub_(hub),
      account_(hub.clientAccount()),
      options_(std::move(options)),
      wake_(std::move(wake)),
      outbox_(std::make_shared<Outbox>(wake_)),
      who_(options_.who) {
  ++hub_.sessions;
}

Session::~Session() {
  for (const auto& [id, subscription] : subscriptions_) {
    subscription.source->unsubscribe(subscription.subscriber);
  }
  --hub_.sessions;
}

std::vector<wire::Message> Session::handle(const wire::Message& message) {
  if (is_over_) return {};
  if (!client_ && !std::holds_alternative<wire::Hello>(message)) {
    return breakOff(0, Error::Code::Malformed, "the first message must be Hello");
  }
  return std::visit(
      [this]<class T>(const T& request) {
        if constexpr (kIsRequest<T>) {
          if (request.id == 0) return breakOff(0, Error::Code::Malformed, "the id of a request must not be 0");
          if (open_.contains(request.id))
            return breakOff(0, Error::Code::Malformed,
                            fmt::format("the id {} is that of a request that is not answered yet", request.id));
        }
        return on(request);
      },
      message);
}

std::optional<Session::Outgoing> Session::next() {
  if (auto answer = outbox_->take()) {
    open_.erase(wire::idOf(*answer));
    return *std::move(answer);
  }
  // Round robin: the search begins behind the subscription that was served last.
  const auto first = subscriptions_.upper_bound(last_served_);
  for (auto at = first; at != subscriptions_.end(); ++at) {
    if (auto item = nextOf(at)) return item;
  }
  for (auto at = subscriptions_.begin(); at != first; ++at) {
    if (auto item = nextOf(at)) return item;
  }
  return std::nullopt;
}

std::optional<Session::Outgoing> Session::nextOf(Subscriptions::iterator at) {
  auto& [source, subscriber, window, bodies, on_way] = at->second;
  // An end is told at once: whoever never acknowledges would keep its room for ever.
  const bool has_window = window > 0 && !subscriber->backlog.isOver();
  if (has_window && on_way.size() >= window) return std::nullopt;
  // Room for the first was reserved. Without any for another, the next acknowledgement is waited for.
  Hold hold;
  const PreparedFramePtr next = has_window && !on_way.empty() ? subscriber->backlog.peek() : nullptr;
  if (next) {
    auto another = subscriber->backlog.another(next);
    if (!another) return std::nullopt;
    hold = *std::move(another);
  }
  auto item = subscriber->backlog.take();
  if (!item) return std::nullopt;
  const std::uint64_t id = at->first;
  if (auto* delivery = std::get_if<Backlog::Delivery>(&*item)) {
    last_served_ = id;
    if (window > 0) on_way.push_back({delivery->frame->frame.sequence, std::move(hold)});
    return FrameOut{id, std::move(*delivery), bodies};
  }
  source->unsubscribe(subscriber);
  subscriptions_.erase(at);
  return wire::Message{wire::SubscriptionEnded{id, std::get<Error>(std::move(*item))}};
}

bool Session::usesSharedMemory() const {
  const auto names = [](const std::vector<std::string>& features) {
    return std::ranges::find(features, transport::kMemfdFeature) != features.end();
  };
  return client_ && names(client_->features) && names(options_.features);
}

PlaneKind Session::lastKindOfClient() const { return wire::lastPlaneKindOf(client_->minor); }

Session::Answers Session::breakOff(std::uint64_t id, Error::Code code, std::string why) {
  is_over_ = true;
  return {failure(id, {code, std::move(why)})};
}

Session::Answers Session::on(const wire::Hello& hello) {
  if (client_) return breakOff(0, Error::Code::Malformed, "a second Hello");
  if (options_.identify) {
    auto identity = options_.identify(hello);
    if (!identity) return breakOff(hello.id, identity.error().code, identity.error().message);
    who_.name = identity->name;
    if (!who_.text.starts_with(who_.name)) who_.text = fmt::format("{}, {}", who_.name, who_.text);
    grants_ = identity->grants;
  }
  client_ = hello;
  client_->token.clear();  // nobody needs it any more
  wire::Hello answer{hello.id, "toftwind " TOFTWIN_VERSION, options_.features};
  if (hello.minor >= wire::kFirstMinorWithKeepAlive) answer.idle = options_.idle;
  return {std::move(answer)};
}

Session::Answers Session::on(const wire::ListSources& request) {
  wire::SourceList list{request.id, {}};
  for (const auto& source : hub_.sources()) list.sources.push_back(source->summary());
  return {std::move(list)};
}

Session::Answers Session::on(const wire::DescribeSource& request) {
  auto source = hub_.find(request.source);
  if (!source) return {failure(request.id, source.error())};
  auto description = (*source)->describe();
  if (!description) return {failure(request.id, description.error())};
  description->id = request.id;
  std::erase_if(description->planes, [this](PlaneKind kind) { return kind > lastKindOfClient(); });
  return {*std::move(description)};
}

Session::Answers Session::on(const wire::Subscribe& request) {
  if (subscriptions_.size() >= options_.subscriptions) {
    return {failure(request.id,
                    {Error::Code::Busy,
                     fmt::format("this connection has {} subscriptions already, the most that "
                                 "limits.subscriptions_per_session allows",
                                 subscriptions_.size())})};
  }
  if (request.policy == wire::Policy::Lockstep) {
    if (auto why = refusal(grants_.control, "hold a source in lockstep", "control")) return {failure(request.id, *why)};
  }
  auto source = hub_.find(request.source);
  if (!source) return {failure(request.id, source.error())};
  if (std::ranges::any_of(request.planes, [this](PlaneKind kind) { return kind > lastKindOfClient(); }))
    return {failure(request.id, {Error::Code::Unsupported,
                                 "a plane was asked for that the client's version of the protocol does not have"})};
  auto backlog = backlogFor(request, hub_.options().backlog_bytes, account_);
  if (!backlog) return {failure(request.id, backlog.error())};
  Wish wish;  // filled one by one: GCC 12 warns of nested braces here, without a cause
  wish.selection.planes = request.planes;
  if (request.planes.empty() &&
      lastKindOfClient() < kLastPlaneKind) {  // all, but for those that it does not know
    for (int kind = 0; kind <= static_cast<int>(lastKindOfClient()); ++kind)
      wish.selection.planes.push_back(static_cast<PlaneKind>(kind));
    wish.selection.those_it_has = true;
  }
  wish.selection.region = request.region;
  wish.selection.decimation = request.decimation;
  wish.backlog = *std::move(backlog);
  wish.who = who_;
  const bool in_shared_memory = request.window > 0 && usesSharedMemory();
  const bool is_lockstep = request.policy == wire::Policy::Lockstep;
  const std::uint64_t id = ++last_subscription_;
  Answers answer{wire::Subscribed{request.id, id}};
  Subscriptions made;  // all memory first: a source must not feed a subscriber that nobody knows
  made.emplace(id, Subscription{*source, nullptr, is_lockstep ? 1 : request.window,
                                in_shared_memory ? hub_.sharedBodies() : nullptr});
  auto subscriber = (*source)->subscribe(std::move(wish), wake_);
  if (!subscriber) return {failure(request.id, subscriber.error())};
  made.begin()->second.subscriber = *std::move(subscriber);
  subscriptions_.merge(made);
  if (is_lockstep) hub_.audit(who_.text, request.source, "hold in lockstep", {});
  return answer;
}

Session::Answers Session::on(const wire::Unsubscribe& request) {
  const auto found = subscriptions_.find(request.subscription);
  if (found == subscriptions_.end()) {
    return {failure(request.id, {Error::Code::NotFound, fmt::format("there is no subscription {}",
                                                                    request.subscription)})};
  }
  found->second.source->unsubscribe(found->second.subscriber);
  subscriptions_.erase(found);
  return {wire::Done{request.id, {}}};
}

Session::Answers Session::on(const wire::Acknowledge& request) {
  // One that is unknown has just ended, which the client learns at the same time.
  const auto found = subscriptions_.find(request.subscription);
  if (found == subscriptions_.end()) return {};
  // A client cannot have what was not sent: believing it would let it run a lockstep source ahead.
  auto& on_way = found->second.on_way;
  const auto acknowledged = std::ranges::find(on_way, request.sequence, &Subscription::OnWay::sequence);
  if (acknowledged == on_way.end()) return {};
  on_way.erase(on_way.begin(), acknowledged + 1);
  found->second.source->acknowledge(found->second.subscriber, request.sequence);
  return {};
}

std::optional<Error> Session::refusal(bool is_granted, std::string_view what, std::string_view role) const {
  if (is_granted) return std::nullopt;
  return Error{Error::Code::PermissionDenied,
               fmt::format("{} may not {}: that takes the role {} ([roles] of the daemon's configuration)", who_.name, what,
                           role)};
}

Session::Answers Session::on(const wire::SetPose& request) {
  const auto& [rotation, translation] = request.world_from_camera;
  return command(
      request.id, request.source,
      fmt::format("set pose {:g} {:g} {:g} {:g}, {:g} {:g} {:g} m", rotation[0], rotation[1], rotation[2], rotation[3],
                  translation.x, translation.y, translation.z),
      [pose = request.world_from_camera](drivers::Source& source) { return source.setPose(pose); });
}

Session::Answers Session::on(const wire::SetParameter& request) {
  const std::string value = request.text ? printable(*request.text) : fmt::format("{:g}", request.value);
  return command(request.id, request.source, fmt::format("set {} = {}", printable(request.name), value),
                 [name = request.name, value = request.value, text = request.text](drivers::Source& source) {
                   return text ? source.setParameterText(name, *text) : source.setParameter(name, value);
                 });
}

Session::Answers Session::on(const wire::Trigger& request) {
  if (auto why = refusal(grants_.control, "trigger a source", "control")) return {failure(request.id, *why)};
  auto source = hub_.find(request.source);
  if (!source) return {failure(request.id, source.error())};
  open_.insert(request.id);
  (*source)->trigger([id = request.id, outbox = outbox_](const Result<>& result) {  // too many for the audit log
    outbox->put(result ? wire::Message{wire::Done{id, {}}} : failure(id, result.error()));
  });
  return {};
}

Session::Answers Session::command(std::uint64_t id, const std::string& name, std::string what,
                                  SourceHost::Command command) {
  if (auto why = refusal(grants_.control, "set a source", "control")) {
    hub_.audit(who_.text, printable(name), what, *why);
    return {failure(id, *why)};
  }
  auto source = hub_.find(name);
  if (!source) return {failure(id, source.error())};
  (*source)->post(std::move(command), owing(id, name, std::move(what)));
  return {};
}

SourceHost::Done Session::owing(std::uint64_t id, const std::string& source, std::string what) {
  open_.insert(id);
  return [id, outbox = outbox_, audit = hub_.auditLog(), who = who_.text, source,
          what = std::move(what)](const Result<>& result) {
    if (audit) audit->tell(who, source, what, result);
    outbox->put(result ? wire::Message{wire::Done{id, {}}} : failure(id, result.error()));
  };
}

Session::Answers Session::on(const wire::Record& request) {
  const std::string what =
      request.file.empty() ? "stop recording" : fmt::format("record into {}", printable(request.file));
  if (auto why = refusal(grants_.record, "record", "record")) {
    hub_.audit(who_.text, printable(request.source), what, *why);
    return {failure(request.id, *why)};
  }
  const auto done = [id = request.id, outbox = outbox_, audit = hub_.auditLog(), who = who_.text,
                     source = printable(request.source), what](const Result<std::string>& result) {
    if (audit) audit->tell(who, source, what, result ? Result<>{} : Result<>{result.error()});
    outbox->put(result ? wire::Message{wire::Done{id, *result}} : failure(id, result.error()));
  };
  open_.insert(request.id);
  if (request.file.empty()) {
    const auto by = grants_.admin ? std::nullopt : std::optional{who_.name};
    hub_.stopRecording(request.source, by, done);
  } else {
    hub_.startRecording(request.source, request.file, who_, done);
  }
  return {};
}

Session::Answers Session::on(const wire::AskHealth& request) {
  wire::Health health = hub_.health();
  health.id = request.id;
  return {std::move(health)};
}

/// Everything else is what a daemon says, not what a client may say.
template <class Answer>
Session::Answers Session::on(const Answer&) {
  return breakOff(0, Error::Code::Malformed, "a client does not send this kind of message");
}

}  // namespace toftwin::daemon
