// SPDX-License-Identifier: Apache-2.0
// Use cases that say something wrong.
#include "calib/suit/use_case.h"

#include <fstream>
#include <sstream>

#include "cases.h"

namespace toftwin::suit {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string errorOf(const Folder& folder, const std::string& rest) {
  const auto use = folder.use(rest);
  return use ? "no error" : use.error().message;
}

std::string require(const std::string& keys) { return kPose + "[[require]]\nname = 'it'\n" + keys; }

TEST(UseCase, NamesTheUnitThatALimitLacks) {
  const Folder folder;
  EXPECT_THAT(
      errorOf(folder, require("kind = 'accuracy'\nwithin = 10\nat_least_percent = 95\n")),
      AllOf(HasSubstr("case.toml:11"), HasSubstr("within"), HasSubstr("has no unit: write within_mm")));
  EXPECT_THAT(errorOf(folder, require("kind = 'bias'\nat_most = 10\n")),
              HasSubstr("write at_most_mm or at_most_percent"));
}

TEST(UseCase, NamesTheObjectThatTheSceneLacksAndThoseThatItHas) {
  const Folder folder;
  EXPECT_THAT(errorOf(folder, require("kind = 'valid'\nat_least_percent = 9\nobject = 'pallet'\n")),
              AllOf(HasSubstr("case.toml:12"), HasSubstr("names \"pallet\", which is no object of the scene"),
                    HasSubstr("box, wall")));
}

TEST(UseCase, NamesTheRegionPoseAndLightingThatAreNone) {
  const Folder folder;
  const std::string valid = "kind = 'valid'\nat_least_percent = 9\n";
  EXPECT_THAT(errorOf(folder, require(valid + "region = 'pocket'\n")),
              HasSubstr("names \"pocket\", which is no [[region]]; there are none"));
  EXPECT_THAT(errorOf(folder, require(valid + "poses = ['far']\n")),
              HasSubstr("names \"far\", which is no [[pose]]; there are: here"));
  EXPECT_THAT(errorOf(folder, require(valid + "lightings = ['noon']\n")),
              HasSubstr("names \"noon\", which is no [[lighting]]"));
}

TEST(UseCase, SaysWhatARequirementLacksAndWhatMeansNothing) {
  const Folder folder;
  EXPECT_THAT(errorOf(folder, require("kind = 'accuracy'\nwithin_mm = 1\n")),
              HasSubstr("must say at_least_percent"));
  EXPECT_THAT(errorOf(folder, require("kind = 'bias'\nat_most_mm = 1\nwithin_mm = 1\n")),
              HasSubstr("has no meaning for kind = \"bias\""));
  EXPECT_THAT(errorOf(folder, require("kind = 'missed'\nwithin_mm = 1\nat_most_percent = 0\n")),
              HasSubstr("must say of which object or region"));
  EXPECT_THAT(errorOf(folder, require("kind = 'valid'\nat_least_percent = 9\ncolour = 1\n")),
              HasSubstr("colour"));
}

TEST(UseCase, SaysAllThatIsWrongWithCamerasAndPlacesAtOnce) {
  const Folder folder;
  const std::string error = errorOf(folder, R"([[pose]]
name = 'a'
[[pose]]
name = 'a'
rotation_wxyz = [0, 0, 0, 0]
[[region]]
name = 'r'
lower_m = [0, 0, 1]
upper_m = [1, 1, 0]
[[require]]
name = 'it'
kind = 'frame_rate'
at_least_hz = 30
object = 'box'
[[camera]]
models = ['kinect_v3', 'none.toml']
[[camera]]
name = 'nothing'
)");
  EXPECT_THAT(error, AllOf(HasSubstr("another [[pose]] is called so"), HasSubstr("which is no rotation"),
                           HasSubstr("on z it is not"), HasSubstr("has no meaning for a frame rate"),
                           HasSubstr("there is no camera preset \"kinect_v3\""),
                           HasSubstr("none.toml, which is not there"),
                           HasSubstr("must have either models or a recording")));
}

TEST(UseCase, NeedsASceneAPoseAndARequirement) {
  const auto use = parseCase("title = 'x'\n", "case.toml");
  ASSERT_FALSE(use);
  EXPECT_THAT(use.error().message, AllOf(HasSubstr("must name a scene file"), HasSubstr("no [[pose]]"),
                                         HasSubstr("no [[require]]")));
}

TEST(UseCase, PassesOnWhatIsWrongWithTheScene) {
  const Folder folder;
  folder.write("scene.toml", "[[object]]\nshape = 'torus'\n");
  EXPECT_THAT(errorOf(folder, require("kind = 'valid'\nat_least_percent = 9\n")),
              AllOf(HasSubstr("scene.toml:2"), HasSubstr("torus")));
}

TEST(PresetCameras, TakeThoseThatAreCalledAfterAnotherAsItsModes) {
  for (const CameraSpec& camera : presetCameras()) {
    EXPECT_FALSE(camera.name.starts_with("o3d303_")) << camera.name;
    if (camera.name == "o3d303") {
      EXPECT_THAT(camera.models, testing::UnorderedElementsAre("o3d303", "o3d303_binned", "o3d303_far"));
    } else {
      EXPECT_EQ(camera.models.size(), 1u) << camera.name;
    }
  }
}

TEST(SuitPage, HasTheCodesKeys) {
  std::stringstream page;
  page << std::ifstream{TOFTWIN_SOURCE_DIR "/docs/suit.md"}.rdbuf();
  EXPECT_THAT(page.str(), HasSubstr("<!-- case: generated -->\n" + documentCase() + "<!-- end -->\n"));
}

}  // namespace
}  // namespace toftwin::suit
