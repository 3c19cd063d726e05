// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <thread>
#include <utility>

#include "drivers/source.h"

namespace toftwin::test {

inline std::ptrdiff_t entriesOf(const char* folder) {
  return std::distance(std::filesystem::directory_iterator{folder}, {});
}

/// Whether a folder has so many, soon: the other side of a connection closes its end when it comes to it.
inline bool comesTo(const char* folder, std::ptrdiff_t entries) {
  const auto soon = std::chrono::steady_clock::now() + std::chrono::seconds{10};
  while (entriesOf(folder) != entries && std::chrono::steady_clock::now() < soon)
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
  return entriesOf(folder) == entries;
}

/// What this process holds.
struct Held {
  std::ptrdiff_t files = entriesOf("/proc/self/fd"), threads = entriesOf("/proc/self/task");
  std::int64_t heap_bytes = static_cast<std::int64_t>(::mallinfo2().uordblks);  // 0 under ASan
};

/// What is held at the end; of memory the least after any of the last fifty stops, for an emulator may keep
/// a frame or not.
inline void startAndStop(drivers::Source& source, int cycles, int frame_every, Held& held) {
  for (int i = 0; i < cycles; ++i) {
    const auto begun = source.start();
    ASSERT_TRUE(begun.ok()) << "start " << i << ": " << begun.error().message;
    if (i % frame_every == 0) {
      auto frame = source.next({}, true);
      for (int n = 0; n < 20 && !frame; ++n) frame = source.next({}, true);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
    }
    source.stop();
    if (i < cycles - 50) continue;
    const auto least = i > cycles - 50 && i > 0 ? held.heap_bytes : Held{}.heap_bytes;
    held = {};
    held.heap_bytes = std::min(held.heap_bytes, least);
  }
}

/// Ten thousand starts and stops of an opened source, with a frame of each `frame_every`th, keep no file, no
/// thread and no memory. A leak is at least one block of 16 bytes per cycle, which is more than
/// `most_kept_bytes` from 500 cycles on; TOFTWIN_CYCLES=10000 runs more of them. Allocators and libraries fill
/// caches of their own, and one more when the machine is busy: unlike a leak, not in each third of the cycles
/// alike. So what counts is thrice the third that keeps least. Larger where a library keeps images for the
/// next start.
inline void expectNothingKept(std::string_view name, drivers::Source& source, int frame_every, int cycles = 10'000,
                              std::int64_t most_kept_bytes = 8'000) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  cycles = std::min(cycles, 500);  // its own allocator is not counted, and finds a leak after one
#endif
  if (const char* asked = std::getenv("TOFTWIN_CYCLES"); asked != nullptr) cycles = std::max(cycles, std::atoi(asked));
  Held before, after;
  startAndStop(source, std::clamp(cycles / 2, 50, 100), frame_every, before);
  std::array<std::int64_t, 3> kept{};
  std::int64_t held_bytes = before.heap_bytes;
  for (std::int64_t& third : kept) {
    ASSERT_NO_FATAL_FAILURE(startAndStop(source, cycles / 3, frame_every, after));
    third = after.heap_bytes - std::exchange(held_bytes, after.heap_bytes);
  }
  fmt::print("{}: {} bytes more on the heap after each third of {} starts and stops\n", name, kept, cycles);
  EXPECT_EQ(after.files, before.files);
  EXPECT_EQ(after.threads, before.threads);
  EXPECT_LT(3 * *std::ranges::min_element(kept), most_kept_bytes);
}

}  // namespace toftwin::test
