// SPDX-License-Identifier: Apache-2.0
#include "drivers/recovery.h"

#include <gtest/gtest.h>

#include "drivers/clock_fit.h"
#include "drivers/loss_reasons.h"

namespace toftwin::drivers {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

/// A camera's life, told to a Recovery at times that the test chooses.
struct Life {
  Recovery recovery{{.first_retry = milliseconds{100},
                     .longest_retry = milliseconds{400},
                     .hung_after = milliseconds{3000}}};
  SteadyTime now{std::chrono::hours{1}};
  SourceInfo info;
  SourceState state{{{"exposure_us", 1000.0, {}}, {"gain", 1.0, {}}}, std::nullopt};

  Life() {
    info.model = "a camera";
    info.kind = FrameKind::Real;
    info.frame_interval = 50_ms;
  }
  void open() { recovery.opened(info, state); }
  Frame frame(std::int64_t device_ns = 0) { return frame(device_ns, now); }
  Frame frame(std::int64_t device_ns, SteadyTime arrived) {
    Frame frame;
    frame.provenance.kind = info.kind;
    frame.moment.exposures = {{{device_ns}, 1_ms, 30_MHz}, {{device_ns + 10}, 1_ms, 30_MHz}};
    frame.moment.clock = {.host_minus_device_ns = 5000 - device_ns, .uncertainty_ns = 1};
    recovery.frame(frame, arrived);
    return frame;
  }
  void lose(std::string_view why = "unplugged") { recovery.lost(now, why); }
};

TEST(Recovery, TriesSoonThenAtMostAsRarelyAsAllowed) {
  Life life;
  for (const int wait_ms : {100, 200, 400, 400}) {
    life.recovery.openFailed(life.now);
    EXPECT_EQ(life.recovery.retryAt() - life.now, milliseconds{wait_ms});
    life.now = life.recovery.retryAt();
  }
  life.open();
  EXPECT_TRUE(life.recovery.isPresent());
  life.frame();
  life.recovery.started(life.now);
  life.lose();
  EXPECT_FALSE(life.recovery.isPresent());
  EXPECT_EQ(life.recovery.retryAt() - life.now, milliseconds{100})
      << "a frame makes it hopeful again";
}

TEST(Recovery, AGapIsCountedOnce) {
  Life life;
  life.open();
  life.recovery.started(life.now);
  life.now += milliseconds{30};
  life.lose("the cable is out");
  life.recovery.openFailed(life.now);
  life.lose("it does not start");
  life.now += milliseconds{970};
  life.open();
  life.recovery.started(life.now);
  const Frame frame = life.frame(1'000'000'000);
  EXPECT_EQ(frame.dropped_by_device, 19u) << "of 20 intervals, the last one ends with this frame";
  EXPECT_EQ(frame.dropped_because, "the cable is out");
  life.now += milliseconds{50};
  const Frame next = life.frame(1'050'000'000);
  EXPECT_EQ(next.dropped_by_device, 0u);
  EXPECT_EQ(next.dropped_because, "");
}

TEST(LossReasons, TellHowManyFramesEachReasonCost) {
  LossReasons losses;
  losses.add("a");
  losses.add("b", 2);
  losses.add("a");
  losses.account(3, "nothing of it came");
  EXPECT_EQ(losses.text(), "a (2), b (2)") << "all that the numbers leave out is accounted for";
  losses.account(7, "nothing of it came");
  Frame frame;
  losses.tell(frame);
  EXPECT_EQ(frame.dropped_by_device, 7u);
  EXPECT_EQ(frame.dropped_because, "a (2), b (2), nothing of it came (3)");
  EXPECT_EQ(losses.frames(), 0u);
  losses.tell(frame);
  EXPECT_EQ(frame.dropped_because, "a (2), b (2), nothing of it came (3)");
}

TEST(LossReasons, DoNotGrowWithWordsThatNeverRepeat) {
  LossReasons losses;
  for (int i = 0; i < 10'000; ++i) losses.add("byte " + std::to_string(i));
  EXPECT_EQ(losses.frames(), 10'000u);
  EXPECT_NE(losses.text().find("byte 7 (1), other reasons (9992)"), std::string::npos) << losses.text();
}

TEST(Recovery, WhatIsLostWhileNobodyLooksIsNoGap) {
  Life life;
  life.open();
  life.recovery.started(life.now);
  life.frame();
  for (const bool is_lost_first : {false, true}) {
    if (is_lost_first) life.lose();
    life.recovery.unwanted();
    if (!is_lost_first) life.lose();
    life.now += seconds{60};
    life.open();
    life.recovery.started(life.now);
    const Frame frame = life.frame(life.now.time_since_epoch().count());
    EXPECT_EQ(frame.dropped_by_device, 0u) << is_lost_first;
    EXPECT_EQ(frame.dropped_because, "") << is_lost_first;
  }
}

TEST(Recovery, ATriggeredCameraLosesNoFramesThatNobodyAskedFor) {
  Life life;
  life.info.can_trigger = true;
  life.open();
  life.recovery.started(life.now);
  life.lose();
  life.now += seconds{5};
  life.open();
  const Frame frame = life.frame();
  EXPECT_EQ(frame.dropped_by_device, 0u);
}

TEST(Recovery, SettingsThatClientsChangedAreSetAgainAndOnlyThose) {
  Life life;
  const Transform<World, Camera> pose{{1, 0, 0, 0}, {0, 0, 2}};
  life.info.can_set_pose = true;
  life.open();
  EXPECT_TRUE(life.recovery.settings().parameters.empty());
  SourceState changed = life.state;
  changed.parameters[0].value = 300.0;
  changed.world_from_camera = pose;
  life.recovery.changed(changed);
  life.lose();
  life.state.parameters[1].value = 2.0;  // the gain, which no client set, is another now
  life.open();
  for (int round = 0; round < 2; ++round) {
    const auto settings = life.recovery.settings();
    ASSERT_EQ(settings.parameters.size(), 1u);
    EXPECT_EQ(settings.parameters[0].name, "exposure_us");
    EXPECT_EQ(settings.parameters[0].value, 300.0);
    EXPECT_EQ(settings.world_from_camera, pose);
    life.lose();
    life.open();
  }
  life.state = changed;  // it kept them by itself
  life.open();
  EXPECT_TRUE(life.recovery.settings().parameters.empty());
}

TEST(Recovery, AChoiceIsSetAgainByItsName) {
  Life life;
  life.state.parameters[1] = {.name = "gain", .value = 0.0, .text = "Low", .choices = {"Low", "High"}};
  life.open();
  SourceState changed = life.state;
  changed.parameters[1].text = "High";  // and its number is not told
  changed.parameters[1].value.reset();
  life.recovery.changed(changed);
  life.lose();
  life.open();
  const auto settings = life.recovery.settings();
  ASSERT_EQ(settings.parameters.size(), 1u);
  EXPECT_EQ(settings.parameters[0].text, "High");
}

TEST(Recovery, ATextThatIsNoNumberIsSetAgain) {
  Life life;
  life.state.parameters[1] = {.name = "gain", .text = "left"};
  life.open();
  SourceState changed = life.state;
  changed.parameters[1].text = "right";
  life.recovery.changed(changed);
  life.lose();
  life.open();
  const auto settings = life.recovery.settings();
  ASSERT_EQ(settings.parameters.size(), 1u);
  EXPECT_EQ(settings.parameters[0].text, "right");
}

TEST(Recovery, DeviceTimeGoesOnWhenTheCamerasClockBeginsAnew) {
  Life life;
  life.open();
  life.recovery.started(life.now);
  const Frame before = life.frame(9'000'000'000);
  EXPECT_EQ(before.moment.exposures[0].start.ns, 9'000'000'000);
  life.lose();
  life.now += seconds{4};
  life.open();
  life.recovery.started(life.now);
  const Frame after = life.frame(100);
  EXPECT_EQ(after.moment.exposures[0].start.ns, 9'000'000'010 + 4'000'000'000);
  // Host time of an exposure is what it was: device time and the relation move together.
  EXPECT_EQ(after.moment.exposures[0].start.ns + after.moment.clock.host_minus_device_ns, 5000);
  life.now += milliseconds{50};
  const Frame next = life.frame(50'000'100);
  EXPECT_EQ(next.moment.exposures[0].start.ns - after.moment.exposures[0].start.ns, 50'000'000);
}

// The camera's clock begins at 0 with each boot, and is the master's after ten frames. Of the first frame
// after a boot the network makes the arrival later or earlier than others, so that device time runs a little
// ahead or behind.
TEST(Recovery, DeviceTimeIsTheMastersAgainAfterEachReboot) {
  constexpr std::int64_t kEpoch_ns = 1'790'000'000'000'000'000, kInterval_ns = 50'000'000;
  for (const int late_ms : {0, 3, 70, 200, -3}) {
    Life life;
    const SteadyTime began = life.now;
    std::int64_t last_ns = -1;
    for (int boot = 0; boot < 5; ++boot) {
      DeviceClock clock{DeviceClock::Options{.follows_steps_ahead = true}};
      life.open();
      life.recovery.started(life.now);
      const SteadyTime booted = life.now;
      for (int i = 0; i < 40; ++i, life.now += nanoseconds{kInterval_ns}) {
        const std::int64_t master_ns = kEpoch_ns + nanoseconds{life.now - began}.count();
        const std::int64_t stamp_ns = i < 10 ? nanoseconds{life.now - booted}.count() : master_ns;
        const SteadyTime arrived = life.now + milliseconds{boot > 0 && i == 0 ? late_ms : 0};
        const std::int64_t time_ns =
            life.frame(clock.read(stamp_ns, arrived).ns, arrived).moment.exposures[0].start.ns;
        ASSERT_GT(time_ns, last_ns) << late_ms << ": boot " << boot << ", frame " << i;
        if (i >= 20) {
          ASSERT_EQ(time_ns, master_ns) << late_ms << ": boot " << boot << ", frame " << i;
        }
        last_ns = time_ns;
      }
      life.lose();
      life.now += seconds{4};
    }
  }
}

TEST(Recovery, ASimulatedFramesTimeIsLeftAlone) {
  Life life;
  life.info.kind = FrameKind::Simulated;
  life.open();
  life.recovery.started(life.now);
  life.frame(9'000'000'000);
  life.lose();
  life.open();
  EXPECT_EQ(life.frame(0).moment.exposures[0].start.ns, 0);
}

TEST(Recovery, AFreeRunningCameraThatIsSilentForLongHangs) {
  Life life;
  life.open();
  EXPECT_FALSE(life.recovery.timedOut(life.now).has_value()) << "not started";
  life.recovery.started(life.now);
  life.now += milliseconds{2999};
  EXPECT_FALSE(life.recovery.timedOut(life.now).has_value());
  life.now += milliseconds{1};
  const auto hung = life.recovery.timedOut(life.now);
  ASSERT_TRUE(hung.has_value());
  EXPECT_NE(hung->message.find("a camera hangs"), std::string::npos);
  life.info.frame_interval = 1_s;  // slow: ten intervals
  life.open();
  life.recovery.started(life.now);
  life.now += milliseconds{9999};
  EXPECT_FALSE(life.recovery.timedOut(life.now).has_value());
}

TEST(Recovery, SimulatorsAndTriggeredCamerasMayTakeTheirTime) {
  for (const bool is_triggered : {false, true}) {
    Life life;
    (is_triggered ? life.info.can_trigger : life.info.can_lockstep) = true;
    life.open();
    life.recovery.started(life.now);
    life.now += std::chrono::hours{1};
    EXPECT_FALSE(life.recovery.timedOut(life.now).has_value());
  }
}

}  // namespace
}  // namespace toftwin::drivers
