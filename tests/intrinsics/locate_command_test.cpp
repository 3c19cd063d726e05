// SPDX-License-Identifier: Apache-2.0
// toftwin locate, as a user runs it, on rendered boards.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>

#include "calib/compare/poses.h"
#include "calib/file/calibration_file.h"
#include "program.h"
#include "sim/pictures/png.h"
#include "synthetic.h"
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

TEST_F(Locate, SaysWhatIsMissing) {
  shoot("a.png");
  std::ofstream{folder_ / "rig.toml"} << "[[pose]]\n[[pose]]\n";
  const auto other = locate(fmt::format("{}/a.png --rig {}/rig.toml", folder_.string(), folder_.string()));
  EXPECT_NE(other.status, 0);
  EXPECT_THAT(other.err, HasSubstr("has 2 poses of the rig, but there are 1 images"));
  record::writeBytes(folder_ / "grey.png", pictures::encodePng(cv::Mat(212, 256, CV_8U, cv::Scalar{90})));
  const auto none = locate((folder_ / "grey.png").string());
  EXPECT_NE(none.status, 0);
  EXPECT_THAT(none.err, ::testing::AllOf(HasSubstr("left out"), HasSubstr("found in none of the images")));
}

}  // namespace
}  // namespace toftwin::intrinsics
