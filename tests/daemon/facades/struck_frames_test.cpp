// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "daemon/facades/struck_frames.h"

namespace toftwin::daemon {
namespace {

Frame numbered(std::uint64_t sequence) {
  Frame frame;
  frame.sequence = sequence;
  return frame;
}

/// What leaves of `count` frames, in the order in which it does, and the log.
struct Struck {
  explicit Struck(const LineShares& shares, std::uint64_t count = 1000, bool is_there = true) {
    const auto log =
        std::filesystem::temp_directory_path() / ("struck_frames_" + std::to_string(::getpid()) + ".csv");
    {
      boost::asio::io_context io;
      StruckFrames line{io, LineFaults{shares, "test", log}, 1_ms,
                        [&](const Frame& frame, const Damage& damage) {
                          order.push_back(frame.sequence);
                          std::array<std::byte, 4> bytes{};
                          damage.corrupt(bytes);
                          int differ = 0;
                          for (const std::byte one : bytes)
                            differ += std::popcount(std::to_integer<unsigned>(one));
                          bits_changed.push_back(differ);
                          cuts += damage.is_cut ? 1 : 0;
                          return is_there;
                        }};
      for (std::uint64_t i = 0; i < count; ++i) line.take(numbered(i));
      before_later = order.size();
      io.run();
    }
    std::ifstream file{log};
    for (std::string text; std::getline(file, text);) {
      const auto first = text.find(','), second = text.rfind(',');
      if (text == "packet,kind,what") continue;
      EXPECT_EQ(text.substr(second), ",frame " + text.substr(0, first));
      logged[text.substr(first + 1, second - first - 1)].insert(std::stoull(text));
    }
    std::filesystem::remove(log);
  }
  std::vector<std::uint64_t> order;
  std::vector<int> bits_changed;  ///< of each that left
  int cuts = 0;
  std::size_t before_later = 0;
  std::map<std::string, std::set<std::uint64_t>> logged;  ///< the frames of each kind
};

TEST(StruckFrames, WithoutFaultsAllLeaveInOrder) {
  const Struck all{{}, 10};
  EXPECT_THAT(all.order, testing::ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
}

// 1000 frames at a share of 0.1 are 100 with a deviation of 9.5; the chance is a function of the seed, so
// this one is met or not for ever.
TEST(StruckFrames, LossAndDuplicatesAreThoseOfTheLog) {
  const Struck lossy{{.loss = 0.1, .seed = 5}};
  EXPECT_NEAR(static_cast<double>(lossy.logged.at("loss").size()), 100, 40);
  EXPECT_EQ(lossy.order.size(), 1000u - lossy.logged.at("loss").size());
  const Struck doubled{{.duplicate = 0.1, .seed = 5}};
  EXPECT_EQ(doubled.order.size(), 1000u + doubled.logged.at("duplicate").size());
  const Struck again{{.loss = 0.1, .seed = 5}};
  EXPECT_EQ(lossy.order, again.order) << "the same seed, the same frames";
}

TEST(StruckFrames, AReorderedOneLeavesAfterTheNext) {
  const Struck all{{.reorder = 1.0, .seed = 1}, 4};
  EXPECT_THAT(all.order, testing::ElementsAre(1, 0, 3, 2));
}

TEST(StruckFrames, ADelayedOneLeavesLater) {
  const Struck all{{.delay = 1.0, .seed = 1}, 3};
  EXPECT_EQ(all.before_later, 0u);
  EXPECT_THAT(all.order, testing::UnorderedElementsAre(0, 1, 2));
  EXPECT_EQ(all.logged.at("delay").size(), 3u);
}

TEST(StruckFrames, WhatCannotWaitLeavesAtOnceAndIsNoDelay) {
  const Struck all{{.delay = 1.0, .seed = 1}, 100};
  EXPECT_EQ(all.before_later, 36u) << "64 wait";
  EXPECT_EQ(all.logged.at("delay").size(), 64u);
}

TEST(StruckFrames, ALateOneThatNoneFollowsLeavesAndIsNotReordered) {
  const Struck all{{.reorder = 1.0, .seed = 1}, 1};
  EXPECT_THAT(all.order, testing::ElementsAre(0));
  EXPECT_FALSE(all.logged.contains("reorder"));
}

TEST(StruckFrames, ACorruptedOneHasOneBitOfEachImageChanged) {
  const Struck all{{.corruption = 0.5, .seed = 1}, 200};
  const auto changed = std::ranges::count(all.bits_changed, 1);
  EXPECT_EQ(static_cast<std::size_t>(changed), all.logged.at("corruption").size());
  EXPECT_EQ(changed + std::ranges::count(all.bits_changed, 0), 200);
  EXPECT_GT(changed, 50);
}

TEST(StruckFrames, WhatNobodyGetsIsNotStruck) {
  const LineShares shares{
      .duplicate = 0.5, .reorder = 0.5, .delay = 0.05, .corruption = 0.5, .disconnect = 0.1};
  EXPECT_TRUE(Struck(shares, 200, false).logged.empty());
  EXPECT_EQ(Struck(shares, 200, true).logged.size(), 5u);
}

/// With all at once, what left says of each frame what the log does.
TEST(StruckFrames, WhereSeveralMeetTheLogHasWhatWasDone) {
  constexpr std::uint64_t kFrames = 1000;
  Struck all{{.loss = 0.2,
              .duplicate = 0.3,
              .reorder = 0.4,
              .delay = 0.02,
              .corruption = 0.3,
              .disconnect = 0.1,
              .seed = 7},
             kFrames};
  std::map<std::uint64_t, std::vector<std::size_t>> places;  ///< where in the order each left
  for (std::size_t i = 0; i < all.order.size(); ++i) places[all.order[i]].push_back(i);
  int overtaken = 0;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    const auto was = [&](const char* kind) { return all.logged[kind].contains(i); };
    const auto& left = places[i];
    ASSERT_EQ(left.size(), was("loss") ? 0u : was("duplicate") ? 2u : 1u) << i;
    if (left.empty()) continue;
    EXPECT_EQ(all.bits_changed[left[0]], was("corruption") ? 1 : 0) << i;
    const bool is_last = i + 1 == kFrames;  // it may have waited in vain for a next one
    EXPECT_TRUE(left[0] < all.before_later || was("delay") || is_last) << i;
    EXPECT_TRUE(left[0] >= all.before_later || !was("delay")) << i;
    if (was("delay")) continue;
    // One that left in its turn leaves behind it only later ones, and late ones.
    const bool is_behind_a_later_one =
        std::any_of(all.order.begin(), all.order.begin() + static_cast<std::ptrdiff_t>(left[0]),
                    [&](std::uint64_t other) { return other > i; });
    EXPECT_EQ(is_behind_a_later_one, was("reorder")) << i;
    overtaken += was("reorder") ? 1 : 0;
  }
  EXPECT_GT(overtaken, 100);
  EXPECT_EQ(static_cast<std::size_t>(all.cuts), all.logged["disconnect"].size());
}

}  // namespace
}  // namespace toftwin::daemon
