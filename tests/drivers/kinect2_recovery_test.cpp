// SPDX-License-Identifier: Apache-2.0
// The camera on an emulated bus is unplugged or hangs, and comes back, while a subscriber stays.
#include <gtest/gtest.h>

#include "drivers/kinect2/kinect2.h"
#include "emulated_kinect2_bus.h"
#include "recovery_rig.h"

namespace toftwin::test {
namespace {

using std::chrono::milliseconds;

void losesAndFinds(std::string_view what, const std::function<void(EmulatedKinect2Bus&)>& lose,
                   const std::function<void(EmulatedKinect2Bus&)>& giveBack) {
  EmulatedKinect2Bus bus;
  RecoveryRig rig{[&bus]() -> Result<std::unique_ptr<drivers::Source>> {
    auto table = settings::Table::parse("uri = 'kinect2:any'", "t.toml");
    return drivers::kinect2::openOn(bus, *table);
  }};
  ASSERT_TRUE(rig.isSubscribed());
  const auto narrow =
      rig.command([](drivers::Source& source) { return source.setParameter("farthest_m", 3.25); });
  ASSERT_TRUE(narrow.ok()) << narrow.error().message;
  const auto outcome = rig.loseAndFind(
      what, milliseconds{700}, [&] { lose(bus); }, [&] { giveBack(bus); });
  ASSERT_TRUE(outcome.has_value());
  const auto& [last, first, took] = *outcome;
  EXPECT_LT(took, kBackWithin);
  EXPECT_EQ(first.sequence, last.sequence + 1) << "the subscription went on";
  const double gap_ms = static_cast<double>(first.moment.received.ns - last.moment.received.ns) * 1e-6;
  // An interval of rounding, and up to two frames that waited in the queue.
  EXPECT_NEAR(static_cast<double>(first.dropped_by_device + 1), gap_ms * 30.0 / 1000.0, 3.0);
  EXPECT_GT(first.moment.exposures[0].start, last.moment.exposures[0].start);
  double farthest_m = 0.0;
  ASSERT_TRUE(rig.command([&](drivers::Source& source) -> Result<> {
                   farthest_m = source.state().parameters[1].value.value_or(0.0);
                   return {};
                 })
                  .ok());
  EXPECT_EQ(farthest_m, 3.25) << "what a client had set is set again";
}

TEST(Kinect2Recovery, AnUnpluggedCameraIsBackWithinASecond) {
  losesAndFinds(
      "unplugged", [](auto& bus) { bus.unplug(); }, [](auto& bus) { bus.plugIn(); });
}

TEST(Kinect2Recovery, AHungCameraIsBackWithinASecond) {
  losesAndFinds(
      "hung", [](auto& bus) { bus.device().hang(true); }, [](auto& bus) { bus.device().hang(false); });
}

}  // namespace
}  // namespace toftwin::test
