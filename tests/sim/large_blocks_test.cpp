// SPDX-License-Identifier: Apache-2.0
#include "sim/memory/large_blocks.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <random>
#include <thread>
#include <vector>

namespace toftwin::sim {
namespace {

constexpr std::size_t kUnit = LargeBlocks::kUnit;

std::uintptr_t numberOf(const void* block) { return reinterpret_cast<std::uintptr_t>(block); }

struct Taken {
  unsigned char* at;
  std::size_t bytes;
  unsigned char mark;
};

bool holdsItsMark(const Taken& block) {
  return std::all_of(block.at, block.at + block.bytes, [&](unsigned char byte) { return byte == block.mark; });
}

/// Takes and gives back at random; every block keeps what was written into it, and so overlaps no other.
bool keepsWhatIsWritten(LargeBlocks& blocks, unsigned seed) {
  std::mt19937 random{seed};
  std::vector<Taken> held;
  bool is_kept = true;
  const auto giveBack = [&](std::size_t which) {
    is_kept &= holdsItsMark(held[which]);
    blocks.give(held[which].at);
    held[which] = held.back();
    held.pop_back();
  };
  for (int i = 0; i < 600; ++i) {
    if (!held.empty() && (random() % 2 == 0 || held.size() > 24)) giveBack(random() % held.size());
    const std::size_t bytes = LargeBlocks::kLeast + random() % (1200 * kUnit);
    const auto mark = static_cast<unsigned char>(random());
    auto* at = static_cast<unsigned char*>(blocks.take(bytes));
    if (at == nullptr || !blocks.has(at) || numberOf(at) % kUnit != 0) return false;
    std::memset(at, mark, bytes);
    held.push_back({at, bytes, mark});
  }
  while (!held.empty()) giveBack(0);
  return is_kept;
}

TEST(LargeBlocks, AreForLargeOnesAlone) {
  LargeBlocks blocks;
  EXPECT_EQ(blocks.take(0), nullptr);
  EXPECT_EQ(blocks.take(LargeBlocks::kLeast - 1), nullptr);
  EXPECT_EQ(blocks.take(LargeBlocks::kMost + 1), nullptr);
  EXPECT_EQ(blocks.take(SIZE_MAX), nullptr);
  EXPECT_EQ(blocks.chunksHeld(), 0U);
  void* least = blocks.take(LargeBlocks::kLeast);
  void* most = blocks.take(LargeBlocks::kMost);
  int other = 0;
  EXPECT_TRUE(blocks.has(least));
  EXPECT_TRUE(blocks.has(most));
  EXPECT_FALSE(blocks.has(&other));
  EXPECT_FALSE(blocks.has(nullptr));
  blocks.give(least);
  blocks.give(most);
}

TEST(LargeBlocks, PlacesThatAreGivenBackAreOneWithThoseBesideThem) {
  LargeBlocks blocks;
  std::vector<void*> row;
  for (int i = 0; i < 3; ++i) row.push_back(blocks.take(LargeBlocks::kLeast));
  void* behind = blocks.take(LargeBlocks::kLeast);
  for (const int i : {1, 0, 2}) blocks.give(row[static_cast<std::size_t>(i)]);
  EXPECT_EQ(blocks.take(3 * LargeBlocks::kLeast), row[0]);
  EXPECT_GT(numberOf(blocks.take(LargeBlocks::kLeast)), numberOf(behind));
  EXPECT_EQ(blocks.bytesInUse(), 5 * LargeBlocks::kLeast);
}

TEST(LargeBlocks, MemoryGoesBackToTheKernelButForSomeChunks) {
  constexpr std::size_t kSpares = LargeBlocks::kSpares;
  LargeBlocks blocks;
  std::vector<unsigned char*> held;
  const auto takeOne = [&] { held.push_back(static_cast<unsigned char*>(blocks.take(LargeBlocks::kMost))); };
  while (blocks.chunksHeld() < kSpares + 2) takeOne();
  const auto before = held;
  *before.front() = *before.back() = 77;
  for (void* block : held) blocks.give(block);
  EXPECT_EQ(blocks.chunksHeld(), kSpares);
  held.clear();
  for (std::size_t i = 0; i < before.size(); ++i) takeOne();
  EXPECT_EQ(held, before);
  EXPECT_EQ(blocks.chunksHeld(), kSpares + 2);
  EXPECT_EQ(*held.front(), 77) << "kept";
  EXPECT_EQ(*held.back(), 0) << "the kernel gives nothing but zeros";
}

TEST(LargeBlocks, ManyThreadsKeepWhatTheyWrote) {
  LargeBlocks blocks;
  std::vector<int> is_kept(4);
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < is_kept.size(); ++i)
      threads.emplace_back([&, i] { is_kept[i] = keepsWhatIsWritten(blocks, 1 + i) ? 1 : 0; });
  }
  EXPECT_EQ(is_kept, (std::vector{1, 1, 1, 1}));
  EXPECT_EQ(blocks.bytesInUse(), 0U);
}

#if TOFTWIN_HAS_LARGE_NEW

/// This program is linked with operator new: malloc's blocks begin 16 bytes behind a multiple of it.
template <class T>
bool beginsAtAUnit(const std::vector<T>& values) {
  return numberOf(values.data()) % kUnit == 0;
}

TEST(OperatorNew, TakesWhatIsLargeFromThem) {
  struct alignas(64) Line {
    char bytes[64];
  };
  EXPECT_TRUE(beginsAtAUnit(std::vector<float>(100'000)));
  EXPECT_TRUE(beginsAtAUnit(std::vector<Line>(10'000)));
  std::vector<std::vector<float>> small(16, std::vector<float>(100));
  EXPECT_FALSE(std::ranges::all_of(small, [](const auto& values) { return beginsAtAUnit(values); }));
}

TEST(OperatorNew, WhatIsLargerBeginsAtALargePage) {
  std::vector<char> values(LargeBlocks::kMost + 1);
  EXPECT_EQ(numberOf(values.data()) % LargeBlocks::kPage, 0U);
}

/// A child has all that its parent had, and may take more, whatever the parent's other threads were at.
TEST(OperatorNew, WorksInAChildThatWasForked) {
  std::jthread busy{[](std::stop_token stop) {
    while (!stop.stop_requested()) static_cast<void>(std::vector<float>(100'000));
  }};
  for (int i = 0; i < 50; ++i) {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(beginsAtAUnit(std::vector<float>(50'000)) ? 0 : 1);
    int status = -1;
    ::waitpid(child, &status, 0);
    ASSERT_EQ(status, 0);
  }
}

TEST(OperatorNew, WhatIsTooMuchIsRefused) {
  void* volatile block = nullptr;  // else the compiler leaves out what nobody reads
  for (volatile std::size_t bytes : {SIZE_MAX / 4, SIZE_MAX - LargeBlocks::kPage, SIZE_MAX - 1, SIZE_MAX}) {
    EXPECT_THROW(block = ::operator new(bytes), std::bad_alloc) << bytes;
    EXPECT_THROW(block = ::operator new(bytes, std::align_val_t{64}), std::bad_alloc) << bytes;
    block = ::operator new(bytes, std::nothrow);
    EXPECT_TRUE(block == nullptr) << bytes;
  }
}

#endif

}  // namespace
}  // namespace toftwin::sim
