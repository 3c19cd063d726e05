// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/unevenness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <numeric>
#include <vector>

#include "measured_intervals.h"

namespace toftwin::daemon {
namespace {

// Evenly spaced frames that are held back so leave at the intervals that were measured on a real one.
TEST(Unevenness, GivesARealCamerasIntervals) {
  const auto file = test::measuredIntervals("libo3d3xx_jitter-2000-30-8.txt");
  if (file.empty()) GTEST_SKIP() << "no ifm-frame-timing in $TOFTWIN_DATA or ../shared/data";
  std::vector<double> intervals_ms;
  std::ifstream in{file};
  for (double ms = 0.0; in >> ms;) intervals_ms.push_back(ms);
  ASSERT_EQ(intervals_ms.size(), 1000u);
  const auto uneven = Unevenness::load(file);
  ASSERT_TRUE(uneven.ok()) << uneven.error().message;
  const double mean_ms = std::accumulate(intervals_ms.begin(), intervals_ms.end(), 0.0) / 1000.0;
  EXPECT_NEAR(mean_ms, 37.9, 0.05);
  const auto delay_ms = [&](std::size_t i) {
    return std::chrono::duration<double, std::milli>{uneven->delay(i)}.count();
  };
  double least_ms = delay_ms(0);
  for (std::size_t i = 0; i + 1 < 2000; ++i) {
    least_ms = std::min(least_ms, delay_ms(i));
    EXPECT_NEAR(mean_ms + delay_ms(i + 1) - delay_ms(i), intervals_ms[i % 1000], 1e-5)
        << i;  // whole nanoseconds
  }
  EXPECT_EQ(least_ms, 0.0) << "no frame leaves before it is there";
}

// In 1 + 21 ms the first is late by nothing, the second early by ten: it alone leaves at once.
TEST(UnevenFrames, LeaveInOrderAndNoneIsLost) {
  boost::asio::io_context io;
  std::vector<std::uint64_t> order;
  UnevenFrames line{io, "test", Unevenness{{std::chrono::milliseconds{1}, std::chrono::milliseconds{21}}},
                    0_s, [&](const Frame& frame) { order.push_back(frame.sequence); }};
  for (std::uint64_t i = 0; i < 6; ++i) {
    Frame frame;
    frame.sequence = i;
    line.take(frame);
  }
  EXPECT_TRUE(order.empty()) << "the first is held back by ten milliseconds, and those behind it with it";
  io.run();
  EXPECT_EQ(order, (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5}));
}

TEST(UnevenFrames, WithoutIntervalsTheyLeaveAtOnce) {
  boost::asio::io_context io;
  int left = 0;
  UnevenFrames line{io, "test", {}, 0_s, [&](const Frame&) { ++left; }};
  line.take({});
  EXPECT_EQ(left, 1);
}

TEST(UnevenFrames, WithALatencyTheyLeaveThatMuchLater) {
  boost::asio::io_context io;
  const auto begin = std::chrono::steady_clock::now();
  auto left = begin;
  UnevenFrames line{io, "test", {}, 20_ms, [&](const Frame&) { left = std::chrono::steady_clock::now(); }};
  line.take({});
  EXPECT_EQ(left, begin);
  io.run();
  EXPECT_GE(left - begin, std::chrono::milliseconds{20});
}

/// Ten seconds of a small image at 100 Hz all wait; of 64 MB each, seven are less than half a gigabyte.
TEST(UnevenFrames, ThatWaitAreBoundedByTheirBytes) {
  Plane large;
  large.data = Buffer::adopt(std::vector<std::byte>(64U << 20U));
  Frame heavy;
  heavy.planes = {large};
  for (const auto& [frame, taken, leave] : {std::tuple{Frame{}, 1000, 1000}, std::tuple{heavy, 10, 7}}) {
    boost::asio::io_context io;
    int left = 0;
    UnevenFrames line{io, "test", {}, 20_ms, [&](const Frame&) { ++left; }};
    for (int i = 0; i < taken; ++i) line.take(frame);
    io.run();
    EXPECT_EQ(left, leave);
    line.take(frame);
    io.restart();
    io.run();
    EXPECT_EQ(left, leave + 1) << "those that left make room";
  }
}

}  // namespace
}  // namespace toftwin::daemon
