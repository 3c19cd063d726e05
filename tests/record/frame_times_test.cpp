// SPDX-License-Identifier: Apache-2.0
#include "protocol/record/frame_times.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace toftwin::record {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000, kInterval_ns = kSecond_ns / 10, kToday_ns = 1'795'940'000 * kSecond_ns;

/// Frames ten times a second by both clocks.
std::vector<FrameTimes> evenFrames(std::size_t count) {
  std::vector<FrameTimes> frames;
  for (std::size_t i = 0; i < count; ++i) {
    const auto passed = static_cast<std::int64_t>(i) * kInterval_ns;
    frames.push_back({.device_ns = 5 * kSecond_ns + passed, .received_ns = kToday_ns + passed});
  }
  return frames;
}

TEST(RecordedTime, IsWhatPassedThoughTheHostsClockIsSetByDecades) {
  auto frames = evenFrames(60);
  for (std::size_t i = 0; i < 25; ++i) frames[i].received_ns -= kToday_ns - 30 * kSecond_ns;
  const RecordedTime time = recordedTime(frames);
  EXPECT_EQ(time.length_ns, 59 * kInterval_ns);
  ASSERT_EQ(time.jumps.size(), 1u);
  EXPECT_EQ(time.jumps[0].clock, Jumped::Host);
  EXPECT_EQ(time.jumps[0].frame, 25u);
  EXPECT_EQ(time.jumps[0].by_ns, kToday_ns - 30 * kSecond_ns);
}

TEST(RecordedTime, IsWhatPassedThoughTheDevicesClockBeginsAnew) {
  auto frames = evenFrames(60);
  for (std::size_t i = 40; i < 60; ++i) *frames[i].device_ns -= 9 * kSecond_ns;
  const RecordedTime time = recordedTime(frames);
  EXPECT_EQ(time.length_ns, 59 * kInterval_ns);
  ASSERT_EQ(time.jumps.size(), 1u);
  EXPECT_EQ(time.jumps[0].clock, Jumped::Device);
  EXPECT_EQ(time.jumps[0].by_ns, -9 * kSecond_ns);
}

TEST(RecordedTime, ADelayOnTheWayIsNoJump) {
  auto frames = evenFrames(60);
  for (std::size_t i = 20; i < 50; ++i) frames[i].received_ns = std::max(frames[i].received_ns, frames[50].received_ns);
  const RecordedTime time = recordedTime(frames);
  EXPECT_EQ(time.length_ns, 59 * kInterval_ns);
  EXPECT_TRUE(time.jumps.empty());
}

TEST(RecordedTime, APauseThatBothClocksTellIsTimeThatPassed) {
  auto frames = evenFrames(20);
  for (std::size_t i = 10; i < 20; ++i) {
    frames[i].received_ns += 7'200 * kSecond_ns;
    *frames[i].device_ns += 7'200 * kSecond_ns;
  }
  const RecordedTime time = recordedTime(frames);
  EXPECT_EQ(time.length_ns, 19 * kInterval_ns + 7'200 * kSecond_ns);
  EXPECT_EQ(time.longest_gap_ns, kInterval_ns + 7'200 * kSecond_ns);
  EXPECT_TRUE(time.jumps.empty());
}

TEST(RecordedTime, WithoutADevicesClockIsTheHostsUnlessThatJumps) {
  auto frames = evenFrames(20);
  for (FrameTimes& frame : frames) frame.device_ns.reset();
  EXPECT_EQ(recordedTime(frames).length_ns, 19 * kInterval_ns);
  for (std::size_t i = 10; i < 20; ++i) frames[i].received_ns -= 3'600 * kSecond_ns;
  const RecordedTime time = recordedTime(frames);
  EXPECT_EQ(time.length_ns, 19 * kInterval_ns) << "the usual interval stands for the one that is not known";
  ASSERT_EQ(time.jumps.size(), 1u);
  EXPECT_EQ(time.jumps[0].by_ns, -3'600 * kSecond_ns);
}

TEST(RecordedTime, AtTheEndsOfWhatCanBeExpressedDoesNotOverflow) {
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max(), kLeast = std::numeric_limits<std::int64_t>::min();
  for (const std::int64_t first : {kMost, kLeast, std::int64_t{0}}) {
    for (const std::int64_t second : {kMost, kLeast, std::int64_t{0}}) {
      const std::vector<FrameTimes> frames{{first, second}, {second, first}, {first, first}};
      EXPECT_GE(recordedTime(frames).length_ns, 0);
    }
  }
}

}  // namespace
}  // namespace toftwin::record
