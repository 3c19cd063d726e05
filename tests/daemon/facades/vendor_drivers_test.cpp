// SPDX-License-Identifier: Apache-2.0
// Our drivers o3r and visionary at our facades: the same frame as natively, after both conversions.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "drivers/o3r/o3r.h"
#include "drivers/o3r/wire/numbers.h"
#include "drivers/visionary/visionary.h"
#include "facade_testing.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using Policy = SubscribeOptions::Policy;
using Opened = Result<std::unique_ptr<drivers::Source>>;

class VendorDriver : public RunningFacade {
 protected:
  void startWith(const std::string& facade) {
    port_ = freePort();
    start(fmt::format("[[source]]\nname = 'cam'\n{}[[facade]]\nsource = 'cam'\n{}", kSmallSim, fmt::format(fmt::runtime(facade), port_)));
  }
  Opened openDriver(const drivers::Driver& driver, const std::string& uri, const std::string& keys = {}) {
    Opened opened = Error{};
    EXPECT_TRUE(eventually([&] {
      auto table = settings::Table::parse(fmt::format("uri = '{}'\n{}", uri, keys), "driver.toml");
      return (opened = driver.open(*table)).ok() || opened.error().code == Error::Code::InvalidArgument;
    })) << opened.error().message;
    return opened;
  }
  double exposure() { return client().describe("cam")->parameters.at(0).value.value_or(0.0); }
  /// Frames of the driver and of the source that have the same number, which ranges tell: those of a still scene with noise
  /// are never the same.
  template <class RangeOf>
  void expectRanges(drivers::Source& driver, RangeOf rangeOf, double depth_error) {
    auto native = client();
    auto stream = native.subscribe("cam", {.policy = Policy::Queue, .queue = 64});
    ASSERT_TRUE(stream.ok()) << stream.error().message;
    ASSERT_TRUE(driver.start().ok());
    std::vector<Frame> natives, throughs;
    for (int i = 0; i < 12; ++i) {
      auto one = stream->next(kSoon);
      ASSERT_TRUE(one.ok()) << one.error().message;
      natives.push_back(*std::move(one));
      auto other = nextFrame(driver);
      ASSERT_TRUE(other.ok()) << other.error().message;
      throughs.push_back(*std::move(other));
    }
    driver.stop();
    int same = 0;
    for (const Frame& through : throughs) {
      for (const Frame& one : natives) same += isSame(one, through, rangeOf, depth_error) ? 1 : 0;
    }
    EXPECT_GE(same, 5);
  }
  template <class RangeOf>
  static bool isSame(const Frame& native, const Frame& through, RangeOf rangeOf, double depth_error) {
    const auto range_m = native.find(PlaneKind::Range)->as<float>(), got = through.find(PlaneKind::Range)->as<float>();
    const auto depth_got = through.find(PlaneKind::Depth)->as<float>();
    const auto flags = native.find(PlaneKind::Flags)->as<std::uint8_t>();
    if (range_m.size() != got.size()) return false;
    for (std::size_t i = 0; i < got.size(); ++i) {
      const float expected = (flags[i] & 1U) != 0 ? std::nanf("") : rangeOf(range_m[i]);
      if (std::isnan(expected) != std::isnan(got[i]) || (!std::isnan(expected) && expected != got[i])) return false;
      const auto width = static_cast<std::size_t>(native.camera.width);
      const double z = rayThroughPixel(native.camera, static_cast<double>(i % width), static_cast<double>(i / width)).v.z;
      if (std::isnan(expected)) continue;
      EXPECT_NEAR(depth_got[i], static_cast<double>(got[i]) * z, depth_error * z);
    }
    return true;
  }
  std::uint16_t port_ = 0;
};

const std::string kO3r = "kind = 'o3r'\nxmlrpc_port = {}\npcic_port = 0\ndiagnostic_port = 0\ndiscoverable = false\n";
const std::string kVisionary = "kind = 'visionary'\ncontrol_port = {}\nstream_port = 0\n";

TEST_F(VendorDriver, AnO3rsFramesAreTheNativeOnes) {
  startWith(kO3r);
  auto driver = openDriver(drivers::o3r::row(), fmt::format("o3r:127.0.0.1:{}/port2", port_));
  ASSERT_TRUE(driver.ok()) << driver.error().message;
  const auto native = client().describe("cam")->camera;
  EXPECT_NEAR((*driver)->info().camera.fx, native.fx, 1e-5);
  EXPECT_NEAR((*driver)->info().camera.cx, native.cx, 1e-5) << "the lens comes back through the inverse model";
  const float resolution = o3r::distanceResolution(10.0);
  expectRanges(**driver, [&](float range_m) {
    const auto counts = o3r::distanceCounts(static_cast<double>(range_m), resolution);
    return counts == 0 ? std::nanf("") : o3r::metresOf(counts, resolution);
  }, 1e-5);
}

TEST_F(VendorDriver, AnO3rIsSetThroughItsConfiguration) {
  startWith(kO3r);
  auto driver = openDriver(drivers::o3r::row(), fmt::format("o3r:127.0.0.1:{}", port_), "exposure_us = 700");
  ASSERT_TRUE(driver.ok()) << driver.error().message;
  EXPECT_EQ(exposure(), 700.0);
  ASSERT_TRUE((*driver)->setParameter("exposure_us", 900.0).ok());
  EXPECT_EQ(exposure(), 900.0);
  EXPECT_FALSE((*driver)->setParameter("exposure_us", 1e6).ok());
  EXPECT_FALSE((*driver)->setParameter("nonsense", 1.0).ok());
}

TEST_F(VendorDriver, AVisionarysFramesAreTheNativeOnes) {
  startWith(kVisionary);
  auto driver = openDriver(drivers::visionary::row(), fmt::format("visionary:127.0.0.1:{}", port_));
  ASSERT_TRUE(driver.ok()) << driver.error().message;
  expectRanges(**driver, [](float range_m) {
    const double counts = std::round(4000.0 * static_cast<double>(range_m));
    return counts >= 1.0 && counts < 65'535.0 ? static_cast<float>(counts * 0.00025) : std::nanf("");
  }, 0.05);
}

TEST_F(VendorDriver, AVisionaryIsSetByWhoKnowsThePassword) {
  startWith(kVisionary);
  auto driver = openDriver(drivers::visionary::row(), fmt::format("visionary:127.0.0.1:{}", port_));
  ASSERT_TRUE(driver.ok()) << driver.error().message;
  ASSERT_TRUE((*driver)->setParameter("exposure_us", 900.0).ok());
  EXPECT_EQ(exposure(), 900.0);
  auto wrong = openDriver(drivers::visionary::row(), fmt::format("visionary:127.0.0.1:{}", port_), "password = 'wrong'");
  ASSERT_TRUE(wrong.ok()) << wrong.error().message;
  EXPECT_EQ((*wrong)->setParameter("exposure_us", 700.0).error().code, Error::Code::PermissionDenied);
  EXPECT_EQ(exposure(), 900.0);
}

}  // namespace
}  // namespace toftwin::daemon
