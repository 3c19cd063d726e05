// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <variant>

#include "../daemon/fakes.h"
#include "daemon/source_host.h"

namespace toftwin::test {

/// Frames are here again so soon after a camera is: the drivers' bar. Sanitizers make all of it several times
/// slower, and are there for other faults.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr std::chrono::milliseconds kBackWithin{10'000};
#else
inline constexpr std::chrono::milliseconds kBackWithin{1000};
#endif

/// A camera in the daemon's hands, with one subscriber that stays: what happens to it when the
/// camera is lost, and how soon it has frames again.
class RecoveryRig {
 public:
  explicit RecoveryRig(daemon::SourceHost::Open open, drivers::Recovery::Options options = {})
      : host_("camera", open, open(), {.recovery = options}, daemon::systemClock()) {
    auto subscribed =
        host_.subscribe({{}, {.policy = wire::Policy::Queue, .depth = 1000}}, taker_.wake());
    EXPECT_TRUE(subscribed.ok()) << subscribed.error().message;
    if (subscribed) subscriber_ = *subscribed;
  }
  [[nodiscard]] bool isSubscribed() const { return subscriber_ != nullptr; }
  daemon::SourceHost& host() { return host_; }

  /// The next frame of the one subscription, or nothing after half a minute or at its end.
  std::optional<Frame> next() {
    auto item = taker_.next(subscriber_->backlog);
    if (!item || std::holds_alternative<Error>(*item)) return std::nullopt;
    return std::get<daemon::Backlog::Delivery>(*item).frame->frame;
  }
  /// Takes what is there; the last of it.
  std::optional<Frame> drain() {
    std::optional<Frame> last;
    while (auto item = subscriber_->backlog.take()) {
      if (std::holds_alternative<Error>(*item)) return last;
      last = std::get<daemon::Backlog::Delivery>(*item).frame->frame;
    }
    return last;
  }
  Result<> command(daemon::SourceHost::Command command) {
    std::promise<Result<>> done;
    host_.post(std::move(command), [&](Result<> result) { done.set_value(std::move(result)); });
    return done.get_future().get();
  }

  struct Outcome {
    Frame last, first;  ///< before the loss, after it
    std::chrono::duration<double, std::milli> took{};
  };
  /// Loses the camera and gives it back so long after the daemon has noticed. Prints how long after
  /// its return the first frame was with the subscriber.
  std::optional<Outcome> loseAndFind(std::string_view what, std::chrono::milliseconds away,
                                     const std::function<void()>& lose,
                                     const std::function<void()>& giveBack) {
    Outcome outcome;
    auto last = next();
    if (!last) return std::nullopt;
    outcome.last = *std::move(last);
    lose();
    while (host_.health().reconnects == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
    if (auto late = drain()) outcome.last = *std::move(late);
    std::this_thread::sleep_for(away);
    const auto returned = std::chrono::steady_clock::now();
    giveBack();
    auto first = next();
    if (!first) return std::nullopt;
    outcome.took = std::chrono::steady_clock::now() - returned;
    outcome.first = *std::move(first);
    fmt::print("{}: the first frame {:.0f} ms after the camera was back\n", what,
               outcome.took.count());
    testing::Test::RecordProperty("recovery_ms", fmt::format("{:.0f}", outcome.took.count()));
    return outcome;
  }

 private:
  daemon::test::Taker taker_;
  daemon::SourceHost host_;
  daemon::SubscriberPtr subscriber_;
};

}  // namespace toftwin::test
