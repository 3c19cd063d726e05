// SPDX-License-Identifier: Apache-2.0
// Poses that the cameras see themselves: a board, planes, a board and a rig; and what is refused.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include "calib/plan/run_index.h"
#include "calib/plan/take.h"
#include "plans.h"

namespace toftwin::plan {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kDeg = std::numbers::pi / 180.0;
using Pose = Transform<World, Camera>;

/// Brightness of a board of 8 × 5 inner corners, squares of 0.1 m, in the plane z = 2: the first inner corner
/// is at (−0.35, −0.2).
double boardAt(double x, double y) {
  const double column = (x + 0.35) / 0.1, row = (y + 0.2) / 0.1;
  if (column < -1.4 || row < -1.4 || column > 8.4 || row > 5.4) return 60.0;
  if (column < -1.0 || row < -1.0 || column > 8.0 || row > 5.0) return 180.0;
  return static_cast<long>(std::floor(column) + std::floor(row)) % 2 == 0 ? 180.0 : 40.0;
}

/// A camera in a room of three planes (z = 2, x = 1.2, y = 0.9), on the first of which is the board.
class SeeingCamera final : public compare::Feed {
 public:
  SeeingCamera(std::string name, Pose at, unsigned seed) : stands(at), random_(seed) {
    details_.entry.name = std::move(name);
  }
  [[nodiscard]] const SourceDetails& details() const override { return details_; }
  Result<Frame> next(std::chrono::milliseconds) override {
    Frame frame;
    frame.source = details_.entry.name;
    frame.camera = {.width = 200,
                    .height = 150,
                    .fx = 150,
                    .fy = 150,
                    .cx = 99.5,
                    .cy = 74.5,
                    .distortion = {},
                    .calibration_id = {}};
    if (details_.can_set_pose) frame.moment.world_from_camera = put;
    Image<float> amplitude(200, 150, 60.0F), range(200, 150);
    std::normal_distribution<double> noise{0.0, 1.0};
    for (int v = 0; v < 150; ++v) {
      for (int u = 0; u < 200; ++u) {
        const auto ray = stands * rayThroughPixel(frame.camera, u, v);
        range(u, v) = static_cast<float>(rangeAlong(ray) + 0.003 * noise(random_));
        if (sees_board)
          amplitude(u, v) = static_cast<float>(brightnessAt(frame.camera, u, v) + noise(random_));
      }
    }
    frame.planes = {toPlane(PlaneKind::Range, std::move(range)),
                    toPlane(PlaneKind::Amplitude, std::move(amplitude))};
    return frame;
  }
  Result<> setPose(const Pose& pose) override {
    put = pose;
    return {};
  }
  void moves() {
    details_.can_set_pose = true;
    details_.world_from_camera = Pose{};
  }

  Pose stands, put{};  ///< where it is, and where it was told to be
  bool sees_board = true;

 private:
  [[nodiscard]] double rangeAlong(Direction<World> ray) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& [normal, distance] :
         {std::pair{Vec3d{0, 0, 1}, 2.0}, {Vec3d{1, 0, 0}, 1.2}, {Vec3d{0, 1, 0}, 0.9}}) {
      const double along = dot(normal, ray.v), range = (distance - dot(normal, stands.translation_m)) / along;
      if (along > 1e-6 && range > 0.0) nearest = std::min(nearest, range);
    }
    return nearest;
  }
  /// Over two pixels each way, as a lens blurs it.
  [[nodiscard]] double brightnessAt(const CameraInfo& camera, int u, int v) const {
    double sum = 0.0;
    for (int k = 0; k < 36; ++k) {
      const auto ray = stands * rayThroughPixel(camera, u - 0.83 + (k % 6) / 3.0, v - 0.83 + (k / 6) / 3.0);
      const double range = (2.0 - stands.translation_m.z) / ray.v.z;
      sum += boardAt(stands.translation_m.x + range * ray.v.x, stands.translation_m.y + range * ray.v.y);
    }
    return sum / 36.0;
  }
  SourceDetails details_;
  std::mt19937_64 random_;
};

class Nobody final : public Person {
 public:
  Result<> doThis(const std::string&) override { return {}; }
};

/// A rig that says where it stands; the camera on it is elsewhere.
class FakeRig final : public compare::Carrier {
 public:
  Result<Pose> go(const compare::PoseSpec& pose) override { return pose.world_from_camera(); }
  Result<> stillThere() override { return {}; }
  [[nodiscard]] compare::Json log() const override { return {}; }
};

const std::string kBoardToml =
    "frames = 2\n[board]\ncorners = '8x5'\nsquare_mm = 100\nframes = 2\nposition_m = [-0.35, -0.2, 2.0]\n";
const std::string kPoses =
    "[[block.pose]]\nposition_m = [0.0, 0.0, 0.6]\n[[block.pose]]\nposition_m = [0.25, 0.0, 0.7]\n"
    "euler_deg = [0, -12, 0]\n[[block.pose]]\nposition_m = [0.0, 0.25, 0.6]\neuler_deg = [14, 0, 8]\n"
    "[[block.pose]]\nposition_m = [-0.2, -0.2, 0.5]\neuler_deg = [-14, 9, 0]\n"
    "[[block.pose]]\nposition_m = [0.1, 0.1, 0.4]\n";

Pose tilted(double x, double y, double z) {
  return {rotation<World, Camera>({0, 1, 0}, -20.0 * kDeg).rotation_wxyz, {x, y, z}};
}

class LookAround : public testing::Test {
 protected:
  void begin(const std::string& head, const std::string& from) {
    plan_ = planOf(head + "[[block]]\nname = 'b'\nkind = 'locked'\norder = 'as_written'\npose_from = '" +
                   from + "'\n" + kPoses);
    schedule_ = *scheduleOf(plan_);
    TakeOptions options;
    options.person = &nobody_;
    options.carrier = rig_;
    taker_.emplace(plan_, options);
  }
  Result<Taken> take(std::size_t number = 0) {
    a_frames_.clear(), b_frames_.clear();
    const auto to = [](std::vector<Frame>& frames) {
      return [&frames](const Frame& frame) { return frames.push_back(frame), Result<>{}; };
    };
    return taker_->take(schedule_.captures.at(number), a_, b_, to(a_frames_), to(b_frames_));
  }
  /// Within three times the half widths: six standard errors, so that seeds do not matter; and that in turn
  /// is small.
  void expectSeen(const Taken& taken, const Pose& truth, double most_m) {
    ASSERT_TRUE(taken.seen);
    const auto off = between(*taken.pose, truth);
    for (std::size_t k = 0; k < 6; ++k) {
      EXPECT_LE(std::abs(off[k]), 3.0 * taken.seen->half_widths[k]) << k;
      EXPECT_GT(taken.seen->half_widths[k], 0.0) << k;
    }
    EXPECT_LT(std::hypot(off[3], off[4], off[5]), most_m);
  }

  Nobody nobody_;
  compare::Carrier* rig_ = nullptr;
  SeeingCamera a_{"cam", tilted(0.31, 0.01, 0.62), 1}, b_{"twin", tilted(0.31, 0.01, 0.62), 2};
  std::vector<Frame> a_frames_, b_frames_;
  Plan plan_;
  Schedule schedule_;
  std::optional<Taker> taker_;
};

TEST_F(LookAround, PutsTheTwinWhereTheBoardSaysThatTheCameraStands) {
  b_.moves();
  begin(kBoardToml, "board");
  const auto taken = take();
  ASSERT_TRUE(taken) << taken.error().message;
  EXPECT_EQ(taken->pose_by, "board");
  expectSeen(*taken, a_.stands, 0.02);
  EXPECT_EQ(b_.put, *taken->pose);
  for (const Frame& frame : a_frames_) EXPECT_EQ(frame.moment.world_from_camera, taken->pose);
  const std::string line = lineOf(plan_, schedule_.captures[0], *taken, {}, {});
  EXPECT_THAT(line, AllOf(HasSubstr("pose_half_widths_rad_m"), HasSubstr("40 corners")));
}

TEST_F(LookAround, ATwinMustSeeTheBoardBeforeAnythingIsCaptured) {
  b_.moves();
  begin(kBoardToml, "board");
  const PlannedCapture& planned = schedule_.captures.at(2);
  b_.stands = planned.pose->world_from_camera();
  const auto sees = taker_->checkBoardOf(planned, b_);
  EXPECT_TRUE(sees) << sees.error().message;
  EXPECT_EQ(b_.put, b_.stands);
  b_.stands.translation_m.x += 0.05;  // as if its scene had the board 50 mm beside
  const auto beside = taker_->checkBoardOf(planned, b_);
  ASSERT_FALSE(beside);
  EXPECT_THAT(beside.error().message, AllOf(HasSubstr("block \"b\""), HasSubstr("poses disagree"),
                                            HasSubstr("by what twin sees"), HasSubstr("board.agree_mm")));
  b_.sees_board = false;
  const auto none = taker_->checkBoardOf(planned, b_);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message,
              AllOf(HasSubstr("block \"b\""), HasSubstr("twin does not see it"), HasSubstr("board not found"),
                    HasSubstr("x -0.35, y -0.2, z 2 m"), HasSubstr("put it into the scene of twin")));
  begin(kBoardToml, "command");
  EXPECT_TRUE(taker_->checkBoardOf(schedule_.captures.at(2), b_));
  SeeingCamera carried{"carried", b_.stands, 3};
  carried.sees_board = false;
  begin(kBoardToml, "board");
  EXPECT_TRUE(taker_->checkBoardOf(schedule_.captures.at(2), carried));  // it must see it at each capture
}

TEST_F(LookAround, TwoCamerasMustSeeTheSamePlace) {
  begin(kBoardToml, "board");
  const auto same = take();
  ASSERT_TRUE(same) << same.error().message;
  EXPECT_EQ(b_frames_[0].moment.world_from_camera, same->pose);
  // Where B saw itself is kept beside, for what B is off by by itself.
  ASSERT_TRUE(same->seen_by_b);
  EXPECT_NE(same->seen_by_b->world_from_camera, *same->pose);
  const auto off = between(same->seen_by_b->world_from_camera, b_.stands);
  for (std::size_t k = 0; k < 6; ++k) EXPECT_LE(std::abs(off[k]), 3.0 * same->seen_by_b->half_widths[k]) << k;
  const std::string line = lineOf(plan_, schedule_.captures[0], *same, {}, {});
  EXPECT_THAT(line, AllOf(HasSubstr("\"pose_of_b\""), HasSubstr("pose_of_b_half_widths_rad_m")));
  b_.stands = tilted(0.37, 0.01, 0.62);
  const auto apart = take();
  ASSERT_FALSE(apart);
  EXPECT_THAT(apart.error().message, AllOf(HasSubstr("poses disagree: cam and twin"), HasSubstr("mm and")));
  b_.sees_board = false;
  const auto one = take();
  ASSERT_FALSE(one);
  EXPECT_THAT(one.error().message,
              AllOf(HasSubstr("cam sees where it stands"), HasSubstr("the other does not"), HasSubstr("twin"),
                    HasSubstr("board not found")));
}

TEST_F(LookAround, ACameraThatStandsElsewhereThanItSaysIsRefused) {
  a_.moves(), b_.moves();
  begin(kBoardToml, "board");
  const auto elsewhere = take();
  ASSERT_FALSE(elsewhere);
  EXPECT_THAT(elsewhere.error().message, AllOf(HasSubstr("poses disagree"), HasSubstr("by the camera")));
}

TEST_F(LookAround, PlanesTellThePose) {
  b_.moves();
  a_.stands = {
      (rotation<World, World>({0, 1, 0}, 30.0 * kDeg) * rotation<World, Camera>({1, 0, 0}, -25.0 * kDeg))
          .rotation_wxyz,
      {0.01, -0.01, 0.62}};
  plan_ = {};
  const std::string planes =
      "frames = 2\n[[plane]]\npoint_m = [0, 0, 2]\n[[plane]]\npoint_m = [1.2, 0, 0]\nnormal = [-1, 0, 0]\n"
      "[[plane]]\npoint_m = [0, 0.9, 0]\nnormal = [0, -1, 0]\n";
  plan_ = planOf(planes + "[[block]]\nname = 'b'\nkind = 'locked'\npose_from = 'planes'\n[[block.pose]]\n" +
                 "position_m = [0, 0, 0.6]\nrotation_wxyz = [" +
                 fmt::format("{}, {}, {}, {}", a_.stands.rotation_wxyz[0], a_.stands.rotation_wxyz[1],
                             a_.stands.rotation_wxyz[2], a_.stands.rotation_wxyz[3]) +
                 "]\n");
  schedule_ = *scheduleOf(plan_);
  TakeOptions options;
  options.person = &nobody_;
  taker_.emplace(plan_, options);
  const auto taken = take();
  ASSERT_TRUE(taken) << taken.error().message;
  EXPECT_EQ(taken->pose_by, "planes");
  expectSeen(*taken, a_.stands, 0.003);
  plan_.planes.front().point_m = {0.0, 0.0, 2.6};
  taker_.emplace(plan_, options);
  const auto elsewhere = take();
  ASSERT_FALSE(elsewhere);
  EXPECT_THAT(elsewhere.error().message,
              testing::HasSubstr("plane 1: no pixel and its neighbours read a range within 100 mm of where the plan has "
                                 "it (plane.within_mm)"));
}

/// The camera sits 80 mm beside the rig's point and is turned by 5°; the rig's own world is 0.1 m off the
/// board's. In the last capture something covers the board.
TEST_F(LookAround, ARigWhoseCameraTheBoardToldNeedsNoBoardAnyMore) {
  FakeRig rig;
  rig_ = &rig;
  b_.moves();
  begin(kBoardToml, "board_and_rig");
  const Pose on_rig{rotation<World, Camera>({0, 1, 0}, 5.0 * kDeg).rotation_wxyz, {0.08, 0.0, 0.02}};
  for (std::size_t i = 0; i < schedule_.captures.size(); ++i) {
    const Pose stand = schedule_.captures[i].pose->world_from_camera();
    const Transform<World, World> by_rig{stand.rotation_wxyz, stand.translation_m};
    a_.stands = by_rig * on_rig;
    a_.stands.translation_m.x += 0.1;
    a_.sees_board = i + 1 < schedule_.captures.size();
    const auto taken = take(i);
    ASSERT_TRUE(taken) << i << ": " << taken.error().message;
    EXPECT_EQ(taken->pose_by, a_.sees_board ? "board" : "rig with the board's help");
    expectSeen(*taken, a_.stands, 0.02);
  }
  // An encoder that slipped: by one more view of the board the camera may be anywhere.
  a_.sees_board = true;
  a_.stands.translation_m.x += 0.15;
  ASSERT_TRUE(take(0));
  a_.sees_board = false;
  EXPECT_THAT(take(schedule_.captures.size() - 1).error().message,
              HasSubstr("A misfit far over 1 means that rig and board contradict each other"));
}

TEST_F(LookAround, SaysWhatIsMissing) {
  b_.moves();
  begin(kBoardToml, "board_and_rig");
  EXPECT_THAT(take().error().message, HasSubstr("--rig names it"));
  FakeRig rig;
  rig_ = &rig;
  begin(kBoardToml, "board_and_rig");
  a_.sees_board = false;
  EXPECT_THAT(take().error().message, AllOf(HasSubstr("where cam stands is not seen"),
                                            HasSubstr("board not found"), HasSubstr("after 0 captures")));
  const std::string block = "[[block]]\nname = 'b'\nkind = 'locked'\npose_from = 'board'\n" + kPoses;
  EXPECT_THAT(parsePlan(block, "p.toml").error().message, HasSubstr("needs a [board]"));
  EXPECT_THAT(parsePlan("[board]\ncorners = '8x5'\n" + block, "p.toml").error().message,
              HasSubstr("squares are 0 mm"));
  EXPECT_THAT(parsePlan("[board]\ncorners = '7x5'\nsquare_mm = 30\n" + block, "p.toml").error().message,
              HasSubstr("looks the same when it is turned by half"));
  EXPECT_THAT(parsePlan("[[block]]\nname = 'b'\nkind = 'locked'\npose_from = 'planes'\n" + kPoses, "p.toml")
                  .error()
                  .message,
              HasSubstr("needs three [[plane]]s"));
  const auto plane = [](const char* normal, double z) {
    return fmt::format("[[plane]]\nnormal = {}\npoint_m = [0, 0, {}]\n", normal, z);
  };
  const std::string parallel = plane("[0, 0, -1]", 2.0) + plane("[0, 0, -1]", 2.5) + plane("[0, 0, -1]", 3.0);
  EXPECT_THAT(parsePlan(parallel + "[[block]]\nname = 'b'\nkind = 'locked'\npose_from = 'planes'\n" + kPoses, "p.toml")
                  .error()
                  .message,
              AllOf(HasSubstr("that span space"), HasSubstr("nearly in one plane")));
}

}  // namespace
}  // namespace toftwin::plan
