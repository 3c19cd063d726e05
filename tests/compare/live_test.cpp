// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/compare.h"
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
  }
  [[nodiscard]] const SourceDetails& details() const override { return details_; }
  Result<Frame> next(std::chrono::milliseconds) override {
    auto frame = source_->next({}, true);
    if (!frame) return frame;
    frame->source = details_.entry.name;
    frame->sequence = sequence_++;
    if (!says_its_pose_) frame->moment.world_from_camera.reset();
    return frame;
  }
  Result<> setPose(const Transform<World, Camera>& pose) override { return source_->setPose(pose); }
  void pretendItCannotMove() { details_.can_set_pose = false; }
  void keepItsPoseToItself() { says_its_pose_ = false; }

 private:
  std::unique_ptr<drivers::Source> source_;
  SourceDetails details_;
  std::uint64_t sequence_ = 0;
  bool says_its_pose_ = true;
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
  EXPECT_THAT(finding->section.verdict, HasSubstr("farther than A"));
}

TEST_F(Live, LeavesAPageItsNumbersAndALogWithIds) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 0.0)};
  CompareJob job{.a = &a,
                 .b = &b,
                 .capture = {.poses = twoPoses(), .frames = 2},
                 .data = std::nullopt,
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

TEST_F(Live, OnePoseHasNoErrorInTheHeadline) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 10.0)};
  const auto captured = capture(a, b, {.poses = {twoPoses()[1]}, .frames = 2}, silent);
  ASSERT_TRUE(captured.ok()) << captured.error().message;
  const auto finding = judgeLive(*captured);
  ASSERT_TRUE(finding.ok()) << finding.error().message;
  EXPECT_THAT(finding->headline, testing::Not(HasSubstr("±")));
  EXPECT_THAT(finding->section.verdict, HasSubstr("at 1 pose;"));
}

TEST_F(Live, ACameraThatNeverReachesThePoseIsNamed) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"fixed", sourceToml(2, 0.0)};
  b.pretendItCannotMove();
  const auto captured =
      capture(a, b, {.poses = {twoPoses()[1]}, .frames = 2, .most_skipped = 5}, silent);
  ASSERT_FALSE(captured.ok());
  EXPECT_THAT(captured.error().message, HasSubstr("fixed: none of 5 frames"));
}

TEST_F(Live, MissingMeasurementsAreSaidInTheReport) {
  SourceFeed a{"a", sourceToml(1, 0.0)}, b{"b", sourceToml(2, 0.0)};
  CompareJob job{.a = &a,
                 .b = &b,
                 .capture = {.poses = {}, .frames = 2},
                 .data = folder / "nowhere",
                 .output = folder / "report",
                 .note = {}};
  ASSERT_TRUE(compareAndReport(job, silent).ok());
  std::ifstream in{folder / "report" / "index.html"};
  EXPECT_THAT((std::string{std::istreambuf_iterator<char>{in}, {}}),
              HasSubstr("tof-thesis-2018 was not found"));
}

TEST_F(Live, NothingToCompareIsAnError) {
  CompareJob job{
      .capture = {}, .data = folder / "nowhere", .output = folder / "report", .note = {}};
  const auto page = compareAndReport(job, silent);
  ASSERT_FALSE(page.ok());
  EXPECT_THAT(page.error().message, HasSubstr("nothing to compare"));
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
