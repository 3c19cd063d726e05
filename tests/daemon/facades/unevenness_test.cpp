// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/timing/unevenness.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <vector>

#include "daemon/facades/facade.h"
#include "daemon/facades/held_frames.h"
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

/// What the configuration says of a file with that in it, which is named relative to the configuration.
std::string complaintAbout(const std::string& content) {
  std::string folder = testing::TempDir() + "unevenXXXXXX";
  if (::mkdtemp(folder.data()) == nullptr) return "no folder";
  if (content != "none") std::ofstream{folder + "/i.txt"} << content;
  auto table = settings::Table::parse("intervals = 'i.txt'", folder + "/d.toml");
  FacadeKeys keys;
  table->read(keys);
  const Unevenness uneven = Unevenness::read(*table, keys.intervals);
  const auto checked = table->check();
  std::filesystem::remove_all(folder);
  EXPECT_EQ(uneven.isNone(), !checked.ok()) << content;
  return checked ? "" : checked.error().message;
}

TEST(Unevenness, WhatIsNoListOfIntervalsIsRefused) {
  using testing::HasSubstr;
  EXPECT_EQ(complaintAbout("50\n51.5\n"), "");
  EXPECT_THAT(complaintAbout("50\n0\n"), HasSubstr("i.txt: number 2 is no interval in milliseconds"));
  EXPECT_THAT(complaintAbout("600000\n"), HasSubstr("number 1 is no interval"));
  for (const char* other : {"", "50 ms\n", "interval\n50\n"})
    EXPECT_THAT(complaintAbout(other), HasSubstr("must have one interval in milliseconds per line")) << other;
  EXPECT_THAT(complaintAbout("none"), HasSubstr("i.txt cannot be read"));
}

TEST(HeldFrames, LeaveInOrderAndNotBeforeTheirTime) {
  using std::chrono::milliseconds;
  boost::asio::io_context io;
  const auto begin = std::chrono::steady_clock::now();
  std::vector<std::uint64_t> order;
  std::vector<milliseconds> least{milliseconds{10}, milliseconds{10}, milliseconds{20}};
  HeldFrames line{io, "test", [&](const Frame& frame) {
                    EXPECT_GE(std::chrono::steady_clock::now() - begin, least.at(frame.sequence));
                    order.push_back(frame.sequence);
                  }};
  std::uint64_t sequence = 0;
  for (const int leaves_ms : {10, 1, 20}) {  // the second waits for the first
    Frame frame;
    frame.sequence = sequence++;
    line.hold(frame, begin + milliseconds{leaves_ms});
  }
  EXPECT_TRUE(order.empty());
  io.run();
  EXPECT_EQ(order, (std::vector<std::uint64_t>{0, 1, 2}));
}

class WallAt final : public Clock {
 public:
  explicit WallAt(std::int64_t ns) : wall_{ns} {}
  [[nodiscard]] HostTime wall() const override { return wall_; }
  [[nodiscard]] SteadyTime steady() const override { return {}; }

 private:
  HostTime wall_;
};

TEST(HeldFrames, CountFromWhenTheDaemonHadThem) {
  using std::chrono::nanoseconds;
  Frame frame;
  frame.moment.received.ns = 5'000'000'000;
  for (const auto& [age_ns, counted_ns] : {std::pair{std::int64_t{0}, std::int64_t{0}},
                                           {30'000'000, 30'000'000},
                                           {1'000'000'000, 1'000'000'000},
                                           {1'000'000'001, 0},
                                           {-1, 0}}) {  // clocks that were set
    const auto before = std::chrono::steady_clock::now();
    const auto arrived = HeldFrames::arrivalOf(frame, WallAt{5'000'000'000 + age_ns});
    const auto after = std::chrono::steady_clock::now();
    EXPECT_GE(arrived, before - nanoseconds{counted_ns}) << age_ns;
    EXPECT_LE(arrived, after - nanoseconds{counted_ns}) << age_ns;
  }
}

TEST(HeldFrames, ThatAreClearedDoNotLeave) {
  boost::asio::io_context io;
  std::vector<std::uint64_t> order;
  HeldFrames line{io, "test", [&](const Frame& frame) { order.push_back(frame.sequence); }};
  Frame frame;
  line.hold(frame, std::chrono::steady_clock::now());
  line.clear();
  frame.sequence = 1;
  line.hold(frame, std::chrono::steady_clock::now());
  io.run();
  EXPECT_EQ(order, std::vector<std::uint64_t>{1});
}

/// Ten seconds of a small image at 100 Hz all wait; of 64 MB each, seven are less than half a gigabyte.
TEST(HeldFrames, AreBoundedByTheirBytes) {
  Plane large;
  large.data = Buffer::adopt(std::vector<std::byte>(64U << 20U));
  Frame heavy;
  heavy.planes = {large};
  for (const auto& [frame, taken, leave] : {std::tuple{Frame{}, 1000, 1000}, std::tuple{heavy, 10, 7}}) {
    boost::asio::io_context io;
    int left = 0;
    HeldFrames line{io, "test", [&](const Frame&) { ++left; }};
    const auto soon = std::chrono::steady_clock::now() + std::chrono::milliseconds{20};
    for (int i = 0; i < taken; ++i) line.hold(frame, soon);
    io.run();
    EXPECT_EQ(left, leave);
    line.hold(frame, soon);
    io.restart();
    io.run();
    EXPECT_EQ(left, leave + 1) << "those that left made room";
  }
}

}  // namespace
}  // namespace toftwin::daemon
