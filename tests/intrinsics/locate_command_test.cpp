// SPDX-License-Identifier: Apache-2.0
// toftwin locate, as a user runs it, on rendered boards.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>

#include "calib/compare/poses.h"
#include "calib/file/calibration_file.h"
#include "calib/intrinsics/markers.h"
#include "program.h"
#include "sim/pictures/png.h"
#include "synthetic.h"
#include "tests/plan/tiny_camera.h"
#include "tests/record/record_testing.h"

namespace toftwin::intrinsics {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class Locate : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / fmt::format("toftwin_locate_{}", getpid());
    fs::create_directories(folder_);
    const auto truth = testing::smallCamera();
    calibration::CalibrationFile file;
    file.lens = {.width = truth.size.width,
                 .height = truth.size.height,
                 .fx = truth.lens[0],
                 .fy = truth.lens[1],
                 .cx = truth.lens[2],
                 .cy = truth.lens[3],
                 .distortion = {truth.lens[4], truth.lens[5], truth.lens[6], truth.lens[7], truth.lens[8]}};
    std::ofstream{folder_ / "lens.toml"} << calibration::toText(file);
  }
  void TearDown() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  /// A board tilted by 25 degrees, half a metre away.
  BoardPose shoot(const std::string& name) {
    std::mt19937_64 random{8};
    BoardPose pose;
    pose.rotation << std::cos(0.44), 0, std::sin(0.44), 0, 1, 0, -std::sin(0.44), 0, std::cos(0.44);
    pose.translation_mm = {-100.0, -60.0, 480.0};
    const auto image = testing::render(testing::smallCamera(), testing::checkerboard(), pose, {}, random);
    cv::Mat grey(image.height(), image.width(), CV_8U);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x)
        grey.at<unsigned char>(y, x) = static_cast<unsigned char>(image(x, y));
    }
    record::writeBytes(folder_ / name, pictures::encodePng(grey));
    return pose;
  }
  cli::Ran locate(const std::string& rest) {
    return cli::toftwin(
        fmt::format("locate {} --board 8x5 --square 32 --calibration {}/lens.toml -o {}/poses.toml", rest,
                    folder_.string(), folder_.string()));
  }
  fs::path folder_;
};

TEST_F(Locate, WritesAPoseFileThatOtherCommandsRead) {
  const BoardPose truth = shoot("a.png");
  const auto ran = locate((folder_ / "a.png").string());
  ASSERT_EQ(ran.status, 0) << ran.err;
  const auto poses = compare::loadPoses(folder_ / "poses.toml");
  ASSERT_TRUE(poses) << poses.error().message;
  ASSERT_EQ(poses->size(), 1u);
  // The camera in the board's frame: −Rᵀ t.
  const Eigen::Vector3d expected = -1e-3 * (truth.rotation.transpose() * truth.translation_mm);
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR((*poses)[0].position_m[k], expected[static_cast<Eigen::Index>(k)], 2e-3);
}

/// AprilTags on a board that the simulator traces, from its amplitude.
TEST_F(Locate, FindsTheCameraByTagsInWhatTheSimulatorRenders) {
  const auto tags = tagsOf("4x3", 100_mm, 80_mm, "DICT_APRILTAG_36h11");
  if (!tags && tags.error().code == Error::Code::Unsupported) GTEST_SKIP() << tags.error().message;
  record::writeBytes(folder_ / "tags.png", pictures::encodePng(drawMarkers(*tags, 200)));
  std::ofstream{folder_ / "scene.toml"}
      << "[[material]]\nname = 'print'\nalbedo = 0.8\ntexture = 'tags.png'\n[[material]]\nname = 'wall'\n"
         "[[object]]\nshape = 'rectangle'\nsize_m = [0.4, 0.3, 0]\nposition_m = [0, 0, 0.8]\nmaterial = "
         "'print'\n"
         "[[object]]\nshape = 'rectangle'\nsize_m = [6, 6, 0]\nposition_m = [0, 0, 1.6]\nmaterial = 'wall'\n";
  const auto lens = *calibration::load((folder_ / "lens.toml").string());
  std::string camera = fmt::format(cli::kTinyCamera, "one", 0.0);
  camera.replace(
      camera.find("width"), camera.find("[[emitter]]") - camera.find("width"),
      fmt::format("width = {}\nheight = {}\nfx = {}\nfy = {}\ncx = {}\ncy = {}\ndistortion = [{}]\n",
                  lens.lens.width, lens.lens.height, lens.lens.fx, lens.lens.fy, lens.lens.cx, lens.lens.cy,
                  fmt::join(lens.lens.distortion, ", ")));
  std::ofstream{folder_ / "camera.toml"} << camera;
  const std::string in = folder_.string() + "/";
  const auto shot = cli::toftwin(fmt::format(
      "render {0}camera.toml --scene {0}scene.toml -o {0}shots.mcap --frames 1 --surfaces 1 --samples 16 "
      "--position 0.15,0.05,0.4 --look-at 0,0,0.8",
      in));
  ASSERT_EQ(shot.status, 0) << shot.err;
  const auto ran = cli::toftwin(fmt::format(
      "locate {0}shots.mcap --tags 4x3 --square 100 --marker 80 --calibration {0}lens.toml -o {0}poses.toml",
      in));
  ASSERT_EQ(ran.status, 0) << ran.err;
  const auto poses = compare::loadPoses(folder_ / "poses.toml");
  ASSERT_TRUE(poses) << poses.error().message;
  ASSERT_EQ(poses->size(), 1u);
  // The first tag begins half a gap, 10 mm, from the print's edges.
  const std::array first_corner{-0.19, -0.14, 0.8}, stands{0.15, 0.05, 0.4};
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR((*poses)[0].position_m[k], stands[k] - first_corner[k], 2e-3) << k;
}

TEST_F(Locate, SaysWhatIsMissing) {
  shoot("a.png");
  std::ofstream{folder_ / "rig.toml"} << "[[pose]]\n[[pose]]\n";
  const auto other = locate(fmt::format("{}/a.png --rig {}/rig.toml", folder_.string(), folder_.string()));
  EXPECT_NE(other.status, 0);
  EXPECT_THAT(other.err, HasSubstr("has 2 poses of the rig, but the board was found in 1 image:"));
  record::writeBytes(folder_ / "grey.png", pictures::encodePng(cv::Mat(212, 256, CV_8U, cv::Scalar{90})));
  const auto none = locate((folder_ / "grey.png").string());
  EXPECT_NE(none.status, 0);
  EXPECT_THAT(none.err, ::testing::AllOf(HasSubstr("left out"), HasSubstr("found in none of the images")));
}

}  // namespace
}  // namespace toftwin::intrinsics
