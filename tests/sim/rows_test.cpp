// SPDX-License-Identifier: Apache-2.0
#include "sim/images/rows.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace toftwin::sim {
namespace {

/// How often each of `count` was handed to work, which `over(count, work)` calls.
template <class Over>
std::vector<int> timesOf(int count, const Over& over) {
  std::vector<std::atomic<int>> times(static_cast<std::size_t>(count));
  over(count, [&](int first, int last) {
    for (int i = first; i < last; ++i) ++times[static_cast<std::size_t>(i)];
  });
  return {times.begin(), times.end()};
}

TEST(Rows, EachIsWorkedOnOnce) {
  for (const int count : {0, 1, 15, 16, 17, 110, 424, 1000}) {
    const std::vector<int> once(static_cast<std::size_t>(count), 1);
    EXPECT_EQ(timesOf(count, [](int n, const auto& work) { forRows(n, work); }), once) << count;
    EXPECT_EQ(timesOf(count, [](int n, const auto& work) { inFewParts(n, 4, work); }), once) << count;
    EXPECT_EQ(timesOf(count, [](int n, const auto& work) { inParallel(n, 1, work); }), once) << count;
  }
}

TEST(Together, BothComeToTheirEndWhoeverThrows) {
  for (int round = 0; round < 50; ++round) {
    std::atomic<int> done = 0;
    const auto counts = [&] { inParallel(1000, 1, [&](int first, int last) { done += last - first; }); };
    const auto fails = [] { throw std::runtime_error{"as it should"}; };
    EXPECT_THROW(together(fails, counts), std::runtime_error);
    EXPECT_EQ(done, 1000);
    EXPECT_THROW(together(counts, fails), std::runtime_error);
    EXPECT_EQ(done, 2000);
    together(counts, counts);
    EXPECT_EQ(done, 4000);
  }
}

/// A part that begins another, as where parallel work is within parallel work, must not find the room that it works in.
TEST(Rooms, ARoomIsUsedByOnePartAtATimeAndThenAgain) {
  Rooms<std::vector<int>> rooms;
  int made = 0;
  const auto make = [&] { return std::vector<int>{made++}; };
  const auto nothing = [](std::vector<int>&) {};
  rooms.use(make, [&](std::vector<int>& outer) {
    rooms.use(make, [&](std::vector<int>& inner) { EXPECT_NE(outer, inner); });
    rooms.use(make, [&](std::vector<int>& inner) { EXPECT_EQ(inner, std::vector<int>{1}); });
  });
  rooms.use(make, nothing);
  EXPECT_EQ(made, 2);
}

}  // namespace
}  // namespace toftwin::sim
