// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/source_link.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

constexpr std::chrono::milliseconds kLinkPause{200};

}  // namespace

SourceLink::SourceLink(EventThread& thread, const FacadePlace& place, Wants wants, TakeFrame take)
    : hub_(place.hub),
      account_(place.hub.clientAccount()),
      source_(place.keys.source),
      wants_(std::move(wants)),
      take_(std::move(take)),
      door_(thread.door()),
      pause_(thread.io()),
      unevenness_(place.unevenness),
      latency_(std::llround(place.keys.latency.in(nanosecond))),
      clock_(place.clock),
      held_(thread.io(), fmt::format("facade {} of {}", place.keys.kind, source_), take_) {}

SourceLink::~SourceLink() {
  *is_alive_ = false;
  unsubscribe();
}

void SourceLink::want(bool is_wanted) {
  if (is_wanted == is_wanted_) return;
  is_wanted_ = is_wanted;
  if (is_wanted) return subscribe();
  pause_.cancel();
  unsubscribe();
  held_.clear();
}

Result<wire::SourceDescription> SourceLink::describe() const {
  const auto host = hub_.find(source_);
  if (!host) return host.error();
  return (*host)->describe();
}

wire::SourceHealth SourceLink::health() const {
  const auto host = hub_.find(source_);
  wire::SourceHealth health;
  health.name = source_;
  return host ? (*host)->health() : health;
}

void SourceLink::post(SourceHost::Command command, Done done) {
  const auto host = hub_.find(source_);
  if (!host) return done(host.error());
  (*host)->post(std::move(command), onThread(std::move(done)));
}

void SourceLink::trigger(Done done) {
  const auto host = hub_.find(source_);
  if (!host) return done(host.error());
  (*host)->trigger(onThread(std::move(done)));
}

SourceLink::Done SourceLink::onThread(Done done) const {
  return [door = door_, done = std::move(done), alive = is_alive_](const Result<>& result) {
    door->post([done, result, alive] {
      if (*alive) done(result);
    });
  };
}

void SourceLink::subscribe() {
  if (!is_wanted_ || subscriber_) return;
  auto host = hub_.find(source_);
  if (!host) return tryAgain();
  auto subscribed = subscribeTo(**host);
  if (!subscribed) {
    noteRefused(subscribed.error());
    return tryAgain();
  }
  refused_.clear();
  host_ = *std::move(host);
  subscriber_ = *std::move(subscribed);
}

/// Said once, though it is tried several times a second. A source that is not there tells the log itself.
void SourceLink::noteRefused(const Error& why) {
  using Code = Error::Code;
  if (why.code == Code::Disconnected || why.code == Code::Stopped || why.message == refused_) return;
  refused_ = why.message;
  logging::warn("a facade of {} gets no frames, and tries again: {}", source_, refused_);
}

Result<SubscriberPtr> SourceLink::subscribeTo(SourceHost& host) {
  Wish wish;
  wish.selection.planes = wants_.planes;
  wish.selection.those_it_has = true;
  wish.backlog = {.policy = wire::Policy::Queue,
                  .depth = wants_.queue,
                  .byte_limit = hub_.options().backlog_bytes,
                  .account = account_};
  wish.who.name = wish.who.text = fmt::format("a facade of {}", source_);
  return host.subscribe(std::move(wish), [this, door = door_, alive = is_alive_] {
    door->post([this, alive] {
      if (*alive) takeAll();
    });
  });
}

void SourceLink::unsubscribe() {
  if (subscriber_) host_->unsubscribe(subscriber_);
  subscriber_.reset();
  host_.reset();
}

void SourceLink::tryAgain() {
  pause_.expires_after(kLinkPause);
  pause_.async_wait([this, alive = is_alive_](boost::system::error_code cancelled) {
    if (!cancelled && *alive) subscribe();
  });
}

void SourceLink::takeAll() {
  while (subscriber_) {
    auto item = subscriber_->backlog.take();
    if (!item) return;
    if (const auto* delivery = std::get_if<Backlog::Delivery>(&*item)) {
      take(delivery->frame->frame);
      continue;
    }
    unsubscribe();  // it ended; the source may be back soon, or be another one of that name
    if (is_wanted_) tryAgain();
  }
}

void SourceLink::take(const Frame& frame) {
  if (unevenness_.isNone() && latency_.count() == 0) return take_(frame);
  held_.hold(frame, HeldFrames::arrivalOf(frame, clock_) + latency_ + unevenness_.delay(taken_++));
}

}  // namespace toftwin::daemon
