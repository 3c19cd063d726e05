// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <thread>

#include "drivers/pattern/pattern.h"

namespace toftwin::drivers::pattern {
namespace {

std::unique_ptr<Source> openPattern(const std::string& keys) {
  auto table = settings::Table::parse(keys, "test.toml");
  EXPECT_TRUE(table.ok());
  auto source = row().open(*table);
  EXPECT_TRUE(source.ok()) << source.error().message;
  return *std::move(source);
}
std::string errorOf(const std::string& keys) {
  auto table = settings::Table::parse(keys, "test.toml");
  auto source = row().open(*table);
  return source ? "no error" : source.error().message;
}

TEST(Pattern, ShowsItsDefinition) {
  const auto source = openPattern("width = 40\nheight = 24\npace = 'fast'");
  ASSERT_TRUE(source->start().ok());
  for (std::uint64_t shift = 0; shift < 30; ++shift) {
    const auto frame = source->next({}, false);
    ASSERT_TRUE(frame.ok());
    int invalid = 0;
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 40; ++x) {
        const auto i = static_cast<std::size_t>(y * 40 + x);
        const Pixel expected = pixelAt(40, 24, shift, x, y);
        const float range = frame->find(PlaneKind::Range)->as<float>()[i];
        ASSERT_EQ(frame->find(PlaneKind::Flags)->as<std::uint8_t>()[i], expected.flags);
        ASSERT_EQ(frame->find(PlaneKind::Amplitude)->as<float>()[i], expected.amplitude);
        ASSERT_EQ(frame->find(PlaneKind::Ambient)->as<float>()[i], expected.ambient);
        if (std::isnan(expected.range_m)) {
          ++invalid;
          ASSERT_TRUE(std::isnan(range));
        } else {
          ASSERT_EQ(range, expected.range_m);
        }
      }
    }
    EXPECT_GT(invalid, 0) << "the square has left the picture";
  }
}

TEST(Pattern, DepthIsRangeTimesTheRaysZ) {
  const auto source = openPattern("width = 40\nheight = 24\npace = 'fast'");
  ASSERT_TRUE(source->start().ok());
  const auto frame = source->next({}, false);
  ASSERT_TRUE(frame.ok());
  const std::size_t corner = 39;  // top right; the square is at the top left
  const double u = 39 - 19.5, v = 0 - 11.5, f = 40;
  const double z = f / std::sqrt(u * u + v * v + f * f);
  const double range = frame->find(PlaneKind::Range)->as<float>()[corner];
  const double depth = frame->find(PlaneKind::Depth)->as<float>()[corner];
  // Two roundings to float: of z and of the product.
  EXPECT_NEAR(depth, range * z, 2 * range * z * 0x1p-24);
}

TEST(Pattern, SpeedMovesItFromTheNextFrameOn) {
  const auto source = openPattern("width = 16\nheight = 8\npace = 'fast'");
  ASSERT_TRUE(source->start().ok());
  const auto lastPixel = [&] {
    return source->next({}, false)->find(PlaneKind::Range)->as<float>()[127];
  };
  EXPECT_EQ(lastPixel(), pixelAt(16, 8, 0, 15, 7).range_m);
  ASSERT_TRUE(source->setParameter("speed_px", 5).ok());
  EXPECT_EQ(lastPixel(), pixelAt(16, 8, 1, 15, 7).range_m);
  EXPECT_EQ(lastPixel(), pixelAt(16, 8, 6, 15, 7).range_m);
  EXPECT_FALSE(source->setParameter("speed_px", 65).ok());
  EXPECT_FALSE(source->setParameter("speed_px", 0.5).ok());
  EXPECT_FALSE(source->setParameter("speed_px", std::nan("")).ok());
}

TEST(Pattern, TakesNoPoseThatIsNone) {
  const auto source = openPattern("width = 40\nheight = 24\npace = 'fast'");
  const auto refuses = [&](std::array<double, 4> rotation, Vec3d position) {
    Transform<World, Camera> pose;
    pose.rotation_wxyz = rotation, pose.translation_m = position;
    const auto set = source->setPose(pose);
    return !set && set.error().code == Error::Code::InvalidArgument;
  };
  EXPECT_FALSE(refuses({1, 0, 0, 0}, {1, 2, 3}));
  EXPECT_TRUE(refuses({2, 0, 0, 0}, {}));
  EXPECT_TRUE(refuses({0, 0, 0, 0}, {}));
  EXPECT_TRUE(refuses({1.00001, 0, 0, 0}, {}));
  EXPECT_TRUE(refuses({NAN, 0, 0, 0}, {}));
  EXPECT_TRUE(refuses({1, 0, 0, 0}, {NAN, 0, 0}));
  EXPECT_TRUE(refuses({1, 0, 0, 0}, {0, INFINITY, 0}));
  EXPECT_EQ(source->state().world_from_camera->translation_m.x, 1.0) << "what was refused changes nothing";
}

TEST(Pattern, EndsAfterItsFramesAndBeginsAgain) {
  const auto source = openPattern("width = 16\nheight = 8\npace = 'fast'\nframes = 2");
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(source->start().ok());
    EXPECT_TRUE(source->next({}, false).ok());
    EXPECT_TRUE(source->next({}, false).ok());
    const auto end = source->next({}, false);
    ASSERT_FALSE(end.ok());
    EXPECT_EQ(end.error().code, Error::Code::EndOfStream);
    source->stop();
  }
}

TEST(Pattern, GivesOneFramePerTrigger) {
  const auto source = openPattern("width = 16\nheight = 8\npace = 'trigger'");
  ASSERT_TRUE(source->start().ok());
  ASSERT_TRUE(source->trigger().ok());
  ASSERT_TRUE(source->trigger().ok());
  EXPECT_TRUE(source->next({}, false).ok());
  EXPECT_TRUE(source->next({}, false).ok());
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(source->next(stop.get_token(), false).error().code, Error::Code::Stopped);
}

TEST(Pattern, CountsWhatItLostInRealTime) {
  const auto source = openPattern("width = 16\nheight = 8\nframe_rate_hz = 10000");
  ASSERT_TRUE(source->start().ok());
  std::int64_t expected_ns = 0;
  std::uint64_t lost = 0;
  for (int i = 0; i < 20; ++i) {
    const auto frame = source->next({}, false);
    ASSERT_TRUE(frame.ok());
    lost += frame->dropped_by_device;
    expected_ns += static_cast<std::int64_t>(frame->dropped_by_device) * 100'000;
    EXPECT_EQ(frame->moment.exposures.front().start.ns, expected_ns);
    EXPECT_GE(frame->moment.clock.uncertainty_ns, 0);
    expected_ns += 100'000;
    if (i == 10) std::this_thread::sleep_for(std::chrono::milliseconds{2});  // 20 intervals
  }
  EXPECT_GE(lost, 19u);
}

TEST(Pattern, KnowsTheHostsTimeOnlyWhileItKeepsRealTime) {
  const auto source = openPattern("width = 16\nheight = 8\nframe_rate_hz = 10000");
  ASSERT_TRUE(source->start().ok());
  EXPECT_GE(source->next({}, false)->moment.clock.uncertainty_ns, 0);
  EXPECT_EQ(source->next({}, true)->moment.clock, ClockRelation{});
  EXPECT_GE(source->next({}, false)->moment.clock.uncertainty_ns, 0);
}

TEST(Pattern, HasOnlyThePlanesThatAreAskedFor) {
  const auto source =
      openPattern("width = 16\nheight = 8\npace = 'fast'\nplanes = ['flags', 'range']");
  ASSERT_TRUE(source->start().ok());
  const auto frame = source->next({}, false);
  ASSERT_EQ(frame->planes.size(), 2u);
  EXPECT_EQ(frame->planes[0].kind, PlaneKind::Flags);
  EXPECT_EQ(frame->planes[1].kind, PlaneKind::Range);
}

TEST(Pattern, WrongKeysAreNamedWithPlaceAndBound) {
  EXPECT_EQ(errorOf("width = 7"), "test.toml:1: width = 7 is out of bounds: it must be 8 to 4096");
  EXPECT_NE(errorOf("\nplanes = ['colour']").find("test.toml:2: planes names \"colour\""),
            std::string::npos);
  EXPECT_NE(errorOf("colour = 1").find("unknown key \"colour\""), std::string::npos);
}

}  // namespace
}  // namespace toftwin::drivers::pattern
