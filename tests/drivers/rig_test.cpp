// SPDX-License-Identifier: Apache-2.0
// The mover against an emulated controller, over a real socket.
#include "drivers/rig/rig.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <thread>

#include "drivers/rig/kinematics.h"
#include "emulated_rig.h"

namespace toftwin::rig {
namespace {

using test::EmulatedRig;

Result<RigFile> fileOf(const EmulatedRig& rig, const std::string& more = {}) {
  const auto path = rig.writeFile(more);
  auto file = loadRig(path);
  std::filesystem::remove(path);
  return file;
}

std::unique_ptr<Rig> openRig(const EmulatedRig& emulated, const std::string& more = {}) {
  auto file = fileOf(emulated, more);
  EXPECT_TRUE(file.ok()) << file.error().message;
  if (!file) return nullptr;
  auto rig = Rig::open(*std::move(file));
  EXPECT_TRUE(rig.ok()) << rig.error().message;
  return rig ? *std::move(rig) : nullptr;
}

void waitForRest(EmulatedRig& emulated) {
  for (int i = 0; i < 10'000 && emulated.isMoving(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
}

TEST(Rig, GoesWhereItIsAskedToAndSaysWhereItStands) {
  EmulatedRig emulated;
  emulated.setTemperature(-3.5);
  const auto rig = openRig(emulated);
  ASSERT_NE(rig, nullptr);
  const auto there = rig->moveAxes({123.4, -30.0});
  ASSERT_TRUE(there.ok()) << there.error().message;
  EXPECT_FALSE(emulated.isMoving());
  EXPECT_NEAR(emulated.load(0), 123.4, 0.05);
  EXPECT_NEAR(emulated.load(1), -30.0, 0.01);
  EXPECT_NEAR(there->positions.at(0), 123.4, 0.05);
  EXPECT_NEAR(there->positions.at(1), -30.0, 0.01);
  ASSERT_EQ(there->temperatures.size(), 1u);
  EXPECT_EQ(there->temperatures[0].where, "room");
  EXPECT_NEAR(there->temperatures[0].value.in(celsius), -3.5, 1e-9);
}

TEST(Rig, TakesTheCameraToAPose) {
  EmulatedRig emulated;
  const auto rig = openRig(emulated);
  ASSERT_NE(rig, nullptr);
  const auto pose = rig->poseAt({200.0, 25.0});
  const auto there = rig->moveTo(pose);
  ASSERT_TRUE(there.ok()) << there.error().message;
  EXPECT_NEAR(emulated.load(0), 200.0, 0.05);
  EXPECT_NEAR(emulated.load(1), 25.0, 0.01);
  const int departures = emulated.departures();
  const auto nowhere = rig->moveTo(Transform<World, Camera>{{1, 0, 0, 0}, {0, 5, 0}});
  ASSERT_FALSE(nowhere.ok());
  EXPECT_NE(nowhere.error().message.find("nearest is 5"), std::string::npos)
      << nowhere.error().message;
  EXPECT_EQ(emulated.departures(), departures);
}

TEST(Rig, BeyondItsSoftLimitsNothingIsAskedFor) {
  EmulatedRig emulated;
  const auto rig = openRig(emulated);
  ASSERT_NE(rig, nullptr);
  for (const std::vector<double>& beyond :
       {std::vector<double>{400.1, 0.0}, {0.0, -170.1}, {NAN, 0.0}, {0.0}}) {
    const auto refused = rig->moveAxes(beyond);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, Error::Code::InvalidArgument);
  }
  EXPECT_EQ(emulated.departures(), 0);
}

TEST(Rig, ThatDoesNotKnowWhereItIsIsHomedFirst) {
  EmulatedRig emulated{{.is_homed = false}};
  const auto rig = openRig(emulated);
  ASSERT_NE(rig, nullptr);
  const auto refused = rig->moveAxes({10.0, 0.0});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("home"), std::string::npos);
  EXPECT_EQ(emulated.departures(), 0);
  const auto homed = rig->home();
  ASSERT_TRUE(homed.ok()) << homed.error().message;
  EXPECT_TRUE(rig->moveAxes({10.0, 0.0}).ok());
  const auto again = rig->home();
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_NEAR(emulated.load(0), 0.0, 0.05) << "it said that it was homed before it had moved";
}

TEST(Rig, BacklashIsTakenUpFromTheSameSide) {
  constexpr double kBacklash = 2.0;
  for (const bool is_careful : {false, true}) {
    EmulatedRig emulated{{.backlash = kBacklash}};
    auto file = fileOf(emulated);
    ASSERT_TRUE(file.ok());
    if (is_careful) file->axes[0].approach = 5.0;
    const auto rig = Rig::open(*file);
    ASSERT_TRUE(rig.ok());
    ASSERT_TRUE((*rig)->moveAxes({50.0, 0.0}).ok());
    ASSERT_TRUE((*rig)->moveAxes({100.0, 0.0}).ok());
    const double from_below = emulated.load(0);
    ASSERT_TRUE((*rig)->moveAxes({150.0, 0.0}).ok());
    ASSERT_TRUE((*rig)->moveAxes({100.0, 0.0}).ok());
    EXPECT_NEAR(emulated.load(0) - from_below, is_careful ? 0.0 : kBacklash, 0.1) << is_careful;
  }
}

// ---- what goes wrong ---------------------------------------------------------------------------

struct Mishap {
  const char* name;
  std::function<void(EmulatedRig&)> prepare;
  Error::Code code;
  const char* says;
};
void PrintTo(const Mishap& mishap, std::ostream* out) { *out << mishap.name; }

class RigMishap : public testing::TestWithParam<Mishap> {};
INSTANTIATE_TEST_SUITE_P(
    Every, RigMishap,
    testing::Values(Mishap{"Stalls", [](auto& rig) { rig.stallAt(100); }, Error::Code::Timeout,
                           "has stalled: x stands at 10"},
                    Mishap{"DropsTheLine", [](auto& rig) { rig.dropLineAt(100, false); },
                           Error::Code::Disconnected, ""},
                    Mishap{"AnswersAnException", [](auto& rig) { rig.refuseAt(100); },
                           Error::Code::PermissionDenied, "exception 4"},
                    Mishap{"HasItsEmergencyStopPressed",
                           [](auto& rig) { rig.pressEmergencyAt(100); },
                           Error::Code::PermissionDenied, "emergency stop is pressed"},
                    Mishap{"ReportsAFault", [](auto& rig) { rig.failAt(100, 4711); },
                           Error::Code::Busy, "code 4711"}),
    [](const auto& test) { return std::string{test.param.name}; });

TEST_P(RigMishap, StopsTheMotionAndIsReported) {
  EmulatedRig emulated;
  const auto rig = openRig(emulated);
  ASSERT_NE(rig, nullptr);
  GetParam().prepare(emulated);
  const auto moved = rig->moveAxes({300.0, 0.0});
  ASSERT_FALSE(moved.ok());
  EXPECT_EQ(moved.error().code, GetParam().code) << moved.error().message;
  EXPECT_NE(moved.error().message.find(GetParam().says), std::string::npos)
      << moved.error().message;
  EXPECT_NE(moved.error().message.find("The rig was told to stop"), std::string::npos)
      << moved.error().message;
  EXPECT_TRUE(emulated.isStopped());
  waitForRest(emulated);
  EXPECT_GE(emulated.load(0), 99.0);
  EXPECT_LT(emulated.load(0), 250.0) << "it went on";
}

/// With times that a busy machine keeps, too.
RigFile patientFileOf(const EmulatedRig& emulated) {
  auto file = fileOf(emulated);
  EXPECT_TRUE(file.ok()) << file.error().message;
  file->answer_time = 10_s;
  file->stall_time = file->home_stall_time = 30_s;
  file->move_time = file->home_time = 60_s;
  return *file;
}

/// Away from its home, and then held where it stands.
void moveAndHold(EmulatedRig& emulated) {
  const auto rig = Rig::open(patientFileOf(emulated));
  ASSERT_TRUE(rig.ok()) << rig.error().message;
  const auto moved = (*rig)->moveAxes({300.0, 0.0});
  ASSERT_TRUE(moved.ok()) << moved.error().message;
  emulated.stallAt(0.0);
}

TEST(Rig, ThatStallsWhileItHomesIsStoppedAndReportedAndHomesWhenItIsFree) {
  EmulatedRig emulated;
  moveAndHold(emulated);
  RigFile file = patientFileOf(emulated);
  file.home_stall_time = 150_ms;
  const auto rig = Rig::open(file);
  ASSERT_TRUE(rig.ok()) << rig.error().message;
  const auto homed = (*rig)->home();
  ASSERT_FALSE(homed.ok());
  EXPECT_EQ(homed.error().code, Error::Code::Timeout);
  EXPECT_NE(homed.error().message.find("has stalled while it looked for its home"), std::string::npos)
      << homed.error().message;
  EXPECT_NE(homed.error().message.find("The rig was told to stop"), std::string::npos)
      << homed.error().message;
  EXPECT_TRUE(emulated.isStopped());
  EXPECT_FALSE(emulated.isHoming()) << "whoever releases the stop would send it home";
  emulated.stallAt(1e9);
  const auto freed = Rig::open(patientFileOf(emulated));
  ASSERT_TRUE(freed.ok()) << freed.error().message;
  const auto again = (*freed)->home();
  EXPECT_TRUE(again.ok()) << again.error().message;
}

TEST(Rig, ThatTellsNoPositionsUntilItIsHomedCanBeLeftUnwatched) {
  EmulatedRig emulated;
  moveAndHold(emulated);
  RigFile file = patientFileOf(emulated);
  file.stall_time = 150_ms;
  file.home_stall_time = 0_s;
  const auto rig = Rig::open(file);
  ASSERT_TRUE(rig.ok()) << rig.error().message;
  std::jthread later{[&](const std::stop_token& stop) {
    using std::chrono::milliseconds;
    while (!emulated.isHoming() && !stop.stop_requested()) std::this_thread::sleep_for(milliseconds{1});
    std::this_thread::sleep_for(milliseconds{500});  // more than three times that of a motion
    emulated.stallAt(1e9);
  }};
  const auto homed = (*rig)->home();
  EXPECT_TRUE(homed.ok()) << homed.error().message;
}

TEST(Rig, WhoeverInterruptsStopsIt) {
  EmulatedRig emulated;
  const auto rig = openRig(emulated);
  ASSERT_NE(rig, nullptr);
  const auto moved = rig->moveAxes({300.0, 0.0}, [&] { return emulated.load(0) > 50.0; });
  ASSERT_FALSE(moved.ok());
  EXPECT_EQ(moved.error().code, Error::Code::Stopped);
  EXPECT_TRUE(emulated.isStopped());
  waitForRest(emulated);
  EXPECT_LT(emulated.load(0), 250.0);
  EXPECT_TRUE(rig->moveAxes({300.0, 0.0}).ok()) << "a stop is released by the next motion";
}

// The line is gone for good: nothing can be sent any more, so the controller must stop by itself.
TEST(Rig, AControllerThatMissesOurHeartbeatStops) {
  EmulatedRig emulated{{.speed = 100.0, .stop_without_heartbeat_s = 0.1}};
  const auto rig = openRig(emulated);
  ASSERT_NE(rig, nullptr);
  emulated.dropLineAt(30, true);
  const auto moved = rig->moveAxes({300.0, 0.0});
  ASSERT_FALSE(moved.ok());
  EXPECT_NE(moved.error().message.find("COULD NOT BE TOLD TO STOP"), std::string::npos)
      << moved.error().message;
  waitForRest(emulated);
  EXPECT_LT(emulated.load(0), 150.0);
}

TEST(Rig, AControllerThatFallsSilentIsReportedWithinItsAnswerTimes) {
  EmulatedRig emulated{{.stop_without_heartbeat_s = 0.1}};
  const auto rig = openRig(emulated, "");
  ASSERT_NE(rig, nullptr);
  emulated.fallSilentAt(30);
  const auto moved = rig->moveAxes({300.0, 0.0});
  ASSERT_FALSE(moved.ok());
  EXPECT_EQ(moved.error().code, Error::Code::Timeout) << moved.error().message;
  EXPECT_NE(moved.error().message.find("COULD NOT BE TOLD TO STOP"), std::string::npos);
}

TEST(Rig, AStopFromElsewhereEndsAMotion) {
  EmulatedRig emulated{{.speed = 100.0}};
  const auto rig = openRig(emulated);
  const auto file = fileOf(emulated);
  ASSERT_TRUE(rig != nullptr && file.ok());
  std::jthread other{[&] {
    while (emulated.load(0) < 20.0) std::this_thread::yield();
    EXPECT_TRUE(Rig::stopNow(*file).ok());
  }};
  const auto moved = rig->moveAxes({300.0, 0.0});
  ASSERT_FALSE(moved.ok());
  EXPECT_EQ(moved.error().code, Error::Code::Stopped) << moved.error().message;
  EXPECT_FALSE(rig->moveAxes({300.0, 0.0}).ok()) << "it is not ours to release";
}

TEST(Rig, AStopFromElsewhereBetweenTwoMotionsIsNotReleased) {
  EmulatedRig emulated;
  const auto rig = openRig(emulated);
  const auto file = fileOf(emulated);
  ASSERT_TRUE(rig != nullptr && file.ok());
  ASSERT_TRUE(rig->moveAxes({10.0, 0.0}).ok());
  ASSERT_TRUE(Rig::stopNow(*file).ok());
  const auto moved = rig->moveAxes({20.0, 0.0});
  ASSERT_FALSE(moved.ok());
  EXPECT_EQ(moved.error().code, Error::Code::Stopped);
  EXPECT_EQ(emulated.departures(), 1);
  EXPECT_FALSE(rig->home().ok());
  EXPECT_TRUE(openRig(emulated)->moveAxes({20.0, 0.0}).ok())
      << "whoever comes afterwards knows of it";
}

TEST(Rig, WithThePressedEmergencyStopNothingBegins) {
  EmulatedRig emulated;
  const auto rig = openRig(emulated);
  ASSERT_NE(rig, nullptr);
  emulated.pressEmergency(true);
  EXPECT_FALSE(rig->moveAxes({10.0, 0.0}).ok());
  EXPECT_FALSE(rig->home().ok());
  EXPECT_EQ(emulated.departures(), 0);
}

TEST(Rig, AControllerThatIsNotThereIsNamed) {
  EmulatedRig emulated;
  auto file = fileOf(emulated);
  ASSERT_TRUE(file.ok());
  file->port = 1;
  const auto opened = Rig::open(*file);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, Error::Code::Disconnected);
  EXPECT_NE(opened.error().message.find("127.0.0.1:1"), std::string::npos)
      << opened.error().message;
}

TEST(Rig, ASignalThatTheControllerLacksIsNamed) {
  EmulatedRig emulated;
  auto file = fileOf(emulated);
  ASSERT_TRUE(file.ok());
  file->axes[1].position.address = 900;
  const auto opened = Rig::open(*file);
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().message.find("turn.position (input register 900)"), std::string::npos)
      << opened.error().message;
}

TEST(Rig, SpeaksWithThePlc) {
  EmulatedRig emulated;
  const auto rig = openRig(emulated);
  ASSERT_NE(rig, nullptr);
  EXPECT_FALSE(*rig->isTriggered());
  emulated.setTrigger(true);
  EXPECT_TRUE(*rig->isTriggered());
  ASSERT_TRUE(rig->setCaptured(true).ok());
  EXPECT_TRUE(emulated.isCaptured());
  ASSERT_TRUE(rig->setCaptured(false).ok());
  EXPECT_FALSE(emulated.isCaptured());
}

// ---- files and kinematics ----------------------------------------------------------------------

std::string errorOf(const std::string& toml) {
  const auto path =
      std::filesystem::temp_directory_path() / fmt::format("toftwin-rig-{}.toml", ::getpid());
  std::ofstream{path} << toml;
  const auto file = loadRig(path);
  std::filesystem::remove(path);
  return file ? "" : file.error().message;
}

TEST(RigFile, WhatCannotBeARigIsNamed) {
  const std::string error = errorOf(R"(
poll_ms = 20
stall_time_ms = 20
home_stall_time_ms = 1
stop = {memory = "discrete", address = 0}
home = {memory = "coil", address = 1}
[[axis]]
name = "x"
min = 5
max = 5
direction = [0, 0, 0]
target = {memory = "input", address = 0}
position = {address = 1, scale = 0}
[[axis]]
name = "x"
max = 1
)");
  for (const char* said :
       {"stall_time_ms = 20 must be above poll_ms = 20", "home_stall_time_ms = 1 must be above poll_ms = 20",
        "has no host", "stop is written", "belong together", "min = 5 must be below max",
        "direction has no length", "target is written", "scale 0", "comes twice",
        "target must be there", "position must be there"}) {
    EXPECT_NE(error.find(said), std::string::npos) << said << "\n" << error;
  }
}

RigFile robot() {
  RigFile file;
  const auto axis = [&](const char* name, AxisKind kind, std::array<double, 3> direction,
                        std::array<double, 3> point_m, double limit) {
    AxisSpec spec;
    spec.name = name, spec.kind = kind, spec.direction = direction, spec.point_m = point_m;
    spec.min = -limit, spec.max = limit;
    file.axes.push_back(spec);
  };
  // An arm of six joints with a spherical wrist, upright.
  axis("a1", AxisKind::Rotary, {0, 0, 1}, {0, 0, 0}, 170);
  axis("a2", AxisKind::Rotary, {0, 1, 0}, {0.1, 0, 0.4}, 100);
  axis("a3", AxisKind::Rotary, {0, 1, 0}, {0.1, 0, 0.9}, 120);
  axis("a4", AxisKind::Rotary, {1, 0, 0}, {0, 0, 0.95}, 180);
  axis("a5", AxisKind::Rotary, {0, 1, 0}, {0.6, 0, 0.95}, 110);
  axis("a6", AxisKind::Rotary, {1, 0, 0}, {0, 0, 0.95}, 180);
  file.mount_position_m = {0.7, 0, 0.95};
  file.mount_euler_deg = {0, 90, 0};
  return file;
}

TEST(Kinematics, AnAxisMovesTheCameraAlongAndATurntableAboutItsAxis) {
  RigFile file;
  AxisSpec slide;
  slide.direction = {0, 0, 2};
  AxisSpec table;
  table.kind = AxisKind::Rotary, table.direction = {0, 1, 0}, table.point_m = {0, 0, 1};
  file.axes = {slide, table};
  const auto pose = poseAt(file, {500.0, 90.0});
  // 0.5 m along z; and a quarter turn about y through (0, 0, 1) takes the origin to (−1, 0, 1).
  EXPECT_NEAR(pose.translation_m.x, -1.0, 1e-12);
  EXPECT_NEAR(pose.translation_m.z, 1.5, 1e-12);
  const Vec3d axis = pose.rotate({0, 0, 1});
  EXPECT_NEAR(axis.x, 1.0, 1e-12);
}

// Every pose that the arm can take is found again: where two ways lead there, perhaps by the other.
TEST(Kinematics, APoseOfARobotIsFoundAgain) {
  constexpr std::uint64_t kSeed = 20'271;
  RecordProperty("seed", fmt::format("{}", kSeed));
  std::mt19937_64 random{kSeed};
  const RigFile arm = robot();
  for (int i = 0; i < 50; ++i) {
    std::vector<double> positions;
    for (const AxisSpec& axis : arm.axes) {
      positions.push_back(std::uniform_real_distribution{0.9 * axis.min, 0.9 * axis.max}(random));
    }
    const auto pose = poseAt(arm, positions);
    const auto found = positionsFor(arm, pose, std::vector<double>(6, 0.0));
    ASSERT_TRUE(found.ok()) << i << ": " << found.error().message;
    const auto back = poseAt(arm, *found);
    EXPECT_LT(norm(back.translation_m - pose.translation_m), 1e-4);
    for (std::size_t k = 0; k < 6; ++k) {
      EXPECT_GE((*found)[k], arm.axes[k].min);
      EXPECT_LE((*found)[k], arm.axes[k].max);
    }
  }
}

}  // namespace
}  // namespace toftwin::rig
