// SPDX-License-Identifier: Apache-2.0
// Cameras without a cable: what is lost is their driver, which fails and will not open for a while.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <utility>

#include "drivers/pattern/pattern.h"
#include "drivers/replay/replay.h"
#include "drivers/sim/simulator.h"
#include "protocol/record/recording.h"
#include "recovery_rig.h"

namespace toftwin::test {
namespace {

using drivers::Source;

/// A source as it is, until `is_away`.
class Losable final : public Source {
 public:
  Losable(std::unique_ptr<Source> source, std::shared_ptr<std::atomic<bool>> is_away)
      : source_(std::move(source)), is_away_(std::move(is_away)) {}
  [[nodiscard]] const drivers::SourceInfo& info() const override { return source_->info(); }
  [[nodiscard]] drivers::SourceState state() const override { return source_->state(); }
  Result<> start() override { return source_->start(); }
  void stop() override { source_->stop(); }
  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    if (*is_away_) return Error{Error::Code::Internal, "the driver failed"};
    return source_->next(std::move(stop), lockstep);
  }
  Result<> setPose(const Transform<World, Camera>& pose) override { return source_->setPose(pose); }

 private:
  std::unique_ptr<Source> source_;
  std::shared_ptr<std::atomic<bool>> is_away_;  // shared with the test and the source opened next
};

class SoftwareRecovery : public testing::Test {
 protected:
  void check(std::string_view name, const drivers::Driver& driver, const std::string& keys) {
    const auto is_away = std::make_shared<std::atomic<bool>>(false);
    RecoveryRig rig{[driver, keys, is_away]() -> Result<std::unique_ptr<Source>> {
      if (*is_away) return Error{Error::Code::Disconnected, "not there"};
      auto table = settings::Table::parse(keys, "t.toml");
      auto opened = driver.open(*table);
      if (!opened) return opened.error();
      return std::unique_ptr<Source>{std::make_unique<Losable>(*std::move(opened), is_away)};
    }};
    ASSERT_TRUE(rig.isSubscribed());
    const Transform<World, Camera> pose{{1, 0, 0, 0}, {0.25, 0, 0}};
    const bool is_movable = rig.host().describe()->can_set_pose;
    if (is_movable) {
      const auto moved = rig.command([&](Source& source) { return source.setPose(pose); });
      ASSERT_TRUE(moved.ok()) << moved.error().message;
    }
    const auto outcome = rig.loseAndFind(
        name, std::chrono::milliseconds{700}, [&] { *is_away = true; }, [&] { *is_away = false; });
    ASSERT_TRUE(outcome.has_value());
    EXPECT_LT(outcome->took, kBackWithin);
    EXPECT_EQ(outcome->first.sequence, outcome->last.sequence + 1);
    if (is_movable) {
      EXPECT_EQ(outcome->first.moment.world_from_camera, pose);
    }
  }
};

TEST_F(SoftwareRecovery, OfThePattern) {
  check("pattern", drivers::pattern::row(), "width = 64\nheight = 48\nframe_rate_hz = 100");
}

// A small camera, so that what is measured is not how quickly this machine traces.
TEST_F(SoftwareRecovery, OfTheSimulator) {
  const std::string camera = testing::TempDir() + "recovery_camera.toml";
  std::ofstream{camera} << R"(
[lens]
width = 64
height = 48
fx = 52.0
fy = 52.0
cx = 31.5
cy = 23.5
[[emitter]]
power_w = 2.0
[[modulation]]
frequency_mhz = 20.0
exposure_us = 1000.0
)";
  check("sim", drivers::simulator::row(),
        fmt::format("camera = '{}'\nsamples_per_pixel = 1", camera));
  std::filesystem::remove(camera);
}

TEST_F(SoftwareRecovery, OfAReplay) {
  std::string folder = testing::TempDir() + "recoveryXXXXXX";
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  const std::string file = folder + "/run.mcap";
  auto writer = record::Writer::create(file);
  ASSERT_TRUE(writer.ok());
  auto keys = settings::Table::parse("width = 32\nheight = 16\npace = 'fast'", "t.toml");
  auto source = drivers::pattern::row().open(*keys);
  ASSERT_TRUE(source.ok() && (*source)->start().ok());
  for (std::uint64_t i = 0; i < 10; ++i) {
    Frame frame = *(*source)->next({}, false);
    frame.source = "cam";
    frame.sequence = i;
    frame.moment.received.ns = static_cast<std::int64_t>(i) * 10'000'000;
    ASSERT_TRUE(writer->write(frame).ok());
  }
  ASSERT_TRUE(writer->close().ok());
  check("replay", drivers::replay::row(), fmt::format("file = '{}'\nloop = true", file));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace toftwin::test
