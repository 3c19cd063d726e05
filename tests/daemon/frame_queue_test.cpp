// SPDX-License-Identifier: Apache-2.0
#include "daemon/frame_queue.h"

#include <gtest/gtest.h>

#include "fakes.h"

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
FrameQueue queueWith(FrameQueue::Settings settings) {
  return {settings, [] {}};
}
FrameQueue::Delivery delivered(FrameQueue& queue) {
  return std::get<FrameQueue::Delivery>(queue.take().value());
}

TEST(FrameQueue, LatestKeepsTheNewestAndCountsTheRest) {
  FrameQueue queue = queueWith({.policy = Policy::Latest});
  for (std::uint64_t i = 0; i < 5; ++i) queue.push(frameNumber(i));
  const auto first = delivered(queue);
  EXPECT_EQ(first.frame->frame.sequence, 4u);
  EXPECT_EQ(first.dropped_before, 4u);
  EXPECT_FALSE(queue.take().has_value());
  queue.push(frameNumber(5));
  EXPECT_EQ(delivered(queue).dropped_before, 0u);
}

TEST(FrameQueue, QueueDropsTheOldestAndCountsThemOnce) {
  FrameQueue queue = queueWith({.policy = Policy::Queue, .depth = 3});
  for (std::uint64_t i = 0; i < 5; ++i) queue.push(frameNumber(i));
  auto next = delivered(queue);
  EXPECT_EQ(next.frame->frame.sequence, 2u);
  EXPECT_EQ(next.dropped_before, 2u);
  for (std::uint64_t i = 5; i < 7; ++i) queue.push(frameNumber(i));  // 3 4 5, then 6 drops 3
  next = delivered(queue);
  EXPECT_EQ(next.frame->frame.sequence, 4u);
  EXPECT_EQ(next.dropped_before, 1u);
  EXPECT_EQ(delivered(queue).dropped_before, 0u);
}

TEST(FrameQueue, LosslessEndsWithOverrunAfterAllThatWaited) {
  FrameQueue queue = queueWith({.policy = Policy::Lossless, .byte_limit = 3 * kHeld});
  for (std::uint64_t i = 0; i < 10; ++i) queue.push(frameNumber(i));
  for (std::uint64_t i = 0; i < 3; ++i) {
    const auto next = delivered(queue);
    EXPECT_EQ(next.frame->frame.sequence, i);
    EXPECT_EQ(next.dropped_before, 0u);
  }
  EXPECT_EQ(std::get<Error>(queue.take().value()).code, Error::Code::Overrun);
  EXPECT_FALSE(queue.take().has_value());
  EXPECT_FALSE(queue.wants({}));
}

TEST(FrameQueue, TakingMakesRoomForALosslessSubscriber) {
  FrameQueue queue = queueWith({.policy = Policy::Lossless, .byte_limit = 2 * kHeld});
  for (std::uint64_t i = 0; i < 100; ++i) {
    queue.push(frameNumber(i));
    EXPECT_EQ(delivered(queue).frame->frame.sequence, i);
  }
  EXPECT_FALSE(queue.hasEnded());
}

TEST(FrameQueue, QueueDropsTheOldestRatherThanHoldMoreThanItsBytes) {
  FrameQueue queue = queueWith({.policy = Policy::Queue, .depth = 1024, .byte_limit = 3 * kHeld});
  for (std::uint64_t i = 0; i < 10; ++i) {
    queue.push(frameNumber(i));
    ASSERT_LE(queue.heldBytes(), 3 * kHeld);
  }
  const auto next = delivered(queue);
  EXPECT_EQ(next.frame->frame.sequence, 7u);
  EXPECT_EQ(next.dropped_before, 7u);
}

TEST(FrameQueue, AFrameThatIsTooLargeByItselfIsKeptUntilTheNext) {
  FrameQueue queue = queueWith({.policy = Policy::Queue, .depth = 1024, .byte_limit = kHeld});
  queue.push(frameNumber(0, 1000));
  queue.push(frameNumber(1, 1000));
  EXPECT_EQ(delivered(queue).frame->frame.sequence, 1u);
  EXPECT_EQ(queue.heldBytes(), 0u);
}

TEST(FrameQueue, NeverHoldsMoreThanOneFrameUnderLockstep) {
  FrameQueue queue = queueWith({.policy = Policy::Lockstep});
  for (std::uint64_t i = 0; i < 3; ++i) queue.push(frameNumber(i));
  EXPECT_EQ(queue.heldBytes(), kHeld);
  EXPECT_EQ(delivered(queue).frame->frame.sequence, 2u);
}

TEST(FrameQueue, EmptyFramesCountToo) {
  EXPECT_GT(frameNumber(0, 0)->heldBytes(), sizeof(PreparedFrame));
}

TEST(PreparedFrame, IsInSharedMemoryOnlyWhileItIsBeingSent) {
  PreparedFrame frame;
  const std::vector<std::byte> bytes(100'000, std::byte{7});
  frame.body = {.pieces = {Buffer::adopt(bytes)}, .bytes = bytes.size(), .crc32c = 0};
  auto one = frame.sharedBody();
  ASSERT_NE(one, nullptr);
  EXPECT_EQ(frame.sharedBody(), one) << "subscribers that are sent it together share it";
  const std::weak_ptr<const transport::SharedBody> gone = one;
  one.reset();
  EXPECT_TRUE(gone.expired());
  EXPECT_NE(frame.sharedBody(), nullptr);
}

TEST(FrameQueue, TheFirstReasonOfAnEndCounts) {
  FrameQueue queue = queueWith({});
  queue.end({Error::Code::EndOfStream, "first"});
  queue.end({Error::Code::Stopped, "second"});
  queue.push(frameNumber(0));
  EXPECT_EQ(std::get<Error>(queue.take().value()).message, "first");
  EXPECT_FALSE(queue.take().has_value());
}

TEST(FrameQueue, WakesOnlyWhenThereWasNothing) {
  int woken = 0;
  FrameQueue queue{{.policy = Policy::Queue, .depth = 3}, [&] { ++woken; }};
  queue.push(frameNumber(0));
  queue.push(frameNumber(1));
  EXPECT_EQ(woken, 1);
  delivered(queue);
  delivered(queue);
  queue.push(frameNumber(2));
  EXPECT_EQ(woken, 2);
}

/// Takes `hz` of a source with `source_hz` for ten seconds; gives how many it took.
int takenInTenSeconds(double hz, double source_hz, std::chrono::nanoseconds jitter) {
  FrameQueue queue = queueWith({.max_rate_hz = hz});
  int taken = 0;
  for (int i = 0; i < static_cast<int>(10 * source_hz); ++i) {
    const auto at = std::chrono::nanoseconds{static_cast<std::int64_t>(1e9 * i / source_hz)};
    if (queue.wants(SteadyTime{} + std::chrono::seconds{1} + at + (i % 2 == 0 ? jitter : -jitter)))
      ++taken;
  }
  return taken;
}

TEST(FrameQueue, RateIsKeptOnTheMeanAndUnderJitter) {
  using std::chrono::milliseconds;
  EXPECT_EQ(takenInTenSeconds(10, 30, milliseconds{0}), 100);
  EXPECT_EQ(takenInTenSeconds(10, 30, milliseconds{2}), 100);
  EXPECT_EQ(takenInTenSeconds(7, 30, milliseconds{0}), 70);
  EXPECT_EQ(takenInTenSeconds(100, 30, milliseconds{0}), 300);
  EXPECT_EQ(takenInTenSeconds(0, 30, milliseconds{0}), 300);
}

TEST(FrameQueue, ARateIsNotCaughtUpAfterAPause) {
  FrameQueue queue = queueWith({.max_rate_hz = 10});
  const SteadyTime start{};
  EXPECT_TRUE(queue.wants(start));
  EXPECT_TRUE(queue.wants(start + std::chrono::seconds{5}));
  EXPECT_FALSE(queue.wants(start + std::chrono::seconds{5} + std::chrono::milliseconds{50}));
}

}  // namespace
}  // namespace toftwin::daemon
