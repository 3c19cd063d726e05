// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/long_slices.h"

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <thread>

#include "sim/images/rows.h"

namespace toftwin::drivers::simulator {
namespace {

/// Of this thread, as sched_getattr(2) says it; 0 where it does not.
std::uint64_t slice_ns() {
  struct {
    std::uint32_t size, policy;
    std::uint64_t flags;
    std::int32_t nice;
    std::uint32_t priority;
    std::uint64_t runtime_ns, deadline_ns, period_ns;
  } attributes{};
  if (::syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0) != 0) return 0;
  return attributes.runtime_ns;
}

TEST(LongSlices, AreOfThisThreadAndItsWorkersAlone) {
  const std::uint64_t usual = slice_ns();
  if (usual == 0) GTEST_SKIP() << "this kernel has no slices of threads' own (before Linux 6.12)";
  sim::inParallel(64, 1, [](int, int) { ::usleep(1000); });  // there are workers, with the usual slice
  std::atomic<int> others = 0, wrong = 0;
  const auto compute = [&] {
    takeLongSlices();
    const std::uint64_t longer = slice_ns();
    EXPECT_GT(longer, usual);
    const auto self = std::this_thread::get_id();
    others = 0;
    for (int i = 0; i < 200 && others == 0; ++i) {  // on a busy computer workers come late
      sim::inParallel(64, 1, [&](int, int) {
        others += std::this_thread::get_id() == self ? 0 : 1;
        wrong += slice_ns() == longer ? 0 : 1;
        ::usleep(1000);
      });
    }
  };
  std::jthread{compute}.join();
  std::jthread{compute}.join();
  EXPECT_EQ(wrong, 0);
#if !defined(__SANITIZE_THREAD__)  // without workers (rows.h)
  EXPECT_TRUE(others > 0 || std::thread::hardware_concurrency() == 1) << "no worker took part";
#endif
  EXPECT_EQ(slice_ns(), usual);
}

}  // namespace
}  // namespace toftwin::drivers::simulator
