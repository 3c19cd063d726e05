// SPDX-License-Identifier: Apache-2.0
#include "daemon/backlog.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "daemon/subscriber.h"
#include "fakes.h"
#include "tests/protocol/example_messages.h"

namespace toftwin::daemon {
namespace {

using wire::Policy;

PreparedFramePtr frameNumber(std::uint64_t sequence, std::uint64_t bytes = 64) {
  auto frame = std::make_shared<PreparedFrame>();
  frame->frame.sequence = sequence;
  frame->body.bytes = bytes;
  return frame;
}
const std::uint64_t kHeld = frameNumber(0)->heldBytes();
Backlog backlogWith(Backlog::Settings settings) {
  return {settings, [] {}};
}
Backlog::Delivery delivered(Backlog& backlog) {
  return std::get<Backlog::Delivery>(backlog.take().value());
}

TEST(Backlog, LatestKeepsTheNewestAndCountsTheRest) {
  Backlog backlog = backlogWith({.policy = Policy::Latest});
  for (std::uint64_t i = 0; i < 5; ++i) backlog.push(frameNumber(i));
  const auto first = delivered(backlog);
  EXPECT_EQ(first.frame->frame.sequence, 4u);
  EXPECT_EQ(first.dropped_before, 4u);
  EXPECT_FALSE(backlog.take().has_value());
  backlog.push(frameNumber(5));
  EXPECT_EQ(delivered(backlog).dropped_before, 0u);
}

TEST(Backlog, QueueDropsTheOldestAndCountsThemOnce) {
  Backlog backlog = backlogWith({.policy = Policy::Queue, .depth = 3});
  for (std::uint64_t i = 0; i < 5; ++i) backlog.push(frameNumber(i));
  auto next = delivered(backlog);
  EXPECT_EQ(next.frame->frame.sequence, 2u);
  EXPECT_EQ(next.dropped_before, 2u);
  for (std::uint64_t i = 5; i < 7; ++i) backlog.push(frameNumber(i));  // 3 4 5, then 6 drops 3
  next = delivered(backlog);
  EXPECT_EQ(next.frame->frame.sequence, 4u);
  EXPECT_EQ(next.dropped_before, 1u);
  EXPECT_EQ(delivered(backlog).dropped_before, 0u);
}

TEST(Backlog, LosslessEndsWithOverrunAtItsLimit) {
  Backlog backlog = backlogWith({.policy = Policy::Lossless, .byte_limit = 3 * kHeld, .keeps_at_overrun = true});
  for (std::uint64_t i = 0; i < 10; ++i) backlog.push(frameNumber(i));
  for (std::uint64_t i = 0; i < 3; ++i) {
    const auto next = delivered(backlog);
    EXPECT_EQ(next.frame->frame.sequence, i);
    EXPECT_EQ(next.dropped_before, 0u);
  }
  EXPECT_EQ(std::get<Error>(backlog.take().value()).code, Error::Code::Overrun);
  EXPECT_FALSE(backlog.take().has_value());
  EXPECT_FALSE(backlog.wants({}));
}

TEST(Backlog, TakingMakesRoomForALosslessSubscriber) {
  Backlog backlog = backlogWith({.policy = Policy::Lossless, .byte_limit = 2 * kHeld});
  for (std::uint64_t i = 0; i < 100; ++i) {
    backlog.push(frameNumber(i));
    EXPECT_EQ(delivered(backlog).frame->frame.sequence, i);
  }
  EXPECT_FALSE(backlog.hasEnded());
}

TEST(Backlog, QueueDropsTheOldestRatherThanHoldMoreThanItsBytes) {
  Backlog backlog = backlogWith({.policy = Policy::Queue, .depth = 1024, .byte_limit = 3 * kHeld});
  for (std::uint64_t i = 0; i < 10; ++i) {
    backlog.push(frameNumber(i));
    ASSERT_LE(backlog.heldBytes(), 3 * kHeld);
  }
  const auto next = delivered(backlog);
  EXPECT_EQ(next.frame->frame.sequence, 7u);
  EXPECT_EQ(next.dropped_before, 7u);
}

TEST(Backlog, AFrameThatIsTooLargeByItselfIsKeptUntilTheNext) {
  Backlog backlog = backlogWith({.policy = Policy::Queue, .depth = 1024, .byte_limit = kHeld});
  backlog.push(frameNumber(0, 1000));
  backlog.push(frameNumber(1, 1000));
  EXPECT_EQ(delivered(backlog).frame->frame.sequence, 1u);
  EXPECT_EQ(backlog.heldBytes(), 0u);
}

TEST(Backlog, AFrameThatALosslessSubscriberCanNeverHoldEndsItAndSaysSo) {
  const Backlog::Settings settings{.policy = Policy::Lossless, .byte_limit = 3ull << 20};
  EXPECT_TRUE(Backlog::checkHolds(settings, (3ull << 20) - 4096).ok());
  EXPECT_FALSE(Backlog::checkHolds(settings, 3ull << 20).ok());
  EXPECT_TRUE(Backlog::checkHolds({.policy = Policy::Queue, .byte_limit = 1}, 3ull << 20).ok());
  Backlog backlog = backlogWith(settings);
  backlog.push(frameNumber(0, 3ull << 20));
  const Error end = std::get<Error>(backlog.take().value());
  EXPECT_EQ(end.code, Error::Code::TooLarge);
  EXPECT_EQ(end.message.find("one frame takes 4 MB, and a lossless subscription or recording may hold 3"), 0u)
      << end.message;
}

struct Payers {
  std::shared_ptr<Budget> budget;
  explicit Payers(std::uint64_t limit, std::size_t shares = 2) : budget(std::make_shared<Budget>(limit, shares)) {}
  [[nodiscard]] std::shared_ptr<Account> account(std::uint64_t limit = 1ull << 40) const {
    return std::make_shared<Account>(budget, limit);
  }
};

Backlog::Settings paidBy(std::shared_ptr<Account> account, Policy policy, bool keeps = false) {
  return {.policy = policy, .depth = 100, .account = std::move(account), .keeps_at_overrun = keeps};
}

TEST(Backlog, OneClientLeavesTheShareOfAnother) {
  const Payers all{8 * kHeld};
  const auto greedy = all.account(), other = all.account();
  auto reserved = Backlog::reserve(paidBy(greedy, Policy::Queue), 64);
  ASSERT_TRUE(reserved.ok());
  EXPECT_EQ(all.budget->used(), 2 * kHeld);
  Backlog queue = backlogWith(paidBy(greedy, Policy::Queue));
  for (std::uint64_t i = 0; i < 20; ++i) queue.push(frameNumber(i));
  EXPECT_EQ(greedy->used(), 5 * kHeld) << "two for its share, and three of the other four: as many as are free, four times";
  EXPECT_EQ(queue.heldBytes(), 4 * kHeld) << "its reserved one and three more";
  EXPECT_FALSE(Backlog::reserve(paidBy(greedy, Policy::Queue), 64).ok());
  EXPECT_TRUE(Backlog::reserve(paidBy(other, Policy::Queue), 64).ok());
  EXPECT_EQ(delivered(queue).dropped_before, 16u);
  while (queue.take()) continue;
  EXPECT_EQ(all.budget->used(), 2 * kHeld);
  *reserved = Share{};
  EXPECT_EQ(all.budget->used(), 0u);
}

TEST(Backlog, ARefusedReservationNamesTheLimitInTheWay) {
  const Payers all{10 * kHeld};
  const auto refusal = [&](std::uint64_t limit) {
    return Backlog::reserve(paidBy(all.account(limit), Policy::Queue), 5 * kHeld).error();
  };
  EXPECT_EQ(refusal(1ull << 40).code, Error::Code::Busy);
  EXPECT_NE(refusal(1ull << 40).message.find("limits.backlog_mb"), std::string::npos);
  EXPECT_NE(refusal(kHeld).message.find("limits.session_backlog_mb"), std::string::npos);
}

TEST(Backlog, AFrameThatWaitsForSeveralSubscriptionsOfAClientCountsOnce) {
  const Payers all{100 * kHeld};
  const auto mine = all.account(), other = all.account();
  Backlog one = backlogWith(paidBy(mine, Policy::Queue)), two = backlogWith(paidBy(mine, Policy::Lossless));
  Backlog others = backlogWith(paidBy(other, Policy::Queue));
  for (std::uint64_t i = 0; i < 4; ++i) {
    const auto frame = frameNumber(i);
    for (Backlog* backlog : {&one, &two, &others}) backlog->push(frame);
  }
  EXPECT_EQ(mine->used(), 3 * kHeld) << "all but the oldest";
  EXPECT_EQ(other->used(), 3 * kHeld);
  EXPECT_EQ(all.budget->used(), 3 * kHeld);
  while (one.take()) continue;
  EXPECT_EQ(mine->used(), 3 * kHeld) << "the other subscription has them still";
  while (two.take()) continue;
  EXPECT_EQ(mine->used(), 0u);
  EXPECT_EQ(all.budget->used(), 3 * kHeld);
}

TEST(Backlog, PlanesThatFramesOfTwoSelectionsHaveInCommonCountOnce) {
  const Payers all{1ull << 30};
  const auto account = all.account();
  const Plane shared = toPlane(PlaneKind::Range, Image<float>{64, 64});
  const auto framed = [&] {
    auto frame = std::make_shared<PreparedFrame>();
    frame->frame.planes = {shared};
    frame->body = wire::layOutBody(frame->frame.planes);
    return frame;
  };
  const PreparedFramePtr whole = framed(), again = framed();
  const auto first = Hold::of(account, whole);
  const std::uint64_t alone = account->used();
  EXPECT_EQ(alone, whole->heldBytes());
  const auto second = Hold::of(account, again);
  EXPECT_EQ(account->used(), alone + again->heldBytes() - 64 * 64 * sizeof(float));
}

TEST(Backlog, ALosslessSubscriptionThatOverranGivesItsMemoryBackAndSaysSoAtOnce) {
  const Payers all{8 * kHeld};
  const auto account = all.account();
  int woken = 0;
  Backlog backlog{paidBy(account, Policy::Lossless), [&] { ++woken; }};
  for (std::uint64_t i = 0; i < 20; ++i) backlog.push(frameNumber(i));
  EXPECT_EQ(account->used(), 0u);
  EXPECT_EQ(backlog.heldBytes(), 0u);
  EXPECT_EQ(woken, 2) << "for the first frame, and for the end";
  const Error end = std::get<Error>(backlog.take().value());
  EXPECT_EQ(end.code, Error::Code::Overrun);
  EXPECT_NE(end.message.find("limits.backlog_mb"), std::string::npos) << end.message;
}

TEST(Backlog, ARecorderThatOverranStillGetsWhatWaited) {
  const Payers all{8 * kHeld};
  Backlog backlog = backlogWith(paidBy(all.account(), Policy::Lossless, true));
  for (std::uint64_t i = 0; i < 20; ++i) backlog.push(frameNumber(i));
  for (std::uint64_t i = 0; i < 6; ++i) EXPECT_EQ(delivered(backlog).frame->frame.sequence, i);
  EXPECT_EQ(std::get<Error>(backlog.take().value()).code, Error::Code::Overrun);
}

TEST(Account, WhateverManyTakeTheNextHasItsShare) {
  constexpr std::uint64_t kLimit = 1'000'000, kShares = 64;
  const Payers all{kLimit, kShares};
  std::vector<std::shared_ptr<Account>> greedy;
  for (std::uint64_t i = 0; i + 1 < kShares; ++i) {
    greedy.push_back(all.account());
    for (const auto& one : greedy) {
      while (one->take(100)) continue;
    }
  }
  const auto next = all.account();
  EXPECT_TRUE(next->take(kLimit / (2 * kShares)));
  EXPECT_LE(all.budget->used(), kLimit);
  EXPECT_GT(greedy.front()->used(), 10 * next->used()) << "who was first has much of the common half";
}

TEST(Backlog, NeverHoldsMoreThanOneFrameUnderLockstep) {
  Backlog backlog = backlogWith({.policy = Policy::Lockstep});
  for (std::uint64_t i = 0; i < 3; ++i) backlog.push(frameNumber(i));
  EXPECT_EQ(backlog.heldBytes(), kHeld);
  EXPECT_EQ(delivered(backlog).frame->frame.sequence, 2u);
}

TEST(FanOut, WhatOneSelectionCannotHaveReachesTheOthers) {
  Frame frame;
  frame.camera.width = 4;
  frame.camera.height = 2;
  frame.camera.fx = frame.camera.fy = 4;
  frame.moment.exposures = {{{1}, 1_ms, 80_MHz}};
  frame.planes = {toPlane(PlaneKind::Flags, Image<std::uint8_t>{3, 2}),  // not the camera's size
                  toPlane(PlaneKind::Range, Image<float>{4, 2})};
  test::Taker taker;
  const auto wanting = [&](PlaneKind kind) {
    return std::make_shared<Subscriber>(Wish{{.planes = {kind}, .region = {}}, {}}, taker.wake());
  };
  const auto broken = wanting(PlaneKind::Flags), whole = wanting(PlaneKind::Range);
  fanOut(frame, {broken, whole});
  EXPECT_EQ(std::get<Error>(broken->backlog.take().value()).code, Error::Code::Internal);
  EXPECT_EQ(delivered(whole->backlog).frame->frame.planes.size(), 1u);
}

TEST(FanOut, AFrameThatNoMessageCanHoldEndsItsSubscriptionsAndSaysWhy) {
  Frame frame;
  frame.camera.width = frame.camera.height = 8192;
  frame.camera.fx = frame.camera.fy = 4;
  const Plane range{PlaneKind::Range, ElementType::F32, 8192, 8192, 1, wire::zeros(4ull * 8192 * 8192)};
  const Plane flags{PlaneKind::Flags, ElementType::U8, 8192, 8192, 1, wire::zeros(8192ull * 8192)};
  frame.planes = {range, flags};
  test::Taker taker;
  const auto all = std::make_shared<Subscriber>(Wish{}, taker.wake());
  const auto few = std::make_shared<Subscriber>(Wish{{.planes = {PlaneKind::Flags}, .region = {}}, {}},
                                                taker.wake());
  fanOut(frame, {all, few});
  const Error end = std::get<Error>(all->backlog.take().value());
  EXPECT_EQ(end.code, Error::Code::TooLarge);
  EXPECT_NE(end.message.find("one frame has 320 MiB"), std::string::npos) << end.message;
  EXPECT_EQ(delivered(few->backlog).frame->frame.planes.size(), 1u);
}

TEST(Backlog, EmptyFramesCountToo) {
  EXPECT_GT(frameNumber(0, 0)->heldBytes(), sizeof(PreparedFrame));
}

TEST(PreparedFrame, IsInSharedMemoryUntilTheFrameAfterItIsSent) {
  const std::vector<std::byte> bytes(100'000, std::byte{7});
  transport::SharedBodies maker;
  const auto sendAnother = [&] {
    PreparedFrame frame;
    frame.body = {.pieces = {Buffer::adopt(bytes)}, .bytes = bytes.size(), .crc32c = 0};
    std::weak_ptr<const transport::SharedBody> sent = frame.sharedBody(maker);
    EXPECT_FALSE(sent.expired());
    EXPECT_EQ(frame.sharedBody(maker), sent.lock()) << "made again for a subscriber that comes when others have it";
    return sent;
  };
  const auto first = sendAnother();
  const auto soon = std::chrono::steady_clock::now() + std::chrono::seconds{20};
  while (!first.expired() && std::chrono::steady_clock::now() < soon) {
    std::this_thread::sleep_for(transport::SharedBodies::kLater);
    sendAnother();
  }
  EXPECT_TRUE(first.expired()) << "held for nobody";
}

TEST(PreparedFrame, OfWhichManyAreSentAtOnceFewAreKept) {
  const std::vector<std::byte> bytes(100'000, std::byte{7});
  transport::SharedBodies maker;
  std::vector<std::weak_ptr<const transport::SharedBody>> sent;
  for (int i = 0; i < 50; ++i) {
    PreparedFrame frame;
    frame.body = {.pieces = {Buffer::adopt(bytes)}, .bytes = bytes.size(), .crc32c = 0};
    sent.push_back(frame.sharedBody(maker));
  }
  const auto expired = std::ranges::count_if(sent, [](const auto& one) { return one.expired(); });
  EXPECT_GE(expired, 50 - static_cast<long>(transport::SharedBodies::kMostKept));
}

TEST(PreparedFrame, IsSummedOnceWhoeverAsksFirst) {
  PreparedFrame frame;
  std::vector<std::byte> bytes(100'000, std::byte{7});
  frame.body = {.pieces = {Buffer{nullptr, bytes}}, .bytes = bytes.size(), .crc32c = 0};
  const std::uint32_t sum = wire::crc32cOf(frame.body);
  {
    std::vector<std::jthread> askers;
    for (int i = 0; i < 4; ++i) {
      askers.emplace_back([&] { EXPECT_EQ(frame.summedBody().crc32c, sum); });
    }
  }
  bytes[0] = std::byte{8};  // nobody does, but it shows whether the sum is computed again
  EXPECT_EQ(frame.summedBody().crc32c, sum);
}

TEST(Backlog, TheFirstReasonOfAnEndCounts) {
  Backlog backlog = backlogWith({});
  backlog.end({Error::Code::EndOfStream, "first"});
  backlog.end({Error::Code::Stopped, "second"});
  backlog.push(frameNumber(0));
  EXPECT_EQ(std::get<Error>(backlog.take().value()).message, "first");
  EXPECT_FALSE(backlog.take().has_value());
}

TEST(Backlog, WakesOnlyWhenThereWasNothing) {
  int woken = 0;
  Backlog backlog{{.policy = Policy::Queue, .depth = 3}, [&] { ++woken; }};
  backlog.push(frameNumber(0));
  backlog.push(frameNumber(1));
  EXPECT_EQ(woken, 1);
  delivered(backlog);
  delivered(backlog);
  backlog.push(frameNumber(2));
  EXPECT_EQ(woken, 2);
}

/// Takes `hz` of a source with `source_hz` for ten seconds; gives how many it took.
int takenInTenSeconds(double hz, double source_hz, std::chrono::nanoseconds jitter) {
  Backlog backlog = backlogWith({.max_rate_hz = hz});
  int taken = 0;
  for (int i = 0; i < static_cast<int>(10 * source_hz); ++i) {
    const auto at = std::chrono::nanoseconds{static_cast<std::int64_t>(1e9 * i / source_hz)};
    if (backlog.wants(SteadyTime{} + std::chrono::seconds{1} + at + (i % 2 == 0 ? jitter : -jitter)))
      ++taken;
  }
  return taken;
}

TEST(Backlog, RateIsKeptOnTheMeanAndUnderJitter) {
  using std::chrono::milliseconds;
  EXPECT_EQ(takenInTenSeconds(10, 30, milliseconds{0}), 100);
  EXPECT_EQ(takenInTenSeconds(10, 30, milliseconds{2}), 100);
  EXPECT_EQ(takenInTenSeconds(7, 30, milliseconds{0}), 70);
  EXPECT_EQ(takenInTenSeconds(100, 30, milliseconds{0}), 300);
  EXPECT_EQ(takenInTenSeconds(0, 30, milliseconds{0}), 300);
}

TEST(Backlog, ARateIsNotCaughtUpAfterAPause) {
  Backlog backlog = backlogWith({.max_rate_hz = 10});
  const SteadyTime start{};
  EXPECT_TRUE(backlog.wants(start));
  EXPECT_TRUE(backlog.wants(start + std::chrono::seconds{5}));
  EXPECT_FALSE(backlog.wants(start + std::chrono::seconds{5} + std::chrono::milliseconds{50}));
}

}  // namespace
}  // namespace toftwin::daemon
