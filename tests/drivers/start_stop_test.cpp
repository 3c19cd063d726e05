// SPDX-License-Identifier: Apache-2.0
// Ten thousand starts and stops of each driver without a device; the others' are in their own tests.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <filesystem>

#include "drivers/pattern/pattern.h"
#include "drivers/replay/replay.h"
#include "drivers/sim/simulator.h"
#include "protocol/record/recording.h"
#include "start_stop.h"

namespace toftwin::drivers {
namespace {

void expectNothingKept(const Driver& driver, const std::string& keys, int frame_every) {
  auto table = settings::Table::parse(keys, "t.toml");
  auto source = driver.open(*table);
  ASSERT_TRUE(source.ok()) << source.error().message;
  test::expectNothingKept(driver.name, **source, frame_every);
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
