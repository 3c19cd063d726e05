// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include <bit>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "daemon/facades/struck_frames.h"

namespace toftwin::daemon {
namespace {

Frame numbered(std::uint64_t sequence) {
  Frame frame;
  frame.sequence = sequence;
  Plane plane;
  plane.type = ElementType::U8;
  plane.width = 4;
  plane.height = 1;
  plane.data = Buffer::adopt(std::vector<std::uint8_t>{1, 2, 3, 4});
  frame.planes.push_back(std::move(plane));
  return frame;
}

/// What leaves of `count` frames, in the order in which it does, and the log.
struct Struck {
  explicit Struck(const LineShares& shares, std::uint64_t count = 1000) {
    const auto log =
        std::filesystem::temp_directory_path() / ("struck_frames_" + std::to_string(::getpid()) + ".csv");
    {
      boost::asio::io_context io;
      StruckFrames line{
          io, LineFaults{shares, "test", log}, 1_ms, [&](const Frame& frame) {
            order.push_back(frame.sequence);
            const auto bytes = frame.planes.at(0).data.bytes();
            unsigned differ = 0;
            for (std::size_t i = 0; i < bytes.size(); ++i)
              differ += static_cast<unsigned>(std::popcount(std::to_integer<unsigned>(bytes[i]) ^ (i + 1)));
            bits_changed.push_back(differ);
          }};
      for (std::uint64_t i = 0; i < count; ++i) line.take(numbered(i));
      before_later = order.size();
      io.run();
    }
    std::ifstream file{log};
    for (std::string text; std::getline(file, text);) {
      const auto first = text.find(','), second = text.rfind(',');
      if (first != second) ++logged[text.substr(first + 1, second - first - 1)];
    }
    std::filesystem::remove(log);
  }
  std::vector<std::uint64_t> order;
  std::vector<unsigned> bits_changed;
  std::size_t before_later = 0;
  std::map<std::string, int> logged;  ///< lines of each kind
};

TEST(StruckFrames, WithoutFaultsAllLeaveInOrder) {
  const Struck all{{}, 10};
  EXPECT_THAT(all.order, testing::ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
}

// 1000 frames at a share of 0.1 are 100 with a deviation of 9.5; the chance is a function of the seed, so
// this one is met or not for ever.
TEST(StruckFrames, LossAndDuplicatesAreThoseOfTheLog) {
  const Struck lossy{{.loss = 0.1, .seed = 5}};
  EXPECT_NEAR(lossy.logged.at("loss"), 100, 40);
  EXPECT_EQ(lossy.order.size(), 1000u - static_cast<unsigned>(lossy.logged.at("loss")));
  const Struck doubled{{.duplicate = 0.1, .seed = 5}};
  EXPECT_EQ(doubled.order.size(), 1000u + static_cast<unsigned>(doubled.logged.at("duplicate")));
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
  EXPECT_EQ(all.logged.at("delay"), 3);
}

TEST(StruckFrames, ACorruptedOneHasOneBitOfEachImageChanged) {
  const Struck all{{.corruption = 0.5, .seed = 1}, 200};
  const auto changed = std::ranges::count(all.bits_changed, 1U);
  EXPECT_EQ(changed, all.logged.at("corruption"));
  EXPECT_EQ(changed + std::ranges::count(all.bits_changed, 0U), 200);
  EXPECT_GT(changed, 50);
}

}  // namespace
}  // namespace toftwin::daemon
