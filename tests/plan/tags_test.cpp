// SPDX-License-Identifier: Apache-2.0
// toftwin measure where a grid of AprilTags in the simulator's amplitude says where the cameras stand.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <tuple>

#include "calib/intrinsics/markers.h"
#include "calib/plan/run_index.h"
#include "sim/pictures/png.h"
#include "tests/plan/tiny_camera.h"
#include "tests/record/record_testing.h"
#include "tests/tools/with_daemon.h"

namespace toftwin::cli {
namespace {

using testing::HasSubstr;

/// Two cameras of 256 × 212 pixels before a board of 4 × 3 tags of 80 mm, whose first corner is at (−0.19,
/// −0.14, 0.8).
class MeasureByTags : public WithDaemon {
 protected:
  void SetUp() override {
    const auto tags = tagsToPrint();
    if (!tags && tags.error().code == Error::Code::Unsupported) GTEST_SKIP() << tags.error().message;
    WithDaemon::SetUp();
  }
  static Result<intrinsics::Target> tagsToPrint() {
    return intrinsics::tagsOf("4x3", 100_mm, 80_mm, "DICT_APRILTAG_36h11");
  }
  std::string moreSources() const override {
    record::writeBytes(folder_ / "tags.png",
                       pictures::encodePng(intrinsics::drawMarkers(*tagsToPrint(), 200)));
    std::ofstream{folder_ / "scene.toml"}
        << "[[material]]\nname = 'print'\nalbedo = 0.8\ntexture = 'tags.png'\n"
           "[[object]]\nshape = 'rectangle'\nsize_m = [0.4, 0.3, 0]\nposition_m = [0, 0, 0.8]\nmaterial = "
           "'print'\n";
    std::string camera = fmt::format(kTinyCamera, "large", 0.0);
    camera.replace(camera.find("width"), camera.find("[[emitter]]") - camera.find("width"),
                   "width = 256\nheight = 212\nfx = 180.0\nfy = 180.0\ncx = 127.5\ncy = 105.5\n");
    std::ofstream{folder_ / "camera.toml"} << camera;
    std::string all;
    std::ofstream{folder_ / "bare.toml"} << "[[material]]\nname = 'wall'\nalbedo = 0.8\n[[object]]\nshape = "
                                            "'rectangle'\nsize_m = [0.4, 0.3, 0]\n"
                                            "position_m = [0, 0, 0.8]\nmaterial = 'wall'\n";
    const char* kRange = "planes = ['range']\n";
    for (const auto& [name, scene, planes] :
         {std::tuple{"cam", "scene", ""}, {"twin", "scene", ""}, {"bare", "bare", ""}, {"deaf", "scene", kRange},
          {"mute", "scene", kRange}, {"mute.b", "scene", ""}, {"half", "scene", ""}, {"half.b", "scene", kRange}})
      all += fmt::format(
          "[[source]]\nname = '{}'\ndriver = 'sim'\ncamera = 'camera.toml'\nscene = '{}.toml'\n"
          "max_surfaces = 1\n{}",
          name, scene, planes);
    return all;
  }
  Ran measure(double first_corner_x_m, const char* b = "twin", const char* from = "board") const {
    std::ofstream{folder_ / "plan.toml"} << fmt::format(
        "frames = 2\n[board]\ntags = '4x3'\nsquare_mm = 100\nmarker_mm = 80\nposition_m = [{}, -0.14, "
        "0.8]\nframes = 1\n"
        "[[block]]\nname = 'b'\nkind = 'locked'\npose_from = '{}'\n"
        "repeats = 2\n[[block.pose]]\nposition_m = [0.2, 0.0, 0.35]\neuler_deg = [0, -24, 0]\n",
        first_corner_x_m, from);
    return run(fmt::format("measure {} cam {} -o {}", path("plan.toml"), b, path("run")));
  }
};

TEST_F(MeasureByTags, TellsThePosesFromTheAmplitude) {
  const Ran ran = measure(-0.19);
  ASSERT_EQ(ran.status, 0) << ran.err;
  const auto records = plan::readIndex(folder_ / "run" / plan::kIndexFile);
  ASSERT_TRUE(records) << records.error().message;
  ASSERT_EQ(records->size(), 2u);
  for (const auto& [number, one] : *records) {
    EXPECT_EQ(one.pose_by, "board");
    ASSERT_TRUE(one.pose && one.pose_half_widths);
    const Vec3d at = one.pose->translation_m;
    const Vec3d stands{0.2, 0.0, 0.35};
    fmt::print("{}: off by {:.2f}, {:.2f}, {:.2f} mm\n", one.name, 1e3 * (at.x - stands.x),
               1e3 * (at.y - stands.y), 1e3 * (at.z - stands.z));
    EXPECT_LT(norm(at - stands), 3e-3) << one.name;
  }
}

TEST_F(MeasureByTags, RefusesABoardThatStandsElsewhereThanThePlanSays) {
  const Ran ran = measure(-0.13);
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("poses disagree"));
}

/// A sees the board; a twin is put where A stands and would never look.
TEST_F(MeasureByTags, CapturesNothingWithATwinWhoseSceneHasNoBoard) {
  const Ran ran = measure(-0.19, "bare");
  EXPECT_EQ(ran.status, 4);
  EXPECT_THAT(ran.err, HasSubstr("block \"b\" takes its poses from the board, and bare does not see it"));
  EXPECT_THAT(ran.err, HasSubstr("put it into the scene of bare"));
  EXPECT_THAT(ran.err, HasSubstr("0 of 2 captures are there"));
  const auto captures = folder_ / "run" / "captures";
  EXPECT_TRUE(!std::filesystem::exists(captures) || std::filesystem::is_empty(captures));
}

/// Before the first block is set up, not when an hour of the plan has passed.
TEST_F(MeasureByTags, SaysAtOnceThatACameraShowsNoBoardAndThatThereIsNoRig) {
  const Ran deaf = measure(-0.19, "deaf"), without_rig = measure(-0.19, "twin", "board_and_rig");
  EXPECT_EQ(deaf.status, 4);
  EXPECT_THAT(deaf.err, HasSubstr("takes its poses from the board, but deaf gives no amplitude"));
  EXPECT_EQ(without_rig.status, 4);
  EXPECT_THAT(without_rig.err, HasSubstr("but there is no rig: --rig names its file"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run"));
}

/// A source of the block's own counts, not the one that it stands for; and where all is there, none.
TEST_F(MeasureByTags, LooksForAmplitudeInTheSourceOfTheBlock) {
  const std::string without = "gives no amplitude";
  EXPECT_THAT(measure(-0.19, "half").err, HasSubstr("but half.b " + without));
  const Ran mute = measure(-0.19, "mute");
  EXPECT_EQ(mute.status, 0) << mute.err;
  EXPECT_THAT(measure(-0.19, "half").err,
              testing::AllOf(HasSubstr("Write somewhere else"), testing::Not(HasSubstr(without))));
}

}  // namespace
}  // namespace toftwin::cli
