// SPDX-License-Identifier: Apache-2.0
// A recording in the place of a simulated camera.
#include "protocol/record/recording.h"

#include <fstream>
#include <random>
#include <sstream>

#include "cases.h"
#include "sim/sensor/sensor_model.h"

namespace toftwin::suit {
namespace {

using testing::HasSubstr;

/// So many frames of what is true and 7 mm, with 2 mm of noise, 25 a second.
void record(const Folder& folder, int count, std::optional<Transform<World, Camera>> pose,
            const std::string& file = "real.mcap") {
  const auto model = sim::SensorModel::load(folder.camera("lens.toml"));
  const auto scene = sim::Scene::load(folder.path() / "scene.toml");
  ASSERT_TRUE(model && scene);
  const Seen seen = seenFrom(*scene, model->camera(), pose.value_or(Transform<World, Camera>{}), {});
  auto writer = record::Writer::create(folder.path() / file);
  ASSERT_TRUE(writer) << writer.error().message;
  std::mt19937 random{5};
  std::normal_distribution<float> noise{0.007f, 0.002f};
  for (int i = 0; i < count; ++i) {
    Frame frame;
    frame.source = "camera";
    frame.sequence = static_cast<std::uint64_t>(i);
    frame.camera = model->camera();
    frame.moment.world_from_camera = pose;
    frame.moment.received.ns = i * 40'000'000;
    frame.moment.exposures = {{.start = {i * 40'000'000}, .duration = 1_ms, .modulation = 20_MHz}};
    Image<float> range = seen.range_m;
    for (float& value : range.pixels()) value += noise(random);
    frame.planes.push_back(toPlane(PlaneKind::Range, std::move(range)));
    ASSERT_TRUE(writer->write(frame));
  }
  ASSERT_TRUE(writer->close());
}

const std::string kCase = kPose + R"(
[[require]]
name = 'bias'
kind = 'bias'
at_most_mm = 5
[[require]]
name = 'noise'
kind = 'noise'
at_most_mm = 3
[[require]]
name = 'rate'
kind = 'frame_rate'
at_least_hz = 25
[[camera]]
name = 'real'
recording = 'real.mcap'
)";

/// Median of 768 pixels' means over four frames: standard error 1.25 · 2 / √4 / √768 = 0.05 mm and less over
/// ten groups; noise: 0.6 % · √(4000/768) per group. Five standard errors.
TEST(Recording, IsJudgedByTheSameRequirements) {
  const Folder folder;
  record(folder, 40, Transform<World, Camera>{});
  const auto suit = folder.judged(kCase);
  ASSERT_TRUE(suit) << suit.error().message;
  const CameraResult& camera = suit->cameras.front();
  EXPECT_TRUE(camera.is_recording);
  EXPECT_NEAR(camera.requirements[0].verdict.estimate.value, 7.0, 0.1);
  EXPECT_FALSE(camera.requirements[0].verdict.is_met);
  EXPECT_TRUE(camera.requirements[0].verdict.is_certain);
  EXPECT_NEAR(camera.requirements[1].verdict.estimate.value, 2.0, 0.1);
  EXPECT_NEAR(camera.requirements[2].verdict.estimate.value, 25.0, 1e-6);
}

TEST(Recording, ThatDoesNotSayItsPoseIsTakenAtTheOneNamed) {
  const Folder folder;
  record(folder, 8, std::nullopt);
  const auto without = folder.judged(kCase);
  ASSERT_FALSE(without);
  EXPECT_THAT(
      without.error().message,
      HasSubstr(
          "none of its 8 frames was taken at a pose of the use case (0 elsewhere, 8 that do not say where"));
  const auto with = folder.judged(kCase + "pose = 'here'\n");
  ASSERT_TRUE(with) << with.error().message;
  EXPECT_NEAR(with->cameras.front().requirements[0].verdict.estimate.value, 7.0, 0.2);
}

TEST(Recording, OfOtherPosesSaysSo) {
  const Folder folder;
  record(folder, 8, Transform<World, Camera>{.rotation_wxyz = {1, 0, 0, 0}, .translation_m = {0, 0, 0.5}});
  const auto suit = folder.judged(kCase);
  ASSERT_FALSE(suit);
  EXPECT_THAT(suit.error().message, HasSubstr("8 elsewhere"));
}

/// Poses 40 mm apart, as of a fine sweep: a frame at the second is the second's, although the first is within 50 mm.
TEST(Recording, CountsAtTheNearestPoseThatIsWithinReach) {
  const Folder folder;
  record(folder, 8, Transform<World, Camera>{.rotation_wxyz = {1, 0, 0, 0}, .translation_m = {0, 0, 0.04}});
  const auto suit = folder.judged(kPose + "[[pose]]\nname = 'next'\nposition_m = [0, 0, 0.04]\n" + kCase.substr(kPose.size()));
  ASSERT_TRUE(suit) << suit.error().message;
  const CameraResult& camera = suit->cameras.front();
  ASSERT_EQ(camera.requirements[0].conditions.size(), 1u);
  EXPECT_EQ(camera.requirements[0].conditions[0].pose, 1u);
  EXPECT_THAT(camera.notes, testing::Contains(HasSubstr("8 frames stand within 50 mm and 2° of several poses")));
}

TEST(Recording, LeavesOpenWhatItMetAtSomePosesOnly) {
  const Folder folder;
  record(folder, 8, Transform<World, Camera>{});
  const auto suit = folder.judged("[[pose]]\nname = 'other'\nposition_m = [0, 0, -1]\n" + kCase);
  ASSERT_TRUE(suit) << suit.error().message;
  const CameraResult& camera = suit->cameras.front();
  EXPECT_FALSE(camera.requirements[0].verdict.is_met);  // a failure is one wherever it is
  EXPECT_FALSE(camera.requirements[1].is_judged);
  EXPECT_THAT(camera.requirements[1].why_not, HasSubstr("1 of 2 conditions"));
  EXPECT_FALSE(camera.isFit());
  EXPECT_THAT(camera.notes, testing::Each(testing::Not(HasSubstr("is it the scene"))));
  ASSERT_TRUE(writeSuit(*suit, folder.path() / "out", ""));
  std::stringstream text;
  text << std::ifstream{folder.path() / "out" / "report.md"}.rdbuf();
  EXPECT_THAT(text.str(), HasSubstr("| noise | not known | – | – | – | met where it was recorded, at 1 of 2 conditions |"));
}

/// Ranges of half a metre nearer to the wall, taken for those of this pose.
TEST(Recording, OfAnotherSceneSaysSo) {
  const Folder folder;
  record(folder, 8, std::nullopt);
  const auto far = folder.judged("[[pose]]\nname = 'other'\nposition_m = [0, 0, -0.5]\n" + kCase + "pose = 'other'\n");
  ASSERT_TRUE(far) << far.error().message;
  EXPECT_THAT(far->cameras.front().notes,
              testing::ElementsAre(testing::AllOf(
                  HasSubstr("At \"other\" 100 % of its valid pixels are over 300 mm from what"),
                  HasSubstr("is it the scene that was recorded, and the pose, or do its ranges wrap?"))));
}

/// Of its wall 1 m² was measured: the other pixels, three of four, have no truth, and nothing against the scene.
TEST(Recording, OfMoreThanTheSceneHasIsNotTakenForAnothers) {
  const Folder folder;
  record(folder, 8, Transform<World, Camera>{});
  folder.write("scene.toml",
               "[[material]]\nname = 'grey'\nalbedo = 0.5\n[[object]]\nname = 'wall'\nshape = 'rectangle'\n"
               "size_m = [1, 1, 0]\nposition_m = [-0.6, 0, 2]\nmaterial = 'grey'\n");
  const auto suit = folder.judged(kCase);
  ASSERT_TRUE(suit) << suit.error().message;
  EXPECT_THAT(suit->cameras.front().notes, testing::Each(testing::Not(HasSubstr("is it the scene"))));
}

TEST(Recording, ThatIsNotThereIsNamedWithItsPlace) {
  const Folder folder;
  const auto suit = folder.judged(kCase);
  ASSERT_FALSE(suit);
  EXPECT_THAT(suit.error().message, testing::AllOf(HasSubstr("case.toml:21"), HasSubstr("real.mcap")));
}

}  // namespace
}  // namespace toftwin::suit
