// SPDX-License-Identifier: Apache-2.0
// A device clock that runs too fast, wraps around and is set, seen through delays.
#include "drivers/clock_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace toftwin::drivers {
namespace {

using std::chrono::nanoseconds;

constexpr std::uint64_t kSeed = 20'264;
constexpr double kDrift = -37e-6;  // host seconds gained per device second
constexpr std::int64_t kInterval_ns = 40'000'000;
constexpr std::int64_t kOffset_ns = 1'700'000'123'456'789;

/// Arrivals of frames of a device whose clock is a straight line to the host's.
struct Arrivals {
  std::mt19937_64 random;
  double noise_ns = 500'000.0;
  double late_share = 0.0;  ///< of frames that are late by 20 ms on average

  std::int64_t of(std::int64_t device_ns) {
    double delay = std::normal_distribution<double>{0.0, noise_ns}(random);
    if (std::bernoulli_distribution{late_share}(random)) {
      delay += std::exponential_distribution<double>{1.0 / 20e6}(random);
    }
    return hostOf(device_ns) + std::llround(delay);
  }
  static std::int64_t hostOf(std::int64_t device_ns) {
    return device_ns + kOffset_ns + std::llround(kDrift * static_cast<double>(device_ns));
  }
};

struct Errors {  // in predicted standard deviations
  std::vector<double> offset, drift;
};
Errors errorsOfTrials(int trials, int frames, double late_share) {
  Errors errors;
  for (int trial = 0; trial < trials; ++trial) {
    Arrivals arrivals{.random = std::mt19937_64{kSeed + static_cast<std::uint64_t>(trial)},
                      .late_share = late_share};
    ClockFit fit;
    std::int64_t device_ns = 0;
    for (int i = 0; i < frames; ++i, device_ns += kInterval_ns) {
      fit.add({device_ns}, arrivals.of(device_ns));
    }
    device_ns -= kInterval_ns;
    const auto fitted = fit.estimate().value();
    const auto truth =
        static_cast<double>(Arrivals::hostOf(device_ns) - device_ns - fitted.host_minus_device_ns);
    errors.offset.push_back(truth / fitted.offset_sd_ns);
    errors.drift.push_back((fitted.drift - kDrift) / fitted.drift_sd);
  }
  return errors;
}
double meanSquare(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return sum / static_cast<double>(values.size());
}

// The mean square of n standard normal numbers is 1 ± sqrt(2/n). The sd is itself estimated from
// 256 points: a t distribution with 254 degrees of freedom, variance 254/252 = 1.008. At 5 sigma
// each of the two is wrong once in 1.7 million.
TEST(ClockFit, KnowsHowWellItKnows) {
  RecordProperty("seed", std::to_string(kSeed));
  constexpr int kTrials = 400;
  const Errors errors = errorsOfTrials(kTrials, 256, 0.0);
  const double tolerance = 5.0 * std::sqrt(2.0 / kTrials);
  EXPECT_NEAR(meanSquare(errors.offset), 1.008, tolerance);
  EXPECT_NEAR(meanSquare(errors.drift), 1.008, tolerance);
}

// An eighth of the late tenth falls within c·s = 2.3 ms, where the bisquare does not reject it, and
// pulls by its ψ-weighted mean: at most 0.1 · (1 − exp(−2.3/20)) · 1.2 ms = 13 us, of a standard
// deviation of 2 · 0.5 ms/√230 = 66 us. A largest of 400 normal numbers beyond 5 has a probability
// of 2e-4; 5.2 holds the pull.
TEST(ClockFit, LateFramesDoNotMoveIt) {
  const Errors errors = errorsOfTrials(400, 256, 0.1);
  for (const double error : errors.offset) EXPECT_LT(std::abs(error), 5.2);
  for (const double error : errors.drift) EXPECT_LT(std::abs(error), 5.2);
  EXPECT_LT(meanSquare(errors.offset), 1.008 + 0.2 * 0.2 + 5.0 * std::sqrt(2.0 / 400));
}

TEST(ClockFit, IsSilentUntilItCanTell) {
  ClockFit fit;
  for (std::size_t i = 0; i + 1 < ClockFit::kFewest; ++i)
    fit.add({static_cast<std::int64_t>(i)}, 5);
  EXPECT_FALSE(fit.estimate().has_value());
  fit.clear();
  for (std::size_t i = 0; i < ClockFit::kFewest; ++i) fit.add({7}, 5);
  EXPECT_FALSE(fit.estimate().has_value()) << "all at one time";
}

TEST(ClockFit, ExactPointsOfAnyEpochAreFittedToTheNanosecond) {
  ClockFit fit;
  for (std::int64_t i = 0; i < 100; ++i) {
    const std::int64_t device = 1'700'000'000'000'000'000 + i * 1'000'000'000;
    fit.add({device}, device + 1000 + 2 * i);
  }
  const auto fitted = fit.estimate().value();
  EXPECT_EQ(fitted.host_minus_device_ns, 1000 + 2 * 99);
  EXPECT_NEAR(fitted.drift, 2e-9, 1e-15);
}

// All of them were read at one time: as a line they would say that the device's second is none of the host's.
TEST(ClockFit, FramesThatWaitedInAQueueSayNoDrift) {
  ClockFit fit;
  for (std::int64_t i = 0; i < 16; ++i) fit.add({i * kInterval_ns}, kOffset_ns);
  EXPECT_LE(std::abs(fit.estimate()->drift), 1e-3);
}

/// Feeds a DeviceClock with what a camera would stamp.
struct Camera {
  DeviceClock clock;
  Arrivals arrivals{.random = std::mt19937_64{kSeed}};
  std::int64_t true_ns = 0;    // a device clock that nobody sets
  std::int64_t set_by_ns = 0;  // what somebody did to it
  std::int64_t wraps_after_ns = 0;
  std::optional<DeviceTime> last{};

  DeviceTime frame(std::int64_t late_ns = 0, std::int64_t pause_ns = kInterval_ns) {
    true_ns += pause_ns;
    std::int64_t stamp = true_ns + set_by_ns;
    if (wraps_after_ns > 0) stamp = (stamp % wraps_after_ns + wraps_after_ns) % wraps_after_ns;
    const SteadyTime arrived{nanoseconds{arrivals.of(true_ns) + late_ns}};
    const DeviceTime time = clock.read(stamp, arrived);
    if (last) {
      EXPECT_GT(time, *last) << "device time went back";
    }
    last = time;
    return time;
  }
  void frames(int count) {
    for (int i = 0; i < count; ++i) frame();
  }
};

TEST(DeviceClock, ACounterOf32BitsOfMicrosecondsGoesOnWhenItWraps) {
  constexpr std::int64_t kWrap = (std::int64_t{1} << 32) * 1000;
  Camera camera{.clock = DeviceClock{{.wraps_after_ns = kWrap}}, .wraps_after_ns = kWrap};
  const DeviceTime first = camera.frame();
  const std::int64_t begin = camera.true_ns;
  for (int i = 0; i < 300; ++i) camera.frame(0, 60'000'000'000);  // five hours: four wraps
  EXPECT_EQ(camera.last->ns - first.ns, camera.true_ns - begin);
  EXPECT_EQ(camera.clock.steps(), 0u);
}

TEST(DeviceClock, APauseOfSeveralWrapsIsBridgedByTheHostsClock) {
  constexpr std::int64_t kWrap = (std::int64_t{1} << 32) * 1000;
  Camera camera{.clock = DeviceClock{{.wraps_after_ns = kWrap}}, .wraps_after_ns = kWrap};
  camera.frames(50);
  const DeviceTime before = *camera.last;
  const DeviceTime after = camera.frame(0, 3 * kWrap + kInterval_ns);
  EXPECT_EQ(after.ns - before.ns, 3 * kWrap + kInterval_ns);
}

TEST(DeviceClock, AClockThatIsSetKeepsItsPaceAndItsRelation) {
  for (const std::int64_t by_s : {1'700'000'000LL, 3600LL, 1LL, -1LL, -10LL, -3600LL}) {
    Camera camera{.clock = DeviceClock{{}}};
    camera.frames(200);
    const std::int64_t before = camera.last->ns - camera.true_ns;
    camera.set_by_ns += by_s * 1'000'000'000;
    camera.frames(20);
    // What was set is taken off again up to the scatter of the one arrival that it was seen at (6
    // sigma) and what the fit knew (6 x 2 x 0.5 ms/sqrt(200), of the order of 0.4 ms).
    EXPECT_NEAR(static_cast<double>(camera.last->ns - camera.true_ns - before), 0.0, 3.5e6) << by_s;
    EXPECT_EQ(camera.clock.steps(), 1u) << by_s;
  }
}

// The frame that a step is seen at may be late, the first of a queue that is read at 10 ms apiece. The others
// come early then by what it was late, and nothing of it may stay: of the time, as above, and of the relation
// what the fit does not know (8 sigma: the points of the queue are where the line is).
TEST(DeviceClock, AStepThatIsSeenAtALateFrameKeepsNothingOfItsLateness) {
  for (const std::int64_t first_late_ns : {860'000'000, 300'000'000, 25'000'000}) {
    for (const std::int64_t by_s : {1'700'000'000LL, -3600LL}) {
      Camera camera{.clock = DeviceClock{{}}};
      camera.frames(200);
      const std::int64_t before = camera.last->ns - camera.true_ns;
      camera.set_by_ns += by_s * 1'000'000'000;
      for (std::int64_t late_ns = first_late_ns; late_ns > 0; late_ns -= kInterval_ns - 10'000'000)
        camera.frame(late_ns);
      camera.frames(20);
      EXPECT_NEAR(static_cast<double>(camera.last->ns - camera.true_ns - before), 0.0, 3.5e6)
          << first_late_ns;
      EXPECT_EQ(camera.clock.steps(), 1u) << first_late_ns;
      const auto now = *camera.clock.estimate();
      EXPECT_NEAR(static_cast<double>(camera.last->ns + now.host_minus_device_ns),
                  static_cast<double>(Arrivals::hostOf(camera.true_ns)), 3.5e6 + 8.0 * now.offset_sd_ns);
    }
  }
}

// As with PTP: the camera counts from its start until it has found the master.
TEST(DeviceClock, AClockThatFollowsAMasterTakesItsTimeOver) {
  Camera camera{.clock = DeviceClock{{.follows_steps_ahead = true}}};
  camera.frames(50);
  EXPECT_EQ(camera.last->ns, camera.true_ns + camera.set_by_ns);
  camera.set_by_ns += 1'700'000'000'000'000'000;
  camera.frames(20);
  EXPECT_EQ(camera.last->ns, camera.true_ns + camera.set_by_ns) << "two cameras of one master would not have one time";
  EXPECT_EQ(camera.clock.steps(), 1u);
  EXPECT_GE(camera.clock.relation(0_ms, 0_ms).uncertainty_ns, 0) << "the relation is learnt anew";
  const DeviceTime before = *camera.last;
  camera.set_by_ns -= 3'600'000'000'000;
  camera.frames(20);
  EXPECT_GT(camera.last->ns, before.ns) << "device time increases all the same";
}

TEST(DeviceClock, ADamagedStampIsNoMastersTime) {
  Camera camera{.clock = DeviceClock{{.follows_steps_ahead = true}}};
  camera.frames(50);
  for (const std::int64_t damage_ns : {3'600'000'000'000, 1'000'000'000'000'000'000}) {
    camera.set_by_ns += damage_ns;
    camera.frames(1);
    camera.set_by_ns -= damage_ns;
    camera.frames(3);
    EXPECT_EQ(camera.last->ns, camera.true_ns + camera.set_by_ns) << damage_ns;
  }
  EXPECT_EQ(camera.clock.steps(), 0u);
}

TEST(DeviceClock, AStepBackByLessThanThePauseBeforeItIsFoundToo) {
  Camera camera{.clock = DeviceClock{{}}};
  camera.frames(200);
  const std::int64_t before = camera.last->ns - camera.true_ns;
  camera.set_by_ns -= 2'000'000'000;
  camera.frame(0, 5'000'000'000);  // goes on by 3 s instead of 5 s
  camera.frames(20);
  EXPECT_NEAR(static_cast<double>(camera.last->ns - camera.true_ns - before), 0.0, 3.5e6);
  EXPECT_EQ(camera.clock.steps(), 1u);
}

TEST(DeviceClock, FramesThatComeLateTogetherAreNoStep) {
  Camera camera{.clock = DeviceClock{{}}};
  camera.frames(200);
  const std::int64_t before = camera.last->ns - camera.true_ns;
  const auto relation = camera.clock.estimate()->host_minus_device_ns;
  for (std::int64_t i = 0; i < 6; ++i) camera.frame(3'000'000'000 - i * 40'000'000);
  camera.frames(5);
  EXPECT_EQ(camera.last->ns - camera.true_ns, before);
  EXPECT_EQ(camera.clock.steps(), 0u);
  const auto now = *camera.clock.estimate();
  // The line goes on: 11 frames of drift, and five more points in the fit (6 sigma).
  EXPECT_NEAR(static_cast<double>(now.host_minus_device_ns - relation), kDrift * 11 * 40e6,
              6.0 * now.offset_sd_ns);
}

TEST(DeviceClock, AQueueThatIsReadAtOnceIsNoStep) {
  Camera camera{.clock = DeviceClock{{}}};
  camera.frames(200);
  const std::int64_t before = camera.last->ns - camera.true_ns;
  for (std::int64_t late_ns = 1'500'000'000; late_ns > 0; late_ns -= kInterval_ns - 1'000'000) {
    camera.frame(late_ns);
    EXPECT_EQ(camera.last->ns - camera.true_ns, before);
  }
  camera.frames(5);
  EXPECT_EQ(camera.last->ns - camera.true_ns, before);
  EXPECT_EQ(camera.clock.steps(), 0u);
}

TEST(DeviceClock, NoStampIsTooMuchForIt) {
  std::mt19937_64 random{kSeed};
  for (const std::int64_t wraps_after_ns : {std::int64_t{0}, std::int64_t{4'294'967'296'000}}) {
    for (const bool follows : {false, true}) {
      DeviceClock clock{{.wraps_after_ns = wraps_after_ns, .follows_steps_ahead = follows}};
      SteadyTime arrived{std::chrono::hours{1}};
      DeviceTime last{std::numeric_limits<std::int64_t>::min()};
      for (int i = 0; i < 2000; ++i) {
        arrived += std::chrono::milliseconds{20};
        const std::uint64_t anything = random() >> (random() % 64);
        const DeviceTime time =
            clock.read(static_cast<std::int64_t>(random() % 2 == 0 ? ~anything : anything), arrived);
        ASSERT_GT(time, last) << i << ", seed " << kSeed;
        last = time;
        static_cast<void>(clock.relation(1_ms, 1_ms));
      }
    }
  }
}

TEST(DeviceClock, TheRelationTakesTheKnownDelayOffAndSaysItsUncertainty) {
  Camera camera{.clock = DeviceClock{{}}};
  EXPECT_EQ(camera.clock.relation(0_ms, 0_ms).uncertainty_ns, -1);
  camera.frames(100);
  const auto plain = camera.clock.relation(0_ms, 0_ms);
  const auto delayed = camera.clock.relation(20_ms, 3_ms);
  // The two readings of the host's clocks may differ by as much as a wall clock is slewed
  // meanwhile.
  EXPECT_NEAR(static_cast<double>(plain.host_minus_device_ns - delayed.host_minus_device_ns), 20e6,
              1e5);
  EXPECT_GE(delayed.uncertainty_ns, 3'000'000);
  EXPECT_LT(plain.uncertainty_ns, 1'000'000);
}

}  // namespace
}  // namespace toftwin::drivers
