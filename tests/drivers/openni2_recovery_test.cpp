// SPDX-License-Identifier: Apache-2.0
// The device inside OpenNI2 is unplugged and comes back, while a subscriber stays.
#include <gtest/gtest.h>

#include "drivers/openni2/openni2.h"
#include "openni2_device.h"
#include "recovery_rig.h"

namespace toftwin::test {
namespace {

using std::chrono::milliseconds;

void losesAndFinds(std::string_view what, milliseconds away,
                   const std::function<void(EmulatedOpenNI2&)>& lose,
                   const std::function<void(EmulatedOpenNI2&)>& giveBack) {
  EmulatedOpenNI2& device = emulatedDevice();
  RecoveryRig rig{[]() -> Result<std::unique_ptr<drivers::Source>> {
    auto table = settings::Table::parse("uri = 'openni2:emulated/0'\ninfrared = 'no'", "t.toml");
    return drivers::openni2::row().open(*table);
  }};
  ASSERT_TRUE(rig.isSubscribed());
  for (const auto& [name, value] : {std::pair{"auto_exposure", 0.0}, {"exposure", 21.0}}) {
    const Result<> set =
        rig.command([&](drivers::Source& source) { return source.setParameter(name, value); });
    ASSERT_TRUE(set.ok()) << set.error().message;
  }
  const auto outcome = rig.loseAndFind(
      what, away, [&] { lose(device); }, [&] { giveBack(device); });
  ASSERT_TRUE(outcome.has_value());
  const auto& [last, first, took] = *outcome;
  EXPECT_LT(took, kBackWithin);
  EXPECT_EQ(first.sequence, last.sequence + 1) << "the subscription went on";
  const double gap_ms =
      static_cast<double>(first.moment.received.ns - last.moment.received.ns) * 1e-6;
  // An interval of rounding, and one because a frame may have come up to an interval late.
  EXPECT_NEAR(static_cast<double>(first.dropped_by_device + 1),
              gap_ms * EmulatedOpenNI2::kRate_hz / 1000.0, 2.0);
  EXPECT_GT(first.moment.exposures[0].start, last.moment.exposures[0].start);
  EXPECT_EQ(device.exposure, 21) << "what a client had set is set again";
}

TEST(OpenNI2Recovery, AnUnpluggedDeviceIsBackWithinASecond) {
  losesAndFinds(
      "unplugged", milliseconds{700}, [](auto& device) { device.unplug(); },
      [](auto& device) {
        device.exposure = 33;  // it begins anew
        device.plugIn();
      });
}

TEST(OpenNI2Recovery, AHungDeviceIsBackWithinASecond) {
  losesAndFinds(
      "hung", milliseconds{700}, [](auto& device) { device.is_hung = true; },
      [](auto& device) { device.is_hung = false; });
}

}  // namespace
}  // namespace toftwin::test
