// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <variant>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/compare.h"
#include "calib/compare/follow.h"
#include "calib/compare/live_report.h"
#include "drivers/source.h"
#include "protocol/settings/describe.h"
#include "protocol/settings/settings.h"

namespace toftwin::compare {
namespace {

using testing::HasSubstr;

/// A driver's source as a feed, with the frame numbers that a daemon would give.
class SourceFeed final : public Feed {
 public:
  explicit SourceFeed(const std::string& name, const std::string& toml) {
    auto table = settings::Table::parse(
        toml, std::filesystem::path{TOFTWIN_SOURCE_DIR} / "tests/compare/test.toml");
    EXPECT_TRUE(table.ok());
    for (const auto& driver : drivers::allDrivers()) {
      if (driver.name != "sim") continue;
      auto opened = driver.open(*table);
      EXPECT_TRUE(opened.ok()) << opened.error().message;
      source_ = *std::move(opened);
    }
    const auto checked = table->check();
    EXPECT_TRUE(checked.ok()) << checked.error().message;
    EXPECT_TRUE(source_->start().ok());
    details_.entry.name = name;
    details_.entry.model = source_->info().model;
    details_.camera = source_->info().camera;
    details_.can_set_pose = source_->info().can_set_pose;
    details_.entry.kind = FrameKind::Simulated;
    details_.parameters = source_->state().parameters;
    details_.world_from_camera = source_->state().world_from_camera;
  }
  [[nodiscard]] const SourceDetails& details() const override { return details_; }
  Result<Frame> next(std::chrono::milliseconds) override {
    auto frame = source_->next({}, true);
    if (!frame) return frame;
    frame->source = details_.entry.name;
    frame->sequence = sequence_++;
    if (!says_its_pose_) frame->moment.world_from_camera.reset();
    if (!says_its_time_) frame->moment.since_power_on.reset();
    return frame;
  }
  Result<> setPose(const Transform<World, Camera>& pose) override { return source_->setPose(pose); }
  Result<> setParameter(std::string_view name, double value) override {
    set.emplace_back(name, value);
    return source_->setParameter(name, value);
  }
  void pretendItIsReal() {
    details_.entry.kind = FrameKind::Real;
    details_.parameters.clear();
  }
  std::vector<std::pair<std::string, double>> set{};  ///< in the order in which it was told

  void pretendItCannotMove() { details_.can_set_pose = false; }
  void keepItsPoseToItself() { says_its_pose_ = false; }
  void forgetsItsTime() { says_its_time_ = false; }

 private:
  std::unique_ptr<drivers::Source> source_;
  SourceDetails details_;
  std::uint64_t sequence_ = 0;
  bool says_its_pose_ = true, says_its_time_ = true;
};

/// A small camera: fast, and noisy enough for statistics. One wall, so no light comes twice.
class Live : public testing::Test {
 protected:
  void SetUp() override {
    folder = std::filesystem::path{testing::TempDir()} /
             (std::string{"live_"} + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    write("scene.toml",
          "[[material]]\nname = \"wall\"\nalbedo = 0.6\n[[object]]\nshape = \"rectangle\"\nsize_m "
          "= [9, 9, 0]\nposition_m = [0, 0, 2]\nmaterial = \"wall\"\n");
  }
  void write(const std::string& name, const std::string& text) {
    std::ofstream{folder / name} << text;
  }
  std::string sourceToml(int seed, double delay_mm) {
    const std::string camera = fmt::format("camera_{}.toml", seed);
    write(
        camera,
        fmt::format(
            "model = \"test\"\n[lens]\nwidth = 48\nheight = 36\nfx = 50.0\nfy = 50.0\ncx = "
            "23.5\ncy = 17.5\n[[emitter]]\nposition_mm = [0.0, 0.0, 0.0]\n"
            "[[modulation]]\nfrequency_mhz = 30.0\n[sampling]\nsteps = 4\n[decoder]\nalgorithm = "
            "\"n_phase\"\nminimum_amplitude_electrons = 1.0\nnearest_m = 0.1\nfarthest_m = 4.9\n"
            "[[effect]]\ntype = \"shot_noise\"\n[[effect]]\ntype = \"delay\"\noffset_mm = {:.3f}\n",
            delay_mm));
    return fmt::format(
        "camera = \"{}\"\nscene = \"{}\"\nsamples_per_pixel = 4\nmax_surfaces = 1\npixel_extent = "
        "0.0\nseed = {}\n",
        (folder / camera).string(), (folder / "scene.toml").string(), seed);
  }
  std::vector<PoseSpec> twoPoses() {
    return {{.name = "one"},
            {.name = "two", .position_m = {0.1, 0.0, -0.3}, .euler_deg = {0.0, 10.0, 0.0}}};
  }
  std::filesystem::path folder;
  Progress silent{nullptr};
};

constexpr int kFrames = 10;

TEST_F(Live, EqualCamerasShowNoBias) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 0.0)};
  const auto captured = capture(a, b, {.poses = twoPoses(), .frames = kFrames}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  ASSERT_EQ(captured->poses.size(), 2U);
  EXPECT_EQ(captured->pairs.size(), 2U * kFrames);
  EXPECT_EQ(captured->log.size(), 4U * kFrames);
  EXPECT_THAT(captured->warnings, testing::IsEmpty());
  std::vector<PoseComparison> poses;
  for (const auto& pose : captured->poses) poses.push_back(*comparePose(pose.a, pose.b));
  const Summary all = characterise(poses).regions.front().difference_mm;
  EXPECT_EQ(all.n, 2U * 48U * 36U);
  // 4 standard errors; the pixels' noise is independent. False alarm 1 in 16,000 for other seeds.
  EXPECT_NEAR(all.mean, 0.0, 4.0 * all.sd / std::sqrt(static_cast<double>(all.n)));
  EXPECT_LT(all.sd / std::sqrt(static_cast<double>(all.n)), 1.0);
}

TEST_F(Live, APlantedTenMillimetresAreFound) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 10.0)};
  const auto captured = capture(a, b, {.poses = twoPoses(), .frames = kFrames}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  std::vector<PoseComparison> poses;
  for (const auto& pose : captured->poses) poses.push_back(*comparePose(pose.a, pose.b));
  const Summary all = characterise(poses).regions.front().difference_mm;
  EXPECT_NEAR(all.mean, 10.0, 4.0 * all.sd / std::sqrt(static_cast<double>(all.n)));
  const auto finding = judgeLive(*captured);
  ASSERT_TRUE(finding.ok());
  EXPECT_THAT(finding->headline, HasSubstr(" mm farther, and its noise is "));
}

TEST_F(Live, LeavesAPageItsNumbersAndALogWithIds) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 0.0)};
  CompareJob job{.a = &a,
                 .b = &b,
                 .capture = {.poses = twoPoses(), .frames = 2},
                 .output = folder / "report",
                 .note = "commit 1234"};
  const auto page = compareAndReport(job, silent);
  ASSERT_TRUE(page.ok()) << page.error().message;
  const auto text = [&](const char* name) {
    std::ifstream in{folder / "report" / name};
    return std::string{std::istreambuf_iterator<char>{in}, {}};
  };
  EXPECT_THAT(text("index.html"), HasSubstr("commit 1234"));
  EXPECT_THAT(text("index.html"), testing::Not(HasSubstr("http")));
  EXPECT_THAT(text("report.json"), HasSubstr("\"flying_pixels_a\""));
  EXPECT_THAT(text("report.md"), HasSubstr("| region |"));
  const std::string log = text("log.jsonl");
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), 8);  // 2 poses, 2 frames, 2 cameras
  EXPECT_THAT(log, HasSubstr("\"effects\": [\"shot_noise\", \"delay\"]"));
  EXPECT_THAT(log, HasSubstr("\"model\": \""));
}

/// A cell is what a camera's frames say, for who looks for it elsewhere: what it is stands before the row.
TEST_F(Live, IdsOfTheTwoCamerasStandByThemselves) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 0.0)};
  const auto captured = capture(a, b, {.frames = 2}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  const auto finding = judgeLive(*captured);
  ASSERT_TRUE(finding.ok()) << finding.error().message;
  std::vector<std::vector<std::string>> ids;
  for (const Block& block : finding->section.blocks) {
    const auto* table = std::get_if<TableBlock>(&block);
    if (table == nullptr || table->caption != "The two cameras") continue;
    std::ranges::copy_if(table->rows, std::back_inserter(ids), [](const auto& row) { return row[0].ends_with(" id"); });
  }
  const auto &of_a = captured->poses[0].a.provenance(), &of_b = captured->poses[0].b.provenance();
  EXPECT_FALSE(of_a.model_id.empty() || of_a.scene_id.empty() || of_a.calibration_id.empty());
  EXPECT_THAT(ids, testing::ElementsAre(
                       testing::ElementsAre("camera model id", of_a.model_id, of_b.model_id),
                       testing::ElementsAre("scene id", of_a.scene_id, of_b.scene_id),
                       testing::ElementsAre("calibration id", of_a.calibration_id, of_b.calibration_id)));
}

TEST_F(Live, APoseVisitedAgainIsKnownAlsoWhereNoCameraSaysIt) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 10.0)};
  a.keepItsPoseToItself(), b.keepItsPoseToItself();
  std::vector<PoseSpec> poses = twoPoses();
  poses.push_back(poses.front());
  const auto captured = capture(a, b, {.poses = poses, .frames = 2}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  const auto finding = judgeLive(*captured);
  ASSERT_TRUE(finding.ok()) << finding.error().message;
  EXPECT_THAT(finding->section.verdict, HasSubstr("3 poses, 2 of them different"));
  EXPECT_THAT(finding->section.verdict, HasSubstr("last visit of \"one\" B − A changed by"));
  EXPECT_THAT(finding->data.text(), HasSubstr("\"places\": 2"));
}

TEST_F(Live, ACameraWithoutAmplitudeOrFlagsIsNamed) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"deaf", sourceToml(2, 0.0) + "planes = [\"range\"]\n"};
  const auto captured = capture(a, b, {.frames = 2}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  EXPECT_THAT(captured->warnings,
              testing::ElementsAre(HasSubstr("deaf gives no amplitude"), HasSubstr("deaf gives no flags")));
}

/// It would else be the best twin that there can be. Of B, which began three frames later, seven of ten are A's.
TEST_F(Live, OneCameraGivenTwiceIsNoComparison) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(1, 0.0)};
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(b.next({}));
  const auto captured = capture(a, b, {.frames = kFrames}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  EXPECT_THAT(captured->warnings, testing::ElementsAre(HasSubstr("a and b are simulated with one seed, 1")));
  const auto finding = judgeLive(*captured);
  ASSERT_TRUE(finding.ok()) << finding.error().message;
  EXPECT_THAT(finding->headline, testing::StartsWith("A and B are not two cameras: of the 10 frames of B, 7 are "
                                                     "frames of A, bit for bit."));
  EXPECT_EQ(finding->section.tone, Tone::Neutral);
  for (const Card& card : finding->cards) EXPECT_NE(card.tone, Tone::Good) << card.label;
  EXPECT_EQ(finding->notes, captured->warnings);
}

/// With another delay no frame is the other's, but the noise is.
TEST_F(Live, OneSeedIsSaid) {
  const std::string toml = sourceToml(1, 0.0);
  SourceFeed a{"a", toml};
  std::string other = sourceToml(2, 10.0);
  other.replace(other.find("seed = 2"), 8, "seed = 1");
  SourceFeed b{"b", other};
  const auto captured = capture(a, b, {.frames = 2}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  EXPECT_THAT(captured->warnings, testing::ElementsAre(HasSubstr("simulated with one seed, 1")));
  EXPECT_EQ(captured->same.same(), 0U);
  EXPECT_EQ(captured->same.ofB(), 2U);
}

TEST_F(Live, MomentsThatDifferAreSaid) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 0.0)};
  ASSERT_TRUE(b.setParameter(kAmbient, 3.0));
  ASSERT_TRUE(b.setParameter(kSincePowerOn, 9000.0));
  const auto captured = capture(a, b, {.frames = 2}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  EXPECT_THAT(captured->warnings, testing::ElementsAre(testing::AllOf(
                                      HasSubstr("ambient light of 0 and 3 klx"), HasSubstr("9000 s since power-on"),
                                      testing::Not(HasSubstr("exposure")), testing::Not(HasSubstr("room")))));
}

TEST_F(Live, CamerasThatLookOtherwiseAreSaidByHowMuch) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 0.0) + "euler_deg = [0, 3, 0]\n"};
  const auto captured = capture(a, b, {.frames = 2}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  const auto compared = comparePose(captured->poses[0].a, captured->poses[0].b);
  ASSERT_FALSE(compared);
  EXPECT_THAT(compared.error().message,
              HasSubstr("B is 0.000 mm away from A and turned by 3.000° against it"));
}

TEST_F(Live, OnePoseHasNoErrorInTheHeadline) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 10.0)};
  const auto captured = capture(a, b, {.poses = {twoPoses()[1]}, .frames = 2}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  const auto finding = judgeLive(*captured);
  ASSERT_TRUE(finding.ok()) << finding.error().message;
  EXPECT_THAT(finding->headline, testing::Not(HasSubstr("±")));
  EXPECT_THAT(finding->section.verdict, HasSubstr("at 1 pose."));
}

/// What a frame's line in the log says.
std::string logged(const Capture& captured, std::size_t line, const char* key) {
  const std::string text = captured.log.at(line).line();
  const auto at = text.find(fmt::format("\"{}\": ", key)) + std::string{key}.size() + 4;
  return text.substr(at, text.find_first_of(",}", at) - at);
}

TEST_F(Live, TheTwinRendersAtTheCamerasMoment) {
  SourceFeed a{"camera",
               sourceToml(1, 0.0) + "powered_on_before_s = 70\nroom_temperature_c = 31\nambient_klx = 4\n"};
  SourceFeed b{"twin", sourceToml(2, 0.0)};
  ASSERT_TRUE(a.setParameter("exposure_us", 77.0).ok());
  a.pretendItIsReal();
  ASSERT_EQ(twinOf(a, b), &b);
  ASSERT_EQ(twinOf(b, a), &b);
  const auto before = b.details().parameters;
  const auto captured = capture(a, b, {.poses = twoPoses(), .frames = 2, .twin = twinOf(a, b)}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  ASSERT_EQ(captured->log.size(), 8U);  // 2 poses, 2 frames; A and B in turns
  for (std::size_t line = 0; line < 8; line += 2) {
    for (const char* key : {"exposure_us", "ambient_klx", "room"})
      EXPECT_EQ(logged(*captured, line + 1, key), logged(*captured, line, key)) << key << " of line " << line;
    // Each camera makes its frames at its own rate, which is the same; the twin has none between being told
    // and its next.
    EXPECT_NEAR(std::stod(logged(*captured, line + 1, "since_power_on_s")),
                std::stod(logged(*captured, line, "since_power_on_s")), 0.1);
  }
  EXPECT_EQ(logged(*captured, 1, "exposure_us").substr(0, 2), "77");
  EXPECT_THAT(captured->warnings, testing::IsEmpty());
  // And then it is put back to what it was.
  EXPECT_THAT(b.set, testing::IsSupersetOf(
                         {std::pair<std::string, double>{"ambient_klx", 0.0}, {"room_temperature_c", 23.0}}));
  for (const Parameter& one : before) {
    if (one.name != "exposure_us") continue;
    EXPECT_THAT(b.set, testing::Contains(std::pair{one.name, *one.value}));
  }
}

TEST_F(Live, OfTwoSimulatedCamerasNeitherIsTheTwin) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 0.0)};
  EXPECT_EQ(twinOf(a, b), nullptr);
  ASSERT_TRUE(capture(a, b, {.frames = 2}, silent).ok());
  EXPECT_THAT(b.set, testing::IsEmpty());
}

TEST_F(Live, ACameraThatDoesNotSayHowLongItHasBeenOnIsNamedOnce) {
  SourceFeed a{"camera", sourceToml(1, 0.0)}, b{"twin", sourceToml(2, 0.0)};
  a.pretendItIsReal(), a.forgetsItsTime();
  const auto captured = capture(a, b, {.poses = twoPoses(), .frames = 2, .twin = &b}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  EXPECT_THAT(captured->warnings, testing::ElementsAre(HasSubstr("does not say how long it has been on")));
}

TEST_F(Live, ACameraThatNeverReachesThePoseIsNamed) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"fixed", sourceToml(2, 0.0)};
  b.pretendItCannotMove();
  const auto captured =
      capture(a, b, {.poses = {twoPoses()[1]}, .frames = 2, .most_skipped = 5}, silent);
  ASSERT_FALSE(captured.ok());
  EXPECT_THAT(captured.error().message, HasSubstr("fixed: none of 5 frames"));
}

TEST_F(Live, AnInterruptEndsTheCapture) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 0.0)};
  const auto captured = capture(a, b, {.frames = 2, .interrupted = [] { return true; }}, silent);
  ASSERT_FALSE(captured.ok());
  EXPECT_EQ(captured.error().code, Error::Code::Stopped);
}

TEST(Poses, OfTheDemoCanBeRead) {
  const auto poses =
      loadPoses(std::filesystem::path{TOFTWIN_SOURCE_DIR} / "docs/examples/demo/poses.toml");
  ASSERT_TRUE(poses.ok()) << poses.error().message;
  EXPECT_EQ(poses->size(), 4U);
  EXPECT_TRUE(samePose(poses->front().world_from_camera(), poses->back().world_from_camera()));
}

TEST(Documents, PagesTableOfAPoseFilesKeysIsTheCodes) {
  std::ifstream in{std::filesystem::path{TOFTWIN_SOURCE_DIR} / "docs/compare.md"};
  const std::string page{std::istreambuf_iterator<char>{in}, {}};
  const std::string table = settings::markdownTable(settings::keysOf<PoseFile>());
  EXPECT_NE(page.find("<!-- poses: generated -->\n" + table), std::string::npos) << table;
}

TEST_F(Live, PoseFilesAreChecked) {
  const auto message = [&](const std::string& text) {
    write("poses.toml", text);
    const auto poses = loadPoses(folder / "poses.toml");
    return poses.ok() ? std::string{"no error"} : poses.error().message;
  };
  EXPECT_THAT(message("# none\n"), HasSubstr("no [[pose]]"));
  EXPECT_THAT(message("[[pose]]\nposition = [0, 0, 0]\n"), HasSubstr("poses.toml:2"));
  EXPECT_THAT(message("[[pose]]\nrotation_wxyz = [0, 0, 0, 0]\n"), HasSubstr("all zeros"));
}

TEST(Poses, EulerAnglesTurnAboutTheFixedAxesInOrder) {
  // 90° about x takes y to z; then 90° about y takes z to x: y ends on x.
  const PoseSpec pose{.euler_deg = {90.0, 90.0, 0.0}};
  const Vec3d y = pose.world_from_camera().rotate({0, 1, 0});
  EXPECT_NEAR(y.x, 1.0, 1e-12);
  EXPECT_NEAR(y.y, 0.0, 1e-12);
  EXPECT_NEAR(y.z, 0.0, 1e-12);
}

}  // namespace
}  // namespace toftwin::compare
