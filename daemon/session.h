// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "daemon/access.h"
#include "daemon/hub.h"
#include "protocol/wire/messages.h"

namespace toftwin::daemon {

/// Answers that come later, from the threads of sources and recorders. Shared by the session and by
/// those who still owe it an answer, since they may outlive it.
class Outbox {
 public:
  explicit Outbox(std::function<void()> wake) : wake_(std::move(wake)) {}
  void put(wire::Message message);
  std::optional<wire::Message> take();

 private:
  const std::function<void()> wake_;
  std::mutex mutex_;
  std::deque<wire::Message> messages_;
};

/// One client's conversation: messages in, messages out. No socket; used by one thread at a time.
class Session {
 public:
  struct Options {
    std::size_t subscriptions = 16;  ///< at once
    std::vector<std::string> features;
    Subscribing who{};
    /// Who the client is, which its Hello may say; without it, `who`, who may do all.
    std::function<Result<Identity>(const wire::Hello&)> identify{};
    std::optional<Duration> idle{};  ///< for the Hello: silence that ends the connection
  };
  /// A frame for one subscription, to be encoded around the shared body.
  struct FrameOut {
    std::uint64_t subscription = 0;
    Backlog::Delivery delivery;
    std::shared_ptr<transport::SharedBodies> bodies;  ///< that makes its shared body; null: it has none
  };
  using Outgoing = std::variant<wire::Message, FrameOut>;

  /// `wake` is called, on any thread, when `next` has something to give after it had nothing.
  Session(Hub& hub, Options options, std::function<void()> wake);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// What is to be sent at once. Other answers, and frames, come from `next`.
  std::vector<wire::Message> handle(const wire::Message& message);
  /// Takes the next thing to send: late answers first, then frames, one subscription after the
  /// other.
  std::optional<Outgoing> next();
  /// Answers that this session still owes, for a client that asks faster than it reads.
  [[nodiscard]] std::size_t owed() const { return open_.size(); }
  /// The client has introduced itself.
  [[nodiscard]] bool isOpen() const { return client_.has_value(); }
  /// The client broke the protocol: send what `handle` gave and close.
  [[nodiscard]] bool isOver() const { return is_over_; }
  /// The client's Hello.
  [[nodiscard]] const std::optional<wire::Hello>& client() const { return client_; }

 private:
  using Answers = std::vector<wire::Message>;
  struct Subscription {
    std::shared_ptr<SourceHost> source;  // shared with the hub
    SubscriberPtr subscriber;
    std::uint32_t window = 0;  ///< frames that may be unacknowledged; 0: any number
    std::shared_ptr<transport::SharedBodies> bodies;  // shared by all that take bodies that way
    struct OnWay {
      std::uint64_t sequence = 0;
      Hold hold;  ///< nothing for the first, whose room is reserved
    };
    std::deque<OnWay> on_way{};  ///< sent but not acknowledged, if there is a window
  };

  using Subscriptions = std::map<std::uint64_t, Subscription>;

  Answers on(const wire::Hello& hello);
  Answers on(const wire::ListSources& request);
  Answers on(const wire::DescribeSource& request);
  Answers on(const wire::Subscribe& request);
  Answers on(const wire::Unsubscribe& request);
  Answers on(const wire::Acknowledge& request);
  Answers on(const wire::SetPose& request);
  Answers on(const wire::SetParameter& request);
  Answers on(const wire::Trigger& request);
  Answers on(const wire::Record& request);
  Answers on(const wire::AskHealth& request);
  Answers on(const wire::KeepAlive&) { return {}; }
  template <class Answer>
  Answers on(const Answer& answer);
  /// Why it may not; nothing if it may.
  [[nodiscard]] std::optional<Error> refusal(bool is_granted, std::string_view what, std::string_view role) const;
  [[nodiscard]] bool usesSharedMemory() const;
  /// Of planes: the client's version of the protocol knows no later ones.
  [[nodiscard]] PlaneKind lastKindOfClient() const;
  Answers breakOff(std::uint64_t id, Error::Code code, std::string why);
  Answers command(std::uint64_t id, const std::string& source, std::string what, SourceHost::Command command);
  /// What puts the answer to that request into the outbox, and tells who asked for it.
  SourceHost::Done owing(std::uint64_t id, const std::string& source, std::string what);
  std::optional<Outgoing> nextOf(Subscriptions::iterator at);

  Hub& hub_;
  const std::shared_ptr<Account> account_;  // shared with subscriptions, which may outlive this
  const Options options_;
  const std::function<void()> wake_;
  const std::shared_ptr<Outbox> outbox_;
  std::optional<wire::Hello> client_;
  Subscribing who_;
  Grants grants_{.view = true, .control = true, .record = true, .admin = true};
  bool is_over_ = false;
  std::set<std::uint64_t> open_;  ///< ids of requests whose answers are still to come
  Subscriptions subscriptions_;
  std::uint64_t last_subscription_ = 0;
  std::uint64_t last_served_ = 0;
};

}  // namespace toftwin::daemon
