// SPDX-License-Identifier: Apache-2.0
#include "daemon/source_host.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <tuple>

#include "fakes.h"

namespace toftwin::daemon {
namespace {

using test::FakeClock;
using test::Remote;
using test::Taker;
using wire::Policy;

struct Rig {
  FakeClock clock;
  std::shared_ptr<Remote> remote = std::make_shared<Remote>();
  std::unique_ptr<SourceHost> host;
  SourceHost::Options options{.always = false,
                              .recovery = {.first_retry = std::chrono::milliseconds{1},
                                           .longest_retry = std::chrono::milliseconds{1}}};

  std::atomic<int> refused = 0;  ///< that so many openings fail

  void start() {
    const SourceHost::Open open = [this, there = test::opener(remote)]() -> Result<std::unique_ptr<drivers::Source>> {
      if (refused > 0 && refused-- > 0) return Error{Error::Code::NotFound, "no such device"};
      return there();
    };
    host = std::make_unique<SourceHost>("cam", open, open(), options, clock);
  }
  SubscriberPtr subscribe(Taker& taker, Backlog::Settings backlog = {.policy = Policy::Queue, .depth = 100},
                          const std::string& who = {}) {
    const Subscribing subscribing{.name = who, .text = who, .lockstep_patience = std::chrono::seconds{5}};
    auto subscribed = host->subscribe({{}, backlog, subscribing}, taker.wake());
    EXPECT_TRUE(subscribed.ok()) << subscribed.error().message;
    return *subscribed;
  }
  Result<> command(SourceHost::Command command) {
    std::promise<Result<>> done;
    host->post(std::move(command), [&](Result<> result) { done.set_value(std::move(result)); });
    return done.get_future().get();
  }
};

TEST(SourceHost, NumbersFramesWithoutGapsAndStampsThem) {
  Rig rig;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker);
  rig.remote->give(3);
  for (std::int64_t i = 0; i < 3; ++i) {
    const auto item = taker.next(subscriber->backlog);
    ASSERT_TRUE(item.has_value());
    const Frame& frame = std::get<Backlog::Delivery>(*item).frame->frame;
    EXPECT_EQ(frame.sequence, static_cast<std::uint64_t>(i));
    EXPECT_EQ(frame.source, "cam");
    EXPECT_EQ(frame.moment.received, rig.clock.wall());
  }
  EXPECT_EQ(rig.host->health().frames, 3u);
}

TEST(SourceHost, SaysWhichPlanesItHasOnceAnotherProgramSetTheCamera) {
  Rig rig;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker);
  rig.remote->give();
  ASSERT_EQ(taker.nextSequence(subscriber->backlog), 0);
  EXPECT_EQ(rig.host->describe()->planes, (std::vector{PlaneKind::Range, PlaneKind::Flags}));
  rig.remote->is_set_elsewhere = true;
  rig.remote->give();
  ASSERT_EQ(taker.nextSequence(subscriber->backlog), 1);
  EXPECT_EQ(rig.host->describe()->planes,
            (std::vector{PlaneKind::Range, PlaneKind::Flags, PlaneKind::Amplitude}));
}

TEST(SourceHost, OnDemandRunsOnlyWhileSomebodySubscribes) {
  Rig rig;
  rig.start();
  Taker taker;
  EXPECT_EQ(rig.remote->started.count(), 0);
  const auto subscriber = rig.subscribe(taker);
  ASSERT_TRUE(rig.remote->started.reaches(1));
  rig.host->unsubscribe(subscriber);
  ASSERT_TRUE(rig.remote->stopped.reaches(1));
  const auto again = rig.subscribe(taker);
  ASSERT_TRUE(rig.remote->started.reaches(2));
}

TEST(SourceHost, AlwaysRunsWithoutSubscribers) {
  Rig rig;
  rig.options.always = true;
  rig.start();
  rig.remote->give(2);
  ASSERT_TRUE(rig.remote->asked.reaches(3));
  EXPECT_EQ(rig.host->health().frames, 2u);
}

TEST(SourceHost, EqualSelectionsShareOneEncoding) {
  Rig rig;
  rig.start();
  Taker taker;
  const auto a = rig.subscribe(taker), b = rig.subscribe(taker);
  auto c = rig.host->subscribe({{.planes = {PlaneKind::Flags}, .region = {}}, {}}, taker.wake());
  ASSERT_TRUE(c.ok());
  rig.remote->give();
  const auto of_a = std::get<Backlog::Delivery>(*taker.next(a->backlog)).frame;
  const auto of_b = std::get<Backlog::Delivery>(*taker.next(b->backlog)).frame;
  const auto of_c = std::get<Backlog::Delivery>(*taker.next((*c)->backlog)).frame;
  EXPECT_EQ(of_a, of_b);
  EXPECT_NE(of_a, of_c);
  EXPECT_EQ(of_c->frame.planes.size(), 1u);
}

TEST(SourceHost, LockstepWaitsForEveryLockstepSubscriberAndForNobodyElse) {
  Rig rig;
  rig.start();
  Taker one, two, free;
  const auto first = rig.subscribe(one, {.policy = Policy::Lockstep});
  const auto second = rig.subscribe(two, {.policy = Policy::Lockstep});
  const auto other = rig.subscribe(free);
  rig.remote->give(3);
  ASSERT_EQ(one.nextSequence(first->backlog), 0);
  ASSERT_EQ(free.nextSequence(other->backlog), 0);
  ASSERT_EQ(two.nextSequence(second->backlog), 0);
  rig.host->acknowledge(first, 0);
  rig.host->acknowledge(first, 0);  // saying it twice is not both of them
  // A command is done between frames: after it, a frame that was due would have been made.
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(rig.command([](auto&) { return Result<>{}; }).ok());
  EXPECT_FALSE(first->backlog.take().has_value()) << "a frame was made before all acknowledged";
  rig.host->acknowledge(second, 0);
  EXPECT_EQ(one.nextSequence(first->backlog), 1);
  EXPECT_EQ(two.nextSequence(second->backlog), 1);
  EXPECT_EQ(free.nextSequence(other->backlog), 1);
}

TEST(SourceHost, ALockstepSubscriberThatVanishesHoldsNobodyUp) {
  Rig rig;
  rig.start();
  Taker one, two;
  const auto first = rig.subscribe(one, {.policy = Policy::Lockstep});
  const auto second = rig.subscribe(two, {.policy = Policy::Lockstep});
  rig.remote->give(2);
  ASSERT_EQ(one.nextSequence(first->backlog), 0);
  rig.host->acknowledge(first, 0);
  rig.host->unsubscribe(second);
  EXPECT_EQ(one.nextSequence(first->backlog), 1);
}

/// The source looks at the clock when it is woken; each wake may come a moment too early for what it waits for.
bool comesByItself(Rig& rig, Taker& taker, Backlog& backlog, std::int64_t sequence) {
  for (int i = 0; i < 3; ++i) (void)rig.command([](auto&) { return Result<>{}; });
  return taker.nextSequence(backlog) == sequence;
}

TEST(SourceHost, GoesOnWithoutALockstepSubscriberThatKeepsOthersWaitingTooLong) {
  Rig rig;
  rig.start();
  Taker holding, watching;
  const auto holder = rig.subscribe(holding, {.policy = Policy::Lockstep}, "holder");
  const auto watcher = rig.subscribe(watching);
  rig.remote->give(4);
  ASSERT_EQ(holding.nextSequence(holder->backlog), 0);
  ASSERT_EQ(watching.nextSequence(watcher->backlog), 0);
  rig.clock.advance(std::chrono::seconds{4});
  EXPECT_EQ(rig.host->health().lockstep_by, "holder, waited for since 4.0 s");
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(rig.command([](auto&) { return Result<>{}; }).ok());
  EXPECT_FALSE(watcher->backlog.take().has_value()) << "too early";
  rig.clock.advance(std::chrono::seconds{2});
  EXPECT_TRUE(comesByItself(rig, watching, watcher->backlog, 1));
  EXPECT_EQ(watching.nextSequence(watcher->backlog), 2);
  EXPECT_EQ(rig.host->health().lockstep_by, "holder, which others do not wait for any more");
  EXPECT_EQ(watching.nextSequence(watcher->backlog), 3);
  EXPECT_FALSE(holder->backlog.take().has_value());
  rig.host->acknowledge(holder, 0);
  rig.remote->give();  // the frame that is waited for was begun before that: it may lack what the holder set
  EXPECT_EQ(watching.nextSequence(watcher->backlog), 4);
  rig.remote->give(2);
  const auto next = std::get<Backlog::Delivery>(*holding.next(holder->backlog));
  EXPECT_EQ(next.frame->frame.sequence, 5u);
  EXPECT_EQ(next.dropped_before, 4u);
  EXPECT_EQ(watching.nextSequence(watcher->backlog), 5);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(rig.command([](auto&) { return Result<>{}; }).ok());
  EXPECT_FALSE(watcher->backlog.take().has_value()) << "it is waited for again";
}

TEST(SourceHost, ALockstepSubscriberThatKeepsNobodyWaitingHasAllTheTime) {
  Rig rig;
  rig.start();
  Taker taker;
  const auto holder = rig.subscribe(taker, {.policy = Policy::Lockstep}, "holder");
  rig.remote->give(2);
  ASSERT_EQ(taker.nextSequence(holder->backlog), 0);
  rig.clock.advance(std::chrono::hours{1});
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(rig.command([](auto&) { return Result<>{}; }).ok());
  EXPECT_FALSE(holder->backlog.take().has_value());
  rig.host->acknowledge(holder, 0);
  EXPECT_EQ(taker.nextSequence(holder->backlog), 1);
}

TEST(SourceHost, UnderLockstepFramesComeNoFasterThanItsOwnWhereSomebodyElseWatches) {
  Rig rig;
  rig.remote->info.frame_interval = 100_ms;
  rig.start();
  Taker holding, watching;
  const auto holder = rig.subscribe(holding, {.policy = Policy::Lockstep}, "holder");
  const auto watcher = rig.subscribe(watching, {.policy = Policy::Queue, .depth = 100}, "somebody else");
  rig.remote->give(2);
  ASSERT_EQ(holding.nextSequence(holder->backlog), 0);
  rig.host->acknowledge(holder, 0);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(rig.command([](auto&) { return Result<>{}; }).ok());
  EXPECT_FALSE(holder->backlog.take().has_value()) << "too early";
  rig.clock.advance(std::chrono::milliseconds{100});
  EXPECT_TRUE(comesByItself(rig, holding, holder->backlog, 1));
  rig.host->unsubscribe(watcher);
  rig.remote->give();
  rig.host->acknowledge(holder, 1);
  EXPECT_EQ(holding.nextSequence(holder->backlog), 2) << "alone it is as fast as it likes";
}

TEST(SourceHost, APoseUnderLockstepIsThatOfTheNextFrame) {
  Rig rig;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker, {.policy = Policy::Lockstep});
  rig.remote->give(2);
  ASSERT_EQ(taker.nextSequence(subscriber->backlog), 0);
  const Transform<World, Camera> pose{{1, 0, 0, 0}, {0, 0, 3}};
  ASSERT_TRUE(rig.command([&](drivers::Source& source) { return source.setPose(pose); }).ok());
  rig.host->acknowledge(subscriber, 0);
  const auto item = taker.next(subscriber->backlog);
  ASSERT_TRUE(item.has_value());
  EXPECT_EQ(std::get<Backlog::Delivery>(*item).frame->frame.moment.world_from_camera, pose);
}

TEST(SourceHost, OpensALostCameraAgainAndKeepsItsSubscribers) {
  Rig rig;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker);
  rig.remote->give();
  ASSERT_EQ(taker.nextSequence(subscriber->backlog), 0);
  rig.remote->give({Error::Code::Disconnected, "unplugged"});
  // The clock stands still, so the back-off is not over until the test says so.
  while (rig.host->health().reconnects == 0) std::this_thread::yield();
  EXPECT_EQ(rig.remote->opened.count(), 1);
  EXPECT_EQ(rig.host->health().last_error, "unplugged");
  rig.clock.advance(std::chrono::milliseconds{2});
  ASSERT_TRUE(rig.remote->opened.reaches(2));
  rig.remote->give();
  EXPECT_EQ(taker.nextSequence(subscriber->backlog), 1);
  EXPECT_EQ(rig.host->health().reconnects, 1u);
}

TEST(SourceHost, ALostCameraGetsItsPoseBackAndTheNextFrameSaysWhatHappened) {
  Rig rig;
  rig.remote->info.kind = FrameKind::Real;
  rig.remote->info.can_trigger = rig.remote->info.can_lockstep = false;
  rig.remote->info.frame_interval = 10_ms;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker);
  rig.remote->give();
  ASSERT_EQ(taker.nextSequence(subscriber->backlog), 0);
  const Transform<World, Camera> pose{{1, 0, 0, 0}, {0, 0, 3}};
  ASSERT_TRUE(rig.command([&](drivers::Source& source) { return source.setPose(pose); }).ok());
  rig.remote->give({Error::Code::Disconnected, "unplugged"});
  while (rig.host->health().reconnects == 0) std::this_thread::yield();
  rig.clock.advance(std::chrono::milliseconds{100});
  ASSERT_TRUE(rig.remote->opened.reaches(2));
  rig.remote->give(2);
  const auto item = taker.next(subscriber->backlog);
  ASSERT_TRUE(item.has_value());
  const Frame& frame = std::get<Backlog::Delivery>(*item).frame->frame;
  EXPECT_EQ(frame.moment.world_from_camera, pose);
  EXPECT_EQ(frame.dropped_by_device, 9u);
  EXPECT_EQ(frame.dropped_because, "unplugged");
  EXPECT_EQ(rig.host->health().last_error, "unplugged");
  const auto next = taker.next(subscriber->backlog);
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(std::get<Backlog::Delivery>(*next).frame->frame.dropped_by_device, 0u);
}

TEST(SourceHost, WhatKeepsALostCameraAwayDoesNotPushOutWhyItWasLost) {
  Rig rig;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker);
  rig.remote->give();
  ASSERT_EQ(taker.nextSequence(subscriber->backlog), 0);
  rig.refused = 2;
  rig.remote->give({Error::Code::Disconnected, "unplugged"});
  while (rig.remote->opened.count() < 2) {
    rig.clock.advance(std::chrono::milliseconds{2});
    std::this_thread::yield();
  }
  EXPECT_EQ(rig.host->health().last_error, "unplugged; since then: no such device");
  // That it opens is not enough.
  for (int opened = 3; const std::string why : {"it does not start", "it hangs"}) {
    rig.remote->give({Error::Code::Disconnected, why});
    for (; rig.remote->opened.count() < opened; std::this_thread::yield())
      rig.clock.advance(std::chrono::milliseconds{2});
    EXPECT_EQ(rig.host->health().last_error, "unplugged; since then: " + why);
    ++opened;
  }
  rig.remote->give();
  const auto item = taker.next(subscriber->backlog);
  ASSERT_TRUE(item.has_value());
  EXPECT_EQ(std::get<Backlog::Delivery>(*item).frame->frame.dropped_because, "unplugged");
  rig.remote->give({Error::Code::Disconnected, "unplugged again"});
  while (rig.remote->opened.count() < 5) {
    rig.clock.advance(std::chrono::milliseconds{2});
    std::this_thread::yield();
  }
  EXPECT_EQ(rig.host->health().last_error, "unplugged again") << "of a new loss";
}

TEST(SourceHost, EndsItsSubscriptionsWithTheStreamAndStartsAnewForTheNext) {
  Rig rig;
  rig.options.always = true;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker);
  rig.remote->give();
  rig.remote->give({Error::Code::EndOfStream, "the end"});
  ASSERT_EQ(taker.nextSequence(subscriber->backlog), 0);
  const auto end = taker.next(subscriber->backlog);
  EXPECT_EQ(std::get<Error>(end.value()).code, Error::Code::EndOfStream);
  const auto again = rig.subscribe(taker);
  rig.remote->give();
  EXPECT_EQ(taker.nextSequence(again->backlog), 1);
}

TEST(SourceHost, WhoeverSubscribesWhileTheStreamEndsGetsTheNextOne) {
  Rig rig;
  rig.remote->info.can_trigger = false;  // so that a subscription does not interrupt next()
  rig.start();
  Taker early, late;
  const auto first = rig.subscribe(early);
  ASSERT_TRUE(rig.remote->asked.reaches(1));
  const auto second = rig.subscribe(late);
  rig.remote->give({Error::Code::EndOfStream, "the end"});
  const auto end = early.next(first->backlog);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(std::get<Error>(*end).code, Error::Code::EndOfStream);
  ASSERT_TRUE(rig.remote->started.reaches(2));
  rig.remote->give();
  EXPECT_EQ(late.nextSequence(second->backlog), 0);
}

TEST(SourceHost, ACommandInterruptsAFrameInTheMaking) {
  Rig rig;
  rig.remote->info.can_trigger = false;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker);
  ASSERT_TRUE(rig.remote->asked.reaches(1));
  std::promise<void> done;
  rig.host->post([](auto&) { return Result<>{}; }, [&](const Result<>&) { done.set_value(); });
  auto future = done.get_future();
  const bool came = future.wait_for(std::chrono::seconds{30}) == std::future_status::ready;
  rig.remote->give();
  EXPECT_TRUE(came) << "it waited for the frame";
  future.wait();
  EXPECT_EQ(taker.nextSequence(subscriber->backlog), 0);
  EXPECT_EQ(rig.host->health().reconnects, 0u);
}

/// A triggered camera whose frame takes until the test gives it.
class SlowSource final : public drivers::Source {
 public:
  explicit SlowSource(std::shared_ptr<Remote> remote) : source_(std::move(remote)) {}
  [[nodiscard]] const drivers::SourceInfo& info() const override { return source_.info(); }
  Result<> start() override { return source_.start(); }
  void stop() override { source_.stop(); }
  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    return source_.next(std::move(stop), lockstep);
  }
  Result<> trigger() override { return {}; }

 private:
  test::FakeSource source_;
};

TEST(SourceHost, ATriggeredFrameIsBegunAnewOnceAtMostHoweverManySubscribersComeAndGo) {
  Rig rig;
  const auto open = [&]() -> Result<std::unique_ptr<drivers::Source>> {
    return std::unique_ptr<drivers::Source>{std::make_unique<SlowSource>(rig.remote)};
  };
  rig.host = std::make_unique<SourceHost>("cam", open, open(), rig.options, rig.clock);
  Taker taker, other;
  const auto subscriber = rig.subscribe(taker);
  ASSERT_TRUE(rig.remote->asked.reaches(1));
  // While it waits for a trigger it is interrupted as often as anybody likes.
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(rig.command([](auto&) { return Result<>{}; }).ok());
  std::promise<void> triggered;
  rig.host->trigger([&](const Result<>&) { triggered.set_value(); });
  triggered.get_future().wait();
  const int before = rig.remote->asked.count();
  for (int i = 0; i < 100; ++i) {
    rig.host->unsubscribe(rig.subscribe(other));
    std::this_thread::sleep_for(std::chrono::microseconds{200});  // for an interruption to be noticed
  }
  // The frame's own call, perhaps begun after `before`, and one anew.
  EXPECT_LE(rig.remote->asked.count(), before + 2);
  rig.remote->give();
  EXPECT_EQ(taker.nextSequence(subscriber->backlog), 0);
}

/// A camera that cannot be triggered before it is started. `meanwhile` happens while it stops.
class StoppedSource final : public drivers::Source {
 public:
  StoppedSource(std::shared_ptr<Remote> remote, std::function<void()> meanwhile)
      : source_(std::move(remote)), meanwhile_(std::move(meanwhile)) {}
  [[nodiscard]] const drivers::SourceInfo& info() const override { return source_.info(); }
  Result<> start() override { return is_started_ = true, source_.start(); }
  void stop() override {
    is_started_ = false;
    source_.stop();
    meanwhile_();
  }
  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    return source_.next(std::move(stop), lockstep);
  }
  Result<> trigger() override {
    if (!is_started_) return Error{Error::Code::InvalidArgument, "it is not started"};
    return source_.trigger();
  }

 private:
  test::FakeSource source_;
  std::function<void()> meanwhile_;
  bool is_started_ = false;
};

TEST(SourceHost, ATriggerRightAfterASubscriptionFindsTheCameraStartedThoughItWasJustBeingStopped) {
  Rig rig;
  Taker taker;
  SubscriberPtr second;
  std::promise<Result<>> triggered;
  const auto subscribeAndTrigger = [&, is_first = true]() mutable {
    if (!std::exchange(is_first, false)) return;
    second = rig.subscribe(taker);
    rig.host->trigger([&](Result<> result) { triggered.set_value(std::move(result)); });
  };
  const auto open = [&]() -> Result<std::unique_ptr<drivers::Source>> {
    return std::unique_ptr<drivers::Source>{std::make_unique<StoppedSource>(rig.remote, subscribeAndTrigger)};
  };
  rig.host = std::make_unique<SourceHost>("cam", open, open(), rig.options, rig.clock);
  const auto first = rig.subscribe(taker);
  ASSERT_TRUE(rig.remote->asked.reaches(1));
  rig.host->unsubscribe(first);
  const auto result = triggered.get_future().get();
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(taker.nextSequence(second->backlog), 0);
}

TEST(SourceHost, WhatGoesWrongWithOneSubscriberIsNobodyElsesMatter) {
  Rig rig;
  rig.start();
  Taker taker;
  auto broken = rig.host->subscribe({{}, {}}, [] { throw std::bad_alloc{}; });
  ASSERT_TRUE(broken.ok());
  const auto other = rig.subscribe(taker);
  rig.remote->give(2);
  EXPECT_EQ(taker.nextSequence(other->backlog), 0);
  EXPECT_EQ(taker.nextSequence(other->backlog), 1);
  EXPECT_TRUE((*broken)->backlog.hasEnded());
}

TEST(SourceHost, WhoeverCannotBeToldKeepsNothingFromTheOthers) {
  Rig rig;
  rig.start();
  Taker taker;
  auto broken = rig.host->subscribe({{}, {}}, [] { throw 42; });
  ASSERT_TRUE(broken.ok());
  const auto other = rig.subscribe(taker);
  rig.host->post([](auto&) { return Result<>{}; }, [](const Result<>&) { throw 42; });
  EXPECT_TRUE(rig.command([](auto&) { return Result<>{}; }).ok());
  rig.remote->give({Error::Code::EndOfStream, "the end"});
  const auto end = taker.next(other->backlog);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(std::get<Error>(*end).code, Error::Code::EndOfStream);
  EXPECT_TRUE((*broken)->backlog.hasEnded());
}

TEST(SourceHost, AnAbsentCameraIsTriedAgainAndSaysSoMeanwhile) {
  Rig rig;
  rig.host = std::make_unique<SourceHost>("cam", test::opener(rig.remote),
                                          Error{Error::Code::NotFound, "no camera there"},
                                          rig.options, rig.clock);
  Taker taker;
  const auto refused = rig.host->subscribe({{}, {}}, taker.wake());
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("no camera there"), std::string::npos);
  EXPECT_EQ(rig.command([](auto&) { return Result<>{}; }).error().code, Error::Code::Disconnected);
  rig.clock.advance(std::chrono::milliseconds{2});
  ASSERT_TRUE(rig.remote->opened.reaches(1));
  while (!rig.host->describe().ok()) std::this_thread::yield();
  EXPECT_TRUE(rig.host->subscribe({{}, {}}, taker.wake()).ok());
}

TEST(SourceHost, KnowsHowLongItsDriverHasBeenBusy) {
  Rig rig;
  rig.start();
  EXPECT_EQ(rig.host->inDriverFor(rig.clock.steady()).count(), 0);
  Taker taker;
  const auto subscriber = rig.subscribe(taker);
  ASSERT_TRUE(rig.remote->asked.reaches(1));  // now it waits in next()
  rig.clock.advance(std::chrono::seconds{5});
  EXPECT_EQ(rig.host->inDriverFor(rig.clock.steady()), std::chrono::seconds{5});
}

TEST(SourceHost, TellsItsSubscribersWhenItIsClosed) {
  Rig rig;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker);
  ASSERT_TRUE(rig.remote->asked.reaches(1));
  rig.host.reset();
  EXPECT_EQ(std::get<Error>(taker.next(subscriber->backlog).value()).code, Error::Code::Stopped);
  EXPECT_EQ(rig.remote->stopped.count(), 1);
}

TEST(SourceHost, RefusesLockstepFromACameraThatPacesItself) {
  Rig rig;
  rig.remote->info.can_lockstep = false;
  rig.start();
  Taker taker;
  const auto refused = rig.host->subscribe({{}, {.policy = Policy::Lockstep}}, taker.wake());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Error::Code::Unsupported);
}

/// Throws once, in the call of that name.
struct Fault {
  std::string where;
  bool is_standard = true;
  std::atomic<bool> is_due{true};

  void at(std::string_view call) {
    if (call != where || !is_due.exchange(false)) return;
    if (is_standard) throw std::runtime_error{"oops"};
    throw 42;
  }
};

/// A fake camera whose driver has a fault.
class FaultySource final : public drivers::Source {
 public:
  FaultySource(std::shared_ptr<Remote> remote, std::shared_ptr<Fault> fault)
      : source_(std::move(remote)), fault_(std::move(fault)) {}
  [[nodiscard]] const drivers::SourceInfo& info() const override {
    return fault_->at("info"), source_.info();
  }
  [[nodiscard]] drivers::SourceState state() const override {
    return fault_->at("state"), drivers::SourceState{};
  }
  Result<> start() override { return fault_->at("start"), source_.start(); }
  void stop() override { return fault_->at("stop"), source_.stop(); }
  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    return fault_->at("next"), source_.next(std::move(stop), lockstep);
  }
  Result<> setParameter(std::string_view, double) override {
    return fault_->at("setParameter"), Result<>{};
  }

 private:
  test::FakeSource source_;
  std::shared_ptr<Fault> fault_;  // shared with the test, and with the source that is opened next
};

class AFaultyDriver : public testing::TestWithParam<std::tuple<const char*, bool>> {};
INSTANTIATE_TEST_SUITE_P(
    Throws, AFaultyDriver,
    testing::Combine(testing::Values("open", "info", "state", "start", "next", "stop", "setParameter"),
                     testing::Bool()),
    [](const auto& test) {
      return std::string{std::get<0>(test.param)} + (std::get<1>(test.param) ? "Std" : "NonStd");
    });

TEST_P(AFaultyDriver, NeitherKillsNorWedgesItsSource) {
  Rig rig;
  auto fault = std::make_shared<Fault>();
  fault->where = std::get<0>(GetParam());
  fault->is_standard = std::get<1>(GetParam());
  const auto open = [&]() -> Result<std::unique_ptr<drivers::Source>> {
    fault->at("open");
    return std::unique_ptr<drivers::Source>{std::make_unique<FaultySource>(rig.remote, fault)};
  };
  // As if it had not been there at first, so that each opening is the host's.
  rig.host = std::make_unique<SourceHost>("cam", open, Error{Error::Code::NotFound, "not there"},
                                          rig.options, rig.clock);
  const auto pass = [&] {  // the pause before the camera is opened again
    rig.clock.advance(std::chrono::milliseconds{2});
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  };
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds{30};
  const auto isLate = [&] { return std::chrono::steady_clock::now() > deadline; };
  while (!rig.host->describe().ok() && !isLate()) pass();
  const Result<> set =
      rig.command([](drivers::Source& source) { return source.setParameter("gain", 1); });
  EXPECT_EQ(set.ok(), fault->where != "setParameter");
  Taker taker;
  rig.host->unsubscribe(rig.subscribe(taker));  // starts and stops it, perhaps
  const auto subscriber = rig.subscribe(taker);
  rig.remote->give(2);
  int frames = 0;
  while (frames < 2 && !isLate()) {
    if (const auto item = subscriber->backlog.take()) {
      ASSERT_TRUE(std::holds_alternative<Backlog::Delivery>(*item)) << std::get<Error>(*item).message;
      ++frames;
    }
    pass();
  }
  EXPECT_EQ(frames, 2);
  rig.host->unsubscribe(subscriber);
  while (fault->is_due && !isLate()) pass();
  rig.host->requestStop();
  rig.host->waitForEnd();
  EXPECT_FALSE(fault->is_due) << "it never threw";
  const std::string error = set ? rig.host->health().last_error : set.error().message;
  EXPECT_NE(error.find("the driver threw "), std::string::npos) << error;
  EXPECT_EQ(error.find("oops") != std::string::npos, fault->is_standard) << error;
}

}  // namespace
}  // namespace toftwin::daemon
