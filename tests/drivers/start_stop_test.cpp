// SPDX-License-Identifier: Apache-2.0
// Ten thousand starts and stops of each driver without a device; the O3D303's are in its own test.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <malloc.h>

#include <filesystem>

#include "drivers/pattern/pattern.h"
#include "drivers/replay/replay.h"
#include "drivers/sim/simulator.h"
#include "protocol/record/recording.h"

namespace toftwin::drivers {
namespace {

constexpr int kWarmUp = 100, kCycles = 10'000;
// Less than a byte per cycle: allocators and libraries fill caches of their own, a leak is at least
// one block of 16 bytes per cycle.
constexpr std::int64_t kMostKept_bytes = 8'000;

std::ptrdiff_t entriesOf(const char* folder) {
  return std::distance(std::filesystem::directory_iterator{folder}, {});
}

struct Held {
  std::ptrdiff_t files = entriesOf("/proc/self/fd"), threads = entriesOf("/proc/self/task");
  std::int64_t heap_bytes = static_cast<std::int64_t>(::mallinfo2().uordblks);  // 0 under ASan
};

void startAndStop(Source& source, int cycles, int frame_every) {
  for (int i = 0; i < cycles; ++i) {
    const auto begun = source.start();
    ASSERT_TRUE(begun.ok()) << "start " << i << ": " << begun.error().message;
    if (i % frame_every == 0) {
      const auto frame = source.next({}, true);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
    }
    source.stop();
  }
}

void expectNothingKept(const Driver& driver, const std::string& keys, int frame_every) {
  auto table = settings::Table::parse(keys, "t.toml");
  auto source = driver.open(*table);
  ASSERT_TRUE(source.ok()) << source.error().message;
  startAndStop(**source, kWarmUp, frame_every);
  const Held before;
  startAndStop(**source, kCycles, frame_every);
  const Held after;
  fmt::print("{}: {} bytes more on the heap after {} starts and stops\n", driver.name,
             after.heap_bytes - before.heap_bytes, kCycles);
  EXPECT_EQ(after.files, before.files);
  EXPECT_EQ(after.threads, before.threads);
  EXPECT_LT(after.heap_bytes - before.heap_bytes, kMostKept_bytes);
}

TEST(StartStop, OfThePatternKeepsNothing) {
  expectNothingKept(pattern::row(), "width = 32\nheight = 24\npace = 'fast'", 1);
}

TEST(StartStop, OfTheSimulatorKeepsNothing) {
  expectNothingKept(simulator::row(),
                    "uri = 'sim:generic_cw'\nsamples_per_pixel = 1\npace = 'fast'", 1000);
}

TEST(StartStop, OfAReplayKeepsNothing) {
  std::string folder = testing::TempDir() + "startstopXXXXXX";
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  const std::string file = folder + "/run.mcap";
  auto writer = record::Writer::create(file);
  ASSERT_TRUE(writer.ok());
  auto keys = settings::Table::parse("width = 32\nheight = 16\npace = 'fast'", "t.toml");
  auto source = pattern::row().open(*keys);
  ASSERT_TRUE(source.ok() && (*source)->start().ok());
  for (std::uint64_t i = 0; i < 5; ++i) {
    Frame frame = *(*source)->next({}, false);
    frame.source = "cam";
    frame.sequence = i;
    frame.moment.received.ns = static_cast<std::int64_t>(i) * 10'000'000;
    ASSERT_TRUE(writer->write(frame).ok());
  }
  ASSERT_TRUE(writer->close().ok());
  expectNothingKept(replay::row(), fmt::format("file = '{}'\nloop = true\npace = 'fast'", file), 1);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace toftwin::drivers
