// SPDX-License-Identifier: Apache-2.0
// Plan files: what they say, their captures and the order of these.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "calib/plan/place.h"
#include "calib/plan/seen.h"
#include "plans.h"

namespace toftwin::plan {
namespace {

using testing::HasSubstr;

/// Conditions of the sweep below.
constexpr const char* kOrderOfSeed7 = "1 4 0 3 2 0 4 2 1 3 ";
const std::string kSweep =
    "[[block]]\nname = 'sweep'\nkind = 'distance'\ndistance_m = [0.5, 1.0, 1.5, 2.0, 2.5]\nrepeats = 2\n";

std::string errorOf(const std::string& toml) {
  const auto plan = parsePlan(toml, "test.toml");
  return plan ? "no error" : plan.error().message;
}

std::vector<std::string> namesOf(const Schedule& schedule) {
  std::vector<std::string> names;
  for (const auto& one : schedule.captures) names.push_back(one.name);
  return names;
}

TEST(Plan, TakesEachConditionOnceInEachRound) {
  const Schedule schedule = scheduleOfText(kSweep);
  ASSERT_EQ(schedule.captures.size(), 10u);
  for (int round = 0; round < 2; ++round) {
    std::set<std::size_t> conditions;
    for (std::size_t i = 0; i < 5; ++i) {
      const auto& one = schedule.captures[static_cast<std::size_t>(round) * 5 + i];
      conditions.insert(one.condition);
      EXPECT_EQ(one.repeat, round);
    }
    EXPECT_EQ(conditions.size(), 5u);
  }
}

TEST(Plan, HasTheSameOrderForTheSameSeedAndAnotherForAnother) {
  EXPECT_EQ(namesOf(scheduleOfText("seed = 7\n" + kSweep)), namesOf(scheduleOfText("seed = 7\n" + kSweep)));
  EXPECT_NE(namesOf(scheduleOfText("seed = 7\n" + kSweep)), namesOf(scheduleOfText("seed = 8\n" + kSweep)));
}

/// The order is part of the file format: a run goes on after an update of the program. This one was written
/// down.
TEST(Plan, HasTheOrderThatItHadInEveryVersion) {
  std::string order;
  for (const auto& one : scheduleOfText("seed = 7\n" + kSweep).captures)
    order += fmt::format("{} ", one.condition);
  EXPECT_EQ(order, kOrderOfSeed7);
}

TEST(Plan, KeepsABlocksOrderWhateverIsSkippedBeforeIt) {
  const std::string toml =
      "[[block]]\nname = 'first'\nkind = 'distance'\ndistance_m = [1, 2, 3, 4, 5, 6]\n" + kSweep;
  const auto whole = parsePlan(toml, "test.toml"), rest = parsePlan(toml, "test.toml", {"first"});
  ASSERT_TRUE(whole && rest);
  auto names = namesOf(*scheduleOf(*whole));
  names.erase(names.begin(), names.begin() + 6);
  EXPECT_EQ(names, namesOf(*scheduleOf(*rest)));
}

TEST(Plan, CrossesPosesExposuresAndAmbients) {
  const Schedule schedule = scheduleOfText(
      "exposure_us = 500\n[[block]]\nname = 'x'\nkind = 'exposure'\ndistance_m = [1, 2]\nangle_deg = [0, 30, "
      "60]\n"
      "exposure_us = [100, 200]\nambient_klx = [0, 10, 20]\n");
  EXPECT_EQ(schedule.captures.size(), 2u * 3 * 2 * 3);
  const std::set<std::string> names = [&] {
    const auto all = namesOf(schedule);
    return std::set<std::string>{all.begin(), all.end()};
  }();
  EXPECT_EQ(names.size(), schedule.captures.size());
  EXPECT_TRUE(names.contains("x: 2 m, 30°, 100 us, 20 klx"));
}

TEST(Plan, StandsAtItsDistanceAndAngleAndLooksAtTheTarget) {
  const Target target{{0.3, -0.2, 2.0}, normalised(Vec3d{0.2, 0.1, -1.0})};
  for (const double distance : {0.4, 1.7}) {
    for (const double angle : {-70.0, -10.0, 0.0, 45.0}) {
      const auto pose = poseBefore(target, distance, angle);
      const auto world_from_camera = pose.world_from_camera();
      const Vec3d ahead = world_from_camera.translation_m + distance * world_from_camera.rotate({0, 0, 1});
      EXPECT_LT(norm(ahead - target.point_m), 1e-12);
      EXPECT_NEAR(world_from_camera.rotate({1, 0, 0}).y, 0.0, 1e-12) << "it is not upright";
      EXPECT_LT(world_from_camera.rotate({0, -1, 0}).y, 0.0) << "it stands on its head";
      EXPECT_NEAR(sightOf(target, pose).distance_m, distance, 1e-12);
    }
  }
  // About the vertical the angle to the normal is the one asked for where the normal lies level.
  const Target level{{0.0, 0.0, 2.0}, {0.0, 0.0, -1.0}};
  EXPECT_NEAR(sightOf(level, poseBefore(level, 1.5, -40.0)).angle_deg, 40.0, 1e-9);
}

TEST(Target, EndsWhereThePlanSays) {
  const Plan plan = planOf(
      "target_m = [1, 0, 2]\ntarget_size_m = [2.0, 1.0]\n[[block]]\nname = 'a'\nkind = 'distance'\n"
      "distance_m = [1, 2, 3]\n[[block]]\nname = 'b'\nkind = 'distance'\ndistance_m = [1, 2, 3]\n"
      "target_size_m = [0.5, 4.0]\ntarget_normal = [-1, 0, 0]\n");
  const Target wide = targetOf(plan, plan.blocks[0]), tall = targetOf(plan, plan.blocks[1]);
  EXPECT_TRUE(isOnWall(wide, {1.99, 0.49, 2.0}));
  EXPECT_FALSE(isOnWall(wide, {2.01, 0.0, 2.0}));
  EXPECT_FALSE(isOnWall(wide, {1.0, -0.51, 2.0}));
  EXPECT_TRUE(isOnWall(tall, {1.0, 1.9, 2.24}));
  EXPECT_FALSE(isOnWall(tall, {1.0, 0.0, 2.26}));
  const Plan endless = planOf("[[block]]\nname = 'a'\nkind = 'distance'\ndistance_m = [1, 2, 3]\n");
  EXPECT_TRUE(isOnWall(targetOf(endless, endless.blocks[0]), {1e6, 1e6, 2.0}));
  const auto wrong = parsePlan(
      "target_size_m = [1]\n[[block]]\nname = 'a'\nkind = 'distance'\ndistance_m = [1, 2, 3]\n", "p.toml");
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("must be two numbers, width and height"));
}

/// A camera 1 m before a wall of 1 × 0.5 m: its image shows where the wall ends.
TEST(Target, IsNotExpectedBesideTheWall) {
  const Plan plan = planOf(
      "target_m = [0, 0, 1]\ntarget_size_m = [1.0, 0.5]\n[[block]]\nname = 'a'\nkind = 'distance'\n"
      "distance_m = [1, 2, 3]\n");
  const CameraInfo camera{.width = 101,
                          .height = 101,
                          .fx = 50,
                          .fy = 50,
                          .cx = 50,
                          .cy = 50,
                          .distortion = {},
                          .calibration_id = {}};
  const auto range = wallRange_m(plan, plan.blocks[0], camera, {});
  EXPECT_NEAR(range(50, 50), 1.0F, 1e-6F);
  EXPECT_NEAR(range(74, 50), std::hypot(1.0, 24.0 / 50.0), 1e-6);  // 25 pixels are 0.5 m
  EXPECT_TRUE(std::isnan(range(76, 50)));
  EXPECT_TRUE(std::isfinite(range(50, 62)));
  EXPECT_TRUE(std::isnan(range(50, 63)));
}

TEST(Plan, LocksConditionsWithAllTheirRepeatsAndRepeatsNoLockedOne) {
  const Schedule schedule =
      scheduleOfText(kSweep + "locked = 2\n[[block]]\nname = 'end'\nkind = 'repeats'\ncaptures = 3\n");
  std::map<std::size_t, std::set<bool>> locked;
  std::set<std::size_t> held_back;
  for (const auto& one : schedule.captures) {
    if (one.block == 0) locked[one.condition].insert(one.is_locked);
    if (one.is_locked) held_back.insert(one.condition);
    if (!one.again) continue;
    EXPECT_FALSE(one.is_locked || schedule.captures[*one.again].is_locked);
  }
  for (const auto& [condition, states] : locked) EXPECT_EQ(states.size(), 1u) << condition;
  EXPECT_EQ(held_back.size(), 2u);
  EXPECT_EQ(errorOf(kSweep + "locked = 5\n"),
            "test.toml:6: locked = 5 leaves none of the block's 5 conditions open; a block of held-back "
            "captures only is "
            "of kind = \"locked\"");
}

TEST(Plan, RepeatsSayWhatTheyRepeat) {
  const Schedule schedule =
      scheduleOfText(kSweep + "[[block]]\nname = 'end'\nkind = 'repeats'\ncaptures = 3\n");
  ASSERT_EQ(schedule.captures.size(), 13u);
  std::set<std::size_t> again;
  for (std::size_t i = 10; i < 13; ++i) {
    const auto& one = schedule.captures[i];
    ASSERT_TRUE(one.again);
    const auto& before = schedule.captures[*one.again];
    EXPECT_EQ(before.repeat, 0);
    EXPECT_EQ(one.pose->position_m, before.pose->position_m);
    again.insert(*one.again);
  }
  EXPECT_EQ(again.size(), 3u);
  const auto too_many =
      scheduleOf(planOf(kSweep + "[[block]]\nname = 'end'\nkind = 'repeats'\ncaptures = 6\n"));
  ASSERT_FALSE(too_many);
  EXPECT_THAT(too_many.error().message, HasSubstr("captures = 6, but there are only 5 earlier conditions"));
}

TEST(Plan, TellsHowLongItTakes) {
  // Ten captures of 8 s and 2 · 6 frames of 0.5 s; the block with a setup two minutes later, one capture a
  // minute.
  const Plan plan =
      planOf("pose_time_s = 8\nframes = 6\n" + kSweep +
             "[[block]]\nname = 'warm'\nkind = 'warm_up'\nsetup = 'wait'\ndistance_m = [1]\nrepeats = 3\n"
             "interval_s = 60\n");
  const auto schedule = scheduleOf(plan, {0.5_s, 0.5_s});
  ASSERT_TRUE(schedule);
  const double each = 8.0 + 6 * (0.5 + 0.5);
  EXPECT_NEAR(schedule->captures[10].start.in(second), 10 * each + 120.0, 1e-9);
  EXPECT_NEAR(schedule->captures[12].start.in(second), 10 * each + 120.0 + 2 * 60.0, 1e-9);
  EXPECT_NEAR(schedule->total.in(second), 10 * each + 120.0 + 2 * 60.0 + each, 1e-9);
  EXPECT_NEAR(schedule->setups.in(second), 120.0, 1e-9);
}

TEST(Plan, TellsAllThatIsWrongWithFileLineAndKey) {
  struct Case {
    const char* toml;
    const char* error;
  };
  for (const auto& [toml, error] : std::vector<Case>{
           {"", "test.toml:1: has no [[block]]"},
           {"frames = 1\n[[block]]\nname = 'b'\ndistance_m = [1, 2, 3]\n",
            "test.toml:1: frames = 1 is out of bounds"},
           {"[[block]]\ndistance_m = [1, 2, 3]\n", "test.toml:1: is a [[block]] without a name"},
           {"[[block]]\nname = 'b'\n", "test.toml:1: is a block without poses"},
           {"[[block]]\nname = 'a/b'\ndistance_m = [1, 2, 3]\n", "test.toml:2: name must not have"},
           {"[[block]]\nname = 'b'\nkind = 'sweep'\ndistance_m = [1, 2, 3]\n",
            "test.toml:3: kind is \"sweep\", but must be"},
           {"[[block]]\nname = 'b'\ndistance = [1, 2, 3]\ndistance_m = [1, 2, 3]\n",
            "test.toml:3: unknown key \"distance\""},
           {"[[block]]\nname = 'b'\ndistance_m = [1, 2]\n",
            "test.toml:3: distance_m must have at least three"},
           {"[[block]]\nname = 'b'\ndistance_m = [1, 2, 0]\n",
            "test.toml:3: distance_m[2] = 0 is out of bounds"},
           {"[[block]]\nname = 'b'\nangle_deg = [1]\n", "test.toml:3: angle_deg needs distance_m"},
           {"[[block]]\nname = 'b'\ndistance_m = [1, 2, 3]\n[[block.pose]]\n",
            "test.toml:3: distance_m stands beside"},
           {"[[block]]\nname = 'b'\nkind = 'locked'\n[[block.pose]]\nrotation_wxyz = [0, 0, 0, 0]\n",
            "1 at test.toml:5: rotation_wxyz is all zeros"},
           {"[[block]]\nname = 'b'\ntarget_m = [1, 2]\ndistance_m = [1, 2, 3]\n",
            "test.toml:3: target_m must be three"},
           {"[[block]]\nname = 'b'\ntarget_normal = [0, 0, 0]\ndistance_m = [1, 2, 3]\n",
            "test.toml:3: target_normal has length 0"},
           {"target_normal = [0, 0, 0]\n[[block]]\nname = 'b'\ndistance_m = [1, 2, 3]\n",
            "test.toml:1: target_normal has length 0"},
           {"[[block]]\nname = 'b'\nkind = 'warm_up'\ndistance_m = [1, 2]\nrepeats = 5\n",
            "test.toml:1: must have one pose, exposure and ambient"},
           {"[[block]]\nname = 'b'\nkind = 'warm_up'\ndistance_m = [1]\nrepeats = 2\n",
            "test.toml:5: repeats must be at least 3"},
           {"exposure_us = 9\n[[block]]\nname = 'b'\nkind = 'exposure'\ndistance_m = [1]\nexposure_us = [5, "
            "5]\n",
            "test.toml:6: exposure_us must have at least two different"},
           {"[[block]]\nname = 'b'\nkind = 'exposure'\ndistance_m = [1]\nexposure_us = [5, 6]\n",
            "test.toml:5: exposure_us changes the exposure, so the plan must say"},
           {"[[block]]\nname = 'b'\nkind = 'ambient'\ndistance_m = [1]\n",
            "ambient_klx must have at least two"},
           {"[[block]]\nname = 'b'\nkind = 'tilt'\ndistance_m = [1]\nangle_deg = [3, 3]\n",
            "test.toml:5: angle_deg must have at least two different"},
           {"[[block]]\nname = 'b'\nkind = 'bright_dark'\nrepeats = 2\n[[block.pose]]\n",
            "pose must have at least two poses"},
           {"[[block]]\nname = 'b'\nkind = 'corner'\ndistance_m = [1]\n", "corner_deg must say the angle"},
           {"[[block]]\nname = 'b'\nkind = 'moving'\ndistance_m = [1]\n", "speed_m_per_s must say how fast"},
           {"[[block]]\nname = 'b'\ndistance_m = [1, 2, 3]\nspeed_m_per_s = 1.0\n",
            "test.toml:4: speed_m_per_s has no meaning for kind = \"distance\""},
           {"[[block]]\nname = 'b'\ndistance_m = [1, 2, 3]\n[[block]]\nname = 'b'\nkind = 'dark'\n",
            "test.toml:5: name = \"b\": another block is called so"},
           {"[[block]]\nname = 'b'\nkind = 'repeats'\n", "captures must say how many"},
           {"[[block]]\nname = 'b'\nkind = 'repeats'\ncaptures = 1\nof = ['c']\n",
            "test.toml:5: of names \"c\", which is no"},
           {"[[block]]\nname = 'b'\nkind = 'repeats'\ncaptures = 1\ndistance_m = [1]\n",
            "test.toml:5: distance_m has no meaning for repeats"},
           {"block = 3\n", "test.toml:1: block must be tables"},
       }) {
    EXPECT_THAT(errorOf(toml), HasSubstr(error)) << toml;
  }
}

TEST(Plan, TellsOfABlockToSkipThatIsNotThere) {
  const auto plan = parsePlan(kSweep, "test.toml", {"sweeep"});
  ASSERT_FALSE(plan);
  EXPECT_THAT(plan.error().message, HasSubstr("no block \"sweeep\" to skip"));
  EXPECT_FALSE(parsePlan(kSweep, "test.toml", {"sweep"}));
}

std::string bytesOf(const std::string& path) {
  std::stringstream text;
  text << std::ifstream{std::string{TOFTWIN_SOURCE_DIR} + "/" + path}.rdbuf();
  return text.str();
}

TEST(PlanPage, HasTheCodesKeys) {
  EXPECT_THAT(bytesOf("docs/plan.md"),
              HasSubstr("<!-- plan: generated -->\n" + documentPlan() + "<!-- end -->\n"));
}

TEST(StandardPlan, PassesAndHasAHundredCapturesOfEveryKind) {
  const auto plan = loadPlan(TOFTWIN_SOURCE_DIR "/docs/examples/plans/standard.toml");
  ASSERT_TRUE(plan) << plan.error().message;
  const auto schedule = scheduleOf(*plan);
  ASSERT_TRUE(schedule) << schedule.error().message;
  const Check checked = check(*plan, *schedule);
  EXPECT_TRUE(checked.passes()) << refusals(checked);
  // A hall of 10 m is not everyone's: that is all that it notes.
  ASSERT_EQ(checked.remarks.size(), 1u);
  EXPECT_THAT(checked.remarks.front().what, HasSubstr("0.6 to 4 m are a whole period of 45 MHz or more"));
  EXPECT_GE(schedule->captures.size(), 100u);
}

}  // namespace
}  // namespace toftwin::plan
