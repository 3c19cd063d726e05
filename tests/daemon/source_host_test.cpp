// SPDX-License-Identifier: Apache-2.0
#include "daemon/source_host.h"

#include <gtest/gtest.h>

#include <future>

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
                              .first_retry = std::chrono::milliseconds{1},
                              .longest_retry = std::chrono::milliseconds{1}};

  void start() {
    const auto open = test::opener(remote);
    host = std::make_unique<SourceHost>("cam", open, open(), options, clock);
  }
  SubscriberPtr subscribe(Taker& taker,
                          FrameQueue::Settings queue = {.policy = Policy::Queue, .depth = 100}) {
    auto subscribed = host->subscribe({{}, queue}, taker.wake());
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
    const auto item = taker.next(subscriber->queue);
    ASSERT_TRUE(item.has_value());
    const Frame& frame = std::get<FrameQueue::Delivery>(*item).frame->frame;
    EXPECT_EQ(frame.sequence, static_cast<std::uint64_t>(i));
    EXPECT_EQ(frame.source, "cam");
    EXPECT_EQ(frame.moment.received, rig.clock.wall());
  }
  EXPECT_EQ(rig.host->health().frames, 3u);
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
  const auto of_a = std::get<FrameQueue::Delivery>(*taker.next(a->queue)).frame;
  const auto of_b = std::get<FrameQueue::Delivery>(*taker.next(b->queue)).frame;
  const auto of_c = std::get<FrameQueue::Delivery>(*taker.next((*c)->queue)).frame;
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
  ASSERT_EQ(one.nextSequence(first->queue), 0);
  ASSERT_EQ(free.nextSequence(other->queue), 0);
  ASSERT_EQ(two.nextSequence(second->queue), 0);
  rig.host->acknowledge(first, 0);
  rig.host->acknowledge(first, 0);  // saying it twice is not both of them
  // A command is done between frames: after it, a frame that was due would have been made.
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(rig.command([](auto&) { return Result<>{}; }).ok());
  EXPECT_FALSE(first->queue.take().has_value()) << "a frame was made before all acknowledged";
  rig.host->acknowledge(second, 0);
  EXPECT_EQ(one.nextSequence(first->queue), 1);
  EXPECT_EQ(two.nextSequence(second->queue), 1);
  EXPECT_EQ(free.nextSequence(other->queue), 1);
}

TEST(SourceHost, ALockstepSubscriberThatVanishesHoldsNobodyUp) {
  Rig rig;
  rig.start();
  Taker one, two;
  const auto first = rig.subscribe(one, {.policy = Policy::Lockstep});
  const auto second = rig.subscribe(two, {.policy = Policy::Lockstep});
  rig.remote->give(2);
  ASSERT_EQ(one.nextSequence(first->queue), 0);
  rig.host->acknowledge(first, 0);
  rig.host->unsubscribe(second);
  EXPECT_EQ(one.nextSequence(first->queue), 1);
}

TEST(SourceHost, APoseUnderLockstepIsThatOfTheNextFrame) {
  Rig rig;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker, {.policy = Policy::Lockstep});
  rig.remote->give(2);
  ASSERT_EQ(taker.nextSequence(subscriber->queue), 0);
  const Transform<World, Camera> pose{{1, 0, 0, 0}, {0, 0, 3}};
  ASSERT_TRUE(rig.command([&](drivers::Source& source) { return source.setPose(pose); }).ok());
  rig.host->acknowledge(subscriber, 0);
  const auto item = taker.next(subscriber->queue);
  ASSERT_TRUE(item.has_value());
  EXPECT_EQ(std::get<FrameQueue::Delivery>(*item).frame->frame.moment.world_from_camera, pose);
}

TEST(SourceHost, OpensALostCameraAgainAndKeepsItsSubscribers) {
  Rig rig;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker);
  rig.remote->give();
  ASSERT_EQ(taker.nextSequence(subscriber->queue), 0);
  rig.remote->give({Error::Code::Disconnected, "unplugged"});
  // The clock stands still, so the back-off is not over until the test says so.
  while (rig.host->health().reconnects == 0) std::this_thread::yield();
  EXPECT_EQ(rig.remote->opened.count(), 1);
  EXPECT_EQ(rig.host->health().last_error, "unplugged");
  rig.clock.advance(std::chrono::milliseconds{2});
  ASSERT_TRUE(rig.remote->opened.reaches(2));
  rig.remote->give();
  EXPECT_EQ(taker.nextSequence(subscriber->queue), 1);
  EXPECT_EQ(rig.host->health().reconnects, 1u);
}

TEST(SourceHost, EndsItsSubscriptionsWithTheStreamAndStartsAnewForTheNext) {
  Rig rig;
  rig.options.always = true;
  rig.start();
  Taker taker;
  const auto subscriber = rig.subscribe(taker);
  rig.remote->give();
  rig.remote->give({Error::Code::EndOfStream, "the end"});
  ASSERT_EQ(taker.nextSequence(subscriber->queue), 0);
  const auto end = taker.next(subscriber->queue);
  EXPECT_EQ(std::get<Error>(end.value()).code, Error::Code::EndOfStream);
  const auto again = rig.subscribe(taker);
  rig.remote->give();
  EXPECT_EQ(taker.nextSequence(again->queue), 1);
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
  const auto end = early.next(first->queue);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(std::get<Error>(*end).code, Error::Code::EndOfStream);
  ASSERT_TRUE(rig.remote->started.reaches(2));
  rig.remote->give();
  EXPECT_EQ(late.nextSequence(second->queue), 0);
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
  EXPECT_EQ(taker.nextSequence(subscriber->queue), 0);
  EXPECT_EQ(rig.host->health().reconnects, 0u);
}

TEST(SourceHost, WhatGoesWrongWithOneSubscriberIsNobodyElsesMatter) {
  Rig rig;
  rig.start();
  Taker taker;
  auto broken = rig.host->subscribe({{}, {}}, [] { throw std::bad_alloc{}; });
  ASSERT_TRUE(broken.ok());
  const auto other = rig.subscribe(taker);
  rig.remote->give(2);
  EXPECT_EQ(taker.nextSequence(other->queue), 0);
  EXPECT_EQ(taker.nextSequence(other->queue), 1);
  EXPECT_TRUE((*broken)->queue.hasEnded());
}

TEST(SourceHost, ADriverThatThrowsIsOpenedAgain) {
  Rig rig;
  rig.start();
  const auto thrown =
      rig.command([](drivers::Source&) -> Result<> { throw std::runtime_error{"oops"}; });
  ASSERT_FALSE(thrown.ok());
  EXPECT_NE(thrown.error().message.find("oops"), std::string::npos);
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
  EXPECT_EQ(std::get<Error>(taker.next(subscriber->queue).value()).code, Error::Code::Stopped);
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

}  // namespace
}  // namespace toftwin::daemon
