// SPDX-License-Identifier: Apache-2.0
// Pose files of trajectories, and the frames that a camera gives on its way.
#include "tools/cli/campaign/trajectory.h"

#include <gmock/gmock.h>

#include <cstring>
#include <limits>
#include <numbers>

#include "drivers/source.h"
#include "tiny_camera.h"
#include "tools/cli/campaign/frame_maker.h"
#include "tools/cli/campaign/memory_file.h"

namespace toftwin::cli {
namespace {

using testing::HasSubstr;

class TrajectoryFile : public testing::Test {
 protected:
  Trajectory load(const std::string& name, const std::string& text) {
    writeText(folder_ / name, text);
    const auto trajectory = loadTrajectory(folder_ / name);
    EXPECT_TRUE(trajectory) << trajectory.error().message;
    return trajectory ? *trajectory : Trajectory{};
  }
  std::string errorOf(const std::string& name, const std::string& text) {
    writeText(folder_ / name, text);
    const auto trajectory = loadTrajectory(folder_ / name);
    return trajectory ? "" : trajectory.error().message;
  }
  record::Folder folder_;
};

TEST_F(TrajectoryFile, TomlAndCsvSayTheSame) {
  const Trajectory toml = load("a.toml",
                               "[[pose]]\ntime_s = 1\nposition_m = [1, 2, 3]\n"
                               "[[pose]]\nname = \"end\"\ntime_s = 2.5\nrotation_wxyz = [0, 0, 1, 0]\n");
  const Trajectory csv = load("a.csv",
                              "# made by hand\n\nq_w, q_x, q_y, q_z, time_s, x_m, y_m, z_m, remark\r\n"
                              "2, 0, 0, 0, 1, 1, 2, 3, here\r\n0,0,5,0, 2.5, 0,0,0, there\n");
  EXPECT_TRUE(toml.has_times);
  EXPECT_EQ(toml.poses, csv.poses);
  ASSERT_EQ(toml.poses.size(), 2u);
  EXPECT_EQ(toml.poses[1].time_s, 2.5);
  EXPECT_EQ(toml.poses[0].position_m, (Vec3d{1, 2, 3}));
}

/// As spreadsheets, the benchmark of TUM and other programs write them; times are those of the file.
TEST_F(TrajectoryFile, IsReadAsOthersWriteIt) {
  const Trajectory ours = load("a.csv", "time_s,x_m,y_m,z_m,q_w,q_x,q_y,q_z\n0.5,-0.1,0,0.2,1,0,0,0\n0.75,0,0,0,0,0,1,0\n");
  for (const auto& [name, text] :
       {std::pair{"german.csv", "time_s;x_m;y_m;z_m;q_w;q_x;q_y;q_z\n0,5;-0,1;0;0,2;1;0;0;0\n0,75;0;0;0;0;0;1;0\n"},
        {"mark.csv", "\xEF\xBB\xBFtime_s,x_m,y_m,z_m,q_w,q_x,q_y,q_z\r\n0.5,-0.1,0,0.2,1,0,0,0\r\n0.75,0,0,0,0,0,1,0\r\n"},
        {"stamps.csv", "timestamp,x,y,z,qw,qx,qy,qz\n0.5,-0.1,0,0.2,1,0,0,0\n0.75,0,0,0,0,0,1,0\n"},
        {"tum.txt", "# timestamp tx ty tz qx qy qz qw\n0.5 -0.1 0 0.2 0 0 0 1\n0.75 0 0 0 0 1 0 0\n"},
        {"plain.txt", "0.5 -0.1 0 0.2 0 0 0 1\n0.75 0 0 0 0 1 0 0\n"},
        {"mm.tsv", "t [ms]\tx [mm]\ty [mm]\tz [mm]\tq_w\tq_x\tq_y\tq_z\n500\t-100\t0\t200\t1\t0\t0\t0\n750\t0\t0\t0\t0\t0\t1\t0\n"}}) {
    const Trajectory other = load(name, text);
    EXPECT_TRUE(other.has_times) << name;
    ASSERT_EQ(other.poses.size(), 2u) << name;
    for (const std::size_t i : {0u, 1u}) {
      EXPECT_NEAR(other.poses[i].time_s, ours.poses[i].time_s, 1e-12) << name;
      EXPECT_EQ(other.poses[i].rotation_wxyz, ours.poses[i].rotation_wxyz) << name;
      EXPECT_NEAR(other.poses[i].position_m.x, ours.poses[i].position_m.x, 1e-12) << name;
    }
  }
}

TEST_F(TrajectoryFile, TimesMayBeSecondsSince1970) {
  const Trajectory unix = load("tum.txt", "# timestamp tx ty tz qx qy qz qw\n1305031102.1758 -0.1 0 0 0 0 0 1\n1305031102.2758 0 0 0 0 0 0 1\n");
  EXPECT_EQ(scheduleOf(unix, 0, 30_ms)->frames, 4u);
  EXPECT_NEAR(1e-9 * static_cast<double>(scheduleOf(unix, 0, 30_ms)->start.ns), 1305031102.1758, 1e-6);
  EXPECT_TRUE(load("a.toml", "[[pose]]\ntime_s = 1305031102.1758\n[[pose]]\ntime_s = 1305031103.0\n").has_times);
}

TEST_F(TrajectoryFile, APoseFileOfCompareIsOneWithoutTimes) {
  const Trajectory trajectory =
      load("a.toml", "[[pose]]\neuler_deg = [0, 90, 0]\n[[pose]]\nposition_m = [0, 0, 1]\n");
  EXPECT_FALSE(trajectory.has_times);
  EXPECT_EQ(scheduleOf(trajectory, 0, 50_ms)->frames, 2u);
  EXPECT_EQ(scheduleOf(trajectory, 1, 50_ms)->frames, 1u);
  EXPECT_THAT(scheduleOf(trajectory, 3, 50_ms).error().message, HasSubstr("2 poses without time_s"));
}

TEST_F(TrajectoryFile, FramesFillTheTimeFromTheFirstPoseToTheLast) {
  const Trajectory trajectory = load("a.toml", "[[pose]]\ntime_s = 1\n[[pose]]\ntime_s = 2\n");
  const auto schedule = scheduleOf(trajectory, 0, 30_ms);
  EXPECT_EQ(schedule->frames, 34u);  // 0, 30, …, 990 ms after the first
  EXPECT_EQ(schedule->startOf(0).ns, 1'000'000'000);
  EXPECT_EQ(schedule->startOf(33).ns, 1'990'000'000);
}

TEST_F(TrajectoryFile, MistakesHaveFileAndLine) {
  const std::string head = "time_s,x_m,y_m,z_m,q_w,q_x,q_y,q_z\n";
  const std::pair<std::string, std::string> csv[]{
      {"", "is empty"},
      {"x_m,y_m\n1,2\n", "a.csv: no column is called z_m, only: x_m, y_m"},
      {head, "has a header but no rows"},
      {head + "0,nan,0,0,1,0,0,0\n", "a.csv:2: \"nan\" in column \"x_m\" is not a finite number"},
      {head + "\n0,0,0,0,1,0,0,inf\n", "a.csv:3: \"inf\" in column \"q_z\" is not a finite number"},
      {head + "0,0,0,1e9,1,0,0,0\n", "a.csv:2: \"1e9\" in column \"z_m\" must be within ±1000000"},
      {head + "0,0,0,0,1,0,0\n", "a.csv:2: has 7 fields, but the header has 8"},
      {head + "0,0,zero,0,1,0,0,0\n", "a.csv:2: \"zero\" in column \"y_m\" is not a number"},
      {head + "0,0,0,0,0,0,0,0\n", "a.csv:2: q_w, q_x, q_y, q_z are all zero"},
      {head + "1,0,0,0,1,0,0,0\n0.5,0,0,0,1,0,0,0\n",
       "a.csv:3: time_s = 0.5 is not later than that of the pose before, 1"},
      {head + "-1,0,0,0,1,0,0,0\n", "a.csv:2: time_s = -1 must be 0 or more"}};
  for (const auto& [text, what] : csv) EXPECT_THAT(errorOf("a.csv", text), HasSubstr(what)) << text;
  const std::pair<std::string, std::string> toml[]{
      {"", "has no [[pose]]"},
      {"[[pose]]\nposition_m = [nan, 0, 0]\n", "a.toml:2: position_m"},
      {"[[pose]]\ntime_s = nan\n", "a.toml:2: time_s"},
      {"[[pose]]\nrotation_wxyz = [0, 0, 0, 0]\n", "a.toml:2: rotation_wxyz is all zeros"},
      {"[[pose]]\nrotation_wxyz = [1, 0, 0, 0]\neuler_deg = [1, 0, 0]\n",
       "a.toml:3: euler_deg and rotation_wxyz"},
      {"[[pose]]\ntime_s = 1\n[[pose]]\ntime_s = 1\n", "a.toml:4: time_s = 1 is not later"},
      {"[[pose]]\ntime_s = 1\n[[pose]]\nposition_m = [0, 0, 0]\n", "a.toml:3: this pose has no time_s"},
      {"[[pose]]\n[[pose]]\ntime_s = 1\n", "this pose has a time_s, but those before it have none"},
      {"[[pose]]\ntime = 1\n", "a.toml:2: unknown key \"time\""}};
  for (const auto& [text, what] : toml) EXPECT_THAT(errorOf("a.toml", text), HasSubstr(what)) << text;
  EXPECT_THAT(loadTrajectory("/no/such/file.csv").error().message,
              HasSubstr("/no/such/file.csv: cannot be read"));
}

/// The frames of this camera on its way, or standing still.
FrameMaker makerOf(const std::string& camera, const Trajectory& trajectory, std::uint64_t frames = 4) {
  const auto model = sim::SensorModel::parse(camera, "tiny.toml");
  EXPECT_TRUE(model) << model.error().message;
  const auto scene = sim::Scene::parse(kMovingScene, "scene.toml");
  EXPECT_TRUE(scene) << scene.error().message;
  RenderSettings settings{.since_power_on_s = 10'800, .room_temperature_c = 23};
  settings.keys.seed = 1;
  return {*model,
          *scene,
          trajectory,
          {},
          *scheduleOf(trajectory, frames, model->frameInterval()),
          settings,
          {PlaneKind::Range, PlaneKind::Flags, PlaneKind::TruthRange},
          "tiny"};
}

bool sameBytes(const Plane& a, const Plane& b) {
  return a.data.size() == b.data.size() &&
         std::memcmp(a.data.bytes().data(), b.data.bytes().data(), a.data.size()) == 0;
}

const FrameMaker::Watch kPatient = [](double) { return true; };

// Two implementations of the same motion: keyframes here, a velocity there.
TEST_F(TrajectoryFile, FramesAreThoseOfASimulatedSourceThatMovesSo) {
  const Trajectory trajectory = load("a.csv", kRightwards);
  FrameMaker maker = makerOf(std::string{kTinyCamera} + kRemembers, trajectory);
  writeText(folder_ / "tiny.toml", std::string{kTinyCamera} + kRemembers);
  writeText(folder_ / "scene.toml", kMovingScene);
  auto keys = settings::Table::parse(
      "driver = \"sim\"\ncamera = \"tiny.toml\"\nscene = \"scene.toml\"\npace = \"fast\"\n"
      "velocity_m_per_s = [0.5, 0, 0]\nplanes = [\"range\", \"flags\", \"truth_range\"]\n",
      folder_ / "toftwind.toml");
  ASSERT_TRUE(keys);
  keys->accept("driver");
  const auto driver = std::ranges::find(drivers::allDrivers(), "sim", &drivers::Driver::name);
  auto source = driver->open(*keys);
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_TRUE((*source)->start());
  for (std::uint64_t number = 0; number < 4; ++number) {
    const auto ours = maker.make(number, kPatient);
    const auto theirs = (*source)->next({}, true);
    ASSERT_TRUE(ours) << ours.error().message;
    ASSERT_TRUE(theirs) << theirs.error().message;
    EXPECT_EQ(ours->moment.exposures, theirs->moment.exposures);
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_TRUE(sameBytes(ours->planes[i], theirs->planes[i])) << number << " " << i;
  }
}

TEST_F(TrajectoryFile, AFramesPoseIsThatInTheMiddleOfItsExposures) {
  // Tiny's 8 raw exposures of 1 ms start every 1.5 ms: the fifth has its middle 6.5 ms after the first began.
  FrameMaker maker = makerOf(kTinyCamera, load("a.csv", kRightwards));
  const auto frame = maker.make(2, kPatient);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->moment.exposures.front().start.ns, 100'000'000);
  EXPECT_NEAR(frame->moment.world_from_camera->translation_m.x, 0.5 * 0.1065, 1e-15);
}

TEST_F(TrajectoryFile, BetweenPosesTheCameraTurnsSteadily) {
  FrameMaker maker = makerOf(kTinyCamera, load("a.toml",
                                               "[[pose]]\ntime_s = 0\n"
                                               "[[pose]]\ntime_s = 1\neuler_deg = [0, 90, 0]\n"));
  const auto frame = maker.make(3, kPatient);
  ASSERT_TRUE(frame);
  const double half = 0.1565 * 90.0 / 2.0 * std::numbers::pi / 180.0;
  EXPECT_NEAR(frame->moment.world_from_camera->rotation_wxyz[0], std::cos(half), 1e-12);
  EXPECT_NEAR(frame->moment.world_from_camera->rotation_wxyz[2], std::sin(half), 1e-12);
}

TEST_F(TrajectoryFile, AFrameDoesNotDependOnWhichWereMadeBefore) {
  const Trajectory trajectory = load("a.csv", kRightwards);
  FrameMaker in_order = makerOf(kTinyCamera, trajectory), alone = makerOf(kTinyCamera, trajectory);
  for (std::uint64_t number = 0; number < 3; ++number) ASSERT_TRUE(in_order.make(number, kPatient));
  EXPECT_TRUE(sameBytes(in_order.make(3, kPatient)->planes[0], alone.make(3, kPatient)->planes[0]));
  FrameMaker with_memory = makerOf(std::string{kTinyCamera} + kRemembers, trajectory),
             without = makerOf(std::string{kTinyCamera} + kRemembers, trajectory);
  for (std::uint64_t number = 0; number < 3; ++number) ASSERT_TRUE(with_memory.make(number, kPatient));
  const MemoryFiles files{folder_ / "memory"};
  ASSERT_TRUE(files.save(2, with_memory.memory()));
  EXPECT_FALSE(files.load(1)) << "another frame's";
  auto memory = files.load(2);
  ASSERT_TRUE(memory);
  without.remember({});
  const Frame with = *with_memory.make(3, kPatient);
  EXPECT_FALSE(sameBytes(with.planes[0], without.make(3, kPatient)->planes[0])) << "else this tests nothing";
  without.remember(*std::move(memory));
  EXPECT_TRUE(sameBytes(with.planes[0], without.make(3, kPatient)->planes[0]));
}

TEST_F(TrajectoryFile, ADamagedMemoryIsNone) {
  FrameMaker maker = makerOf(std::string{kTinyCamera} + kRemembers, load("a.csv", kRightwards));
  ASSERT_TRUE(maker.make(0, kPatient));
  const MemoryFiles files{folder_ / "memory"};
  ASSERT_TRUE(files.save(0, maker.memory()));
  auto bytes = record::bytesOf(folder_ / "memory-0");
  bytes[bytes.size() / 2] ^= std::byte{1};
  record::writeBytes(folder_ / "memory-0", bytes);
  EXPECT_FALSE(files.load(0));
  record::writeBytes(folder_ / "memory-0", std::span{bytes}.first(20));
  EXPECT_FALSE(files.load(0));
}

TEST_F(TrajectoryFile, WhoeverWatchesCanEndIt) {
  FrameMaker maker = makerOf(kTinyCamera, load("a.csv", kRightwards));
  int asked = 0;
  const auto frame = maker.make(0, [&](double share) {
    EXPECT_LE(share, 1.0);
    return ++asked < 3;
  });
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, Error::Code::Stopped);
  EXPECT_EQ(asked, 3);
}

/// A frame free of any chance: no noise, central rays, direct light by a point.
Frame plainFrame(const std::string& scene_text, bool freeze) {
  std::string camera = kTinyCamera;
  camera.resize(camera.find("[[effect]]"));
  const auto model = sim::SensorModel::parse(camera, "tiny.toml");
  const auto scene = sim::Scene::parse(scene_text, "scene.toml");
  EXPECT_TRUE(model) << model.error().message;
  EXPECT_TRUE(scene) << scene.error().message;
  RenderSettings settings{.freeze = freeze};
  settings.keys.pixel_extent = 0.0;
  settings.keys.max_surfaces = 1;
  FrameMaker maker{
      *model, *scene, {}, {}, *scheduleOf({}, 1, model->frameInterval()), settings, {PlaneKind::Range},
      "tiny"};
  return *maker.make(0, kPatient);
}

TEST_F(TrajectoryFile, AFrozenFrameIsThatOfAWorldThatStandsStill) {
  // Where the box is in the middle of the frame: -0.3 m + 20 m/s · 6.5 ms.
  std::string moving = kMovingScene, still = kMovingScene;
  moving.replace(moving.find("[0.5, 0, 0]"), 11, "[20.0, 0, 0]");
  still.replace(still.find("[-0.3, 0, 1.2]"), 14, "[-0.17, 0, 1.2]");
  still.erase(still.find("velocity_m_per_s"), std::string{"velocity_m_per_s = [0.5, 0, 0]\n"}.size());
  const auto largestDifference = [](const Frame& a, const Frame& b) {
    double largest = 0.0;
    for (std::size_t i = 0; i < a.planes[0].as<float>().size(); ++i) {
      const float x = a.planes[0].as<float>()[i], y = b.planes[0].as<float>()[i];
      largest =
          std::isnan(x) && std::isnan(y) ? largest : std::max(largest, static_cast<double>(std::abs(x - y)));
    }
    return largest;
  };
  const Frame expected = plainFrame(still, false);
  EXPECT_LT(largestDifference(plainFrame(moving, true), expected), 1e-5);  // single precision of the light
  EXPECT_GT(largestDifference(plainFrame(moving, false), expected), 0.01) << "else this tests nothing";
}

}  // namespace
}  // namespace toftwin::cli
