// SPDX-License-Identifier: Apache-2.0
// From pixels to a lens: corners, whole images, and real ones.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include "calib/intrinsics/collector.h"
#include "calib/intrinsics/corner_fit.h"
#include "calib/intrinsics/markers.h"
#include "calib/intrinsics/verdict.h"
#include "synthetic.h"

namespace toftwin::intrinsics {
namespace {

using testing::checkerboard;
using testing::Exposure;
using testing::smallCamera;
using testing::Truth;
using ::testing::HasSubstr;

const Surface kFlat{checkerboard(), 0};
constexpr float kNever = std::numeric_limits<float>::infinity();

/// RMS distance of found corners from where they are.
double errorOf(const Sighting& seen, const Truth& truth, const BoardPose& pose) {
  double sum = 0.0;
  for (const Corner& corner : seen.corners) {
    const Eigen::Vector2d at = project(truth.lens, pose.rotation * kFlat.at(corner.index) + pose.translation_mm);
    sum += std::pow(corner.at.u - at.x(), 2) + std::pow(corner.at.v - at.y(), 2);
  }
  return std::sqrt(sum / static_cast<double>(seen.corners.size()));
}

/// With squares of ten pixels or more.
BoardPose nearPose(const Truth& truth, std::mt19937_64& random) {
  while (true) {
    const BoardPose pose = testing::drawPose(truth, kFlat, random);
    if (pose.translation_mm.z() < 420.0) return pose;
  }
}

BoardPose poseBefore(std::uint64_t seed, const Truth& truth, std::mt19937_64& random) {
  random.seed(seed);
  return nearPose(truth, random);
}

TEST(FindBoard, FindsCornersOfARenderedBoardToAFewHundredthsOfAPixel) {
  const Truth truth = smallCamera();
  std::mt19937_64 random;
  for (const std::uint64_t seed : {11, 12, 13}) {
    std::printf("seed %lu\n", static_cast<unsigned long>(seed));
    const BoardPose pose = poseBefore(seed, truth, random);
    const Sighting seen = findBoard(render(truth, checkerboard(), pose, {}, random), checkerboard());
    ASSERT_TRUE(seen.isUsed()) << nameOf(seen.rejection) << seen.detail;
    EXPECT_EQ(seen.corners.size(), 40U);
    // Noise of 2 counts on a contrast of 140, edges of some ten pixels each: 0.02 px a coordinate; the renderer's
    // rays add up to 1/8 px / √(pixels along the edges).
    EXPECT_LT(errorOf(seen, truth, pose), 0.06);
  }
}

TEST(FindBoard, FindsDimSaturatedAndBlurredBoards) {
  const Truth truth = smallCamera();
  const Exposure dim{.bright = 14.0, .dark = 5.0, .noise = 0.7};
  const Exposure bright{.bright = 600.0, .dark = 90.0};
  const Exposure soft{.blur_px = 2.0};
  std::mt19937_64 random;
  struct Case {
    const char* name;
    Exposure exposure;
    double most_px;
  };
  // Dim: contrast to noise is 12 instead of 70, so six times the error above. Soft: the edge is three times as
  // wide. Saturated: bright pixels say nothing, and the edge's middle is above the cut.
  for (const Case& one : {Case{"dim", dim, 0.25}, Case{"saturated", bright, 0.12}, Case{"soft", soft, 0.12}}) {
    const BoardPose pose = poseBefore(21, truth, random);
    const Sighting seen = findBoard(render(truth, checkerboard(), pose, one.exposure, random), checkerboard());
    ASSERT_TRUE(seen.isUsed()) << one.name << ": " << nameOf(seen.rejection) << seen.detail;
    EXPECT_LT(errorOf(seen, truth, pose), one.most_px) << one.name;
  }
}

TEST(FindBoard, TakesPixelsWithoutAValueForWhatTheyAre) {
  const Truth truth = smallCamera();
  std::mt19937_64 random;
  const BoardPose pose = poseBefore(31, truth, random);
  Image<float> image = render(truth, checkerboard(), pose, {}, random);
  for (int i = 0; i < 400; ++i) image[random() % image.size()] = i % 2 == 0 ? 0.0F : NAN;
  const Sighting seen = findBoard(image, checkerboard());
  ASSERT_TRUE(seen.isUsed()) << nameOf(seen.rejection) << seen.detail;
  EXPECT_GE(seen.corners.size(), 38U);
  EXPECT_LT(errorOf(seen, truth, pose), 0.08);
}

TEST(FindBoard, SaysThatThereIsNone) {
  std::mt19937_64 random{41};
  std::normal_distribution<float> normal{100.0F, 10.0F};
  Image<float> noise{160, 120};
  for (float& value : noise.pixels()) value = normal(random);
  EXPECT_EQ(findBoard(noise, checkerboard()).rejection, Rejection::NotFound);
  EXPECT_EQ(findBoard(Image<float>{160, 120, 0.0F}, checkerboard()).rejection, Rejection::NotFound);
}

TEST(FindBoard, DoesNotTakeABoardForOneOfAnotherSize) {
  const Truth truth = smallCamera();
  std::mt19937_64 random;
  const BoardPose pose = poseBefore(11, truth, random);
  const Image<float> image = render(truth, checkerboard(), pose, {}, random);
  const Sighting seen = findBoard(image, *targetOf("9x7", 32_mm));
  EXPECT_EQ(seen.rejection, Rejection::NotFound);
  EXPECT_THAT(seen.detail, HasSubstr("9 x 7"));
}

/// A part of the board with as many corners as were told is found in many images; where it ends, squares go
/// on. Of these eight, five say so and none is used: `calibrate` refuses where no more are used than say so.
TEST(FindBoard, SaysThatABoardHasMoreCornersThanItWasTold) {
  const Truth truth = smallCamera();
  std::mt19937_64 random;
  int views = 0, more = 0, used = 0;
  for (const char* told : {"7x5", "8x4", "7x4", "6x5"}) {
    for (const unsigned seed : {11U, 31U}) {
      const BoardPose pose = poseBefore(seed, truth, random);
      const Sighting seen =
          findBoard(render(truth, checkerboard(), pose, {}, random), *targetOf(told, 32_mm));
      ++views, more += seen.has_more, used += seen.isUsed();
      EXPECT_FALSE(seen.has_more && seen.isUsed());
    }
  }
  RecordProperty("of_views",
                 std::to_string(views) + ": more " + std::to_string(more) + ", used " + std::to_string(used));
  EXPECT_GT(more, used);
}

/// Of where an outer square ends at the image's own edge, half is seen: a corner of four squares fits that as well.
TEST(FindBoard, TakesABoardWhoseOuterSquaresTouchTheImagesEdge) {
  const Truth truth = smallCamera();
  const Target board = checkerboard();
  for (const double over_px : {-1.5, -1.0, -0.5, 0.0, 1.0}) {
    std::mt19937_64 random{61};
    BoardPose pose;
    pose.translation_mm = {-152.0, -64.0, 250.0};
    const Eigen::Vector3d right{256.0, 64.0, 0.0};
    while (project(truth.lens, right + pose.translation_mm).x() < truth.size.width - 0.5 + over_px)
      pose.translation_mm.x() += 0.1;
    const Sighting seen = findBoard(render(truth, board, pose, {.blur_px = 0.3}, random), board);
    EXPECT_TRUE(seen.isUsed()) << over_px << ": " << nameOf(seen.rejection) << ", " << seen.detail;
  }
}

TEST(FindBoard, RejectsABlurThatSwallowsTheSquares) {
  const Truth truth = smallCamera();
  std::mt19937_64 random;
  const BoardPose pose = poseBefore(11, truth, random);
  const Image<float> image = render(truth, checkerboard(), pose, {.blur_px = 1.5}, random);
  const Sighting seen = findBoard(image, checkerboard(), {.most_blur = 0.05});
  EXPECT_EQ(seen.rejection, Rejection::Blurred);
  EXPECT_THAT(seen.detail, HasSubstr("blurred by"));
}

TEST(CornerFit, IsNotMovedByUnevenLight) {
  // A corner at (10.3, 9.6), brightness rising to the right by 3 a pixel on a contrast of 50.
  Image<float> image{20, 20};
  for (int v = 0; v < 20; ++v) {
    for (int u = 0; u < 20; ++u) {
      const double s = std::erf((u - 10.3) / 0.9), t = std::erf((v - 9.6) / 0.9);
      image(u, v) = static_cast<float>(100.0 + 3.0 * (u - 10.3) + 50.0 * s * t);
    }
  }
  const auto corner = fitCorner(image, {.at = {10.0, 10.0}, .along = {14.0, 0.5}, .across = {-0.5, 14.0}}, kNever);
  ASSERT_TRUE(corner.has_value());
  EXPECT_NEAR(corner->at.u, 10.3, 1e-3);
  EXPECT_NEAR(corner->at.v, 9.6, 1e-3);
  EXPECT_NEAR(corner->blur_px, 0.9 / std::sqrt(2.0), 1e-3);
}

TEST(CornerFit, GivesNothingWhereThereIsNoCorner) {
  const Image<float> flat{20, 20, 50.0F};
  EXPECT_FALSE(fitCorner(flat, {.at = {10, 10}, .along = {0, 0}, .across = {0, 0}}, kNever)) << "no window";
  EXPECT_FALSE(fitCorner(flat, {.at = {-40, 10}, .along = {9, 0}, .across = {0, 9}}, kNever)) << "outside";
}

TEST(Calibration, OfRenderedImagesHoldsTheTruthWithinItsIntervals) {
  constexpr std::uint64_t kSeed = 51;
  std::printf("seed %lu\n", static_cast<unsigned long>(kSeed));
  const Truth truth = smallCamera();
  std::mt19937_64 random{kSeed};
  Collector collector{checkerboard()};
  for (int i = 0; i < 14; ++i) {
    const BoardPose pose = nearPose(truth, random);
    const auto image = render(truth, checkerboard(), pose, {.bright = 150.0 + 10.0 * i}, random);
    ASSERT_TRUE(collector.add(NamedImage{"image " + std::to_string(i), image}).ok());
  }
  auto sightings = collector.sightings();
  const auto result = estimate(checkerboard(), sightings, collector.size(), {.model = LensModel::K1K2, .degree = 0});
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_GE(result->used.size(), 13U);
  EXPECT_LT(result->rms_px_all, 0.06);
  for (std::size_t i = 0; i < 6; ++i) {
    // Twice the 95 % interval: missed once in 10^4 by each.
    EXPECT_NEAR(result->bundle.lens[i], truth.lens[i], 2.0 * result->uncertainty.half_width[static_cast<Eigen::Index>(i)])
        << kParameterNames[i];
  }
}

// ---- the same view again ----------------------------------------------------------------------------------

/// An image given twice, and another frame of a board that was held still, made the lens look known three times as
/// well as it was: their errors are alike.
TEST(Collector, CountsAnImageAndABoardHeldStillOnce) {
  const Truth truth = smallCamera();
  std::mt19937_64 random;
  const BoardPose pose = poseBefore(11, truth, random);
  const Image<float> first = render(truth, checkerboard(), pose, {}, random);
  const Image<float> held = render(truth, checkerboard(), pose, {}, random);
  const Image<float> other = render(truth, checkerboard(), poseBefore(31, truth, random), {}, random);
  Collector collector{checkerboard()};
  const auto add = [&](const char* name, const Image<float>& image) { return *collector.add({name, image}); };
  EXPECT_TRUE(add("first.png", first).isUsed());
  const Sighting same = add("copy.png", first), still = add("held.png", held);
  EXPECT_EQ(same.rejection, Rejection::SameImage);
  EXPECT_THAT(same.detail, HasSubstr("the same image as first.png"));
  EXPECT_EQ(still.rejection, Rejection::LikeAnother) << still.detail;
  EXPECT_THAT(still.detail, HasSubstr("held still"));
  EXPECT_THAT(still.detail, HasSubstr("in first.png"));
  EXPECT_TRUE(add("other.png", other).isUsed());
}

// ---- ChArUco ------------------------------------------------------------------------------------------------

TEST(Charuco, IsFoundInPartWithTheRightIndices) {
  const auto target = charucoOf(checkerboard(), 22_mm, "DICT_4X4_50");
  if (!target && target.error().code == Error::Code::Unsupported) GTEST_SKIP() << target.error().message;
  ASSERT_TRUE(target.ok()) << target.error().message;
  // Drawn square to the image, shrunk fourfold by averaging: corner (column, row) lies at 30 (column + 1) - 0.5.
  constexpr int kLarge = 120, kSmall = 30, kShrink = kLarge / kSmall, kMargin = 20;
  const cv::Mat drawn = drawMarkers(*target, kLarge);
  Image<float> image{9 * kSmall + 2 * kMargin, 6 * kSmall + 2 * kMargin, 200.0F};
  for (int v = 0; v < 6 * kSmall; ++v) {
    for (int u = 0; u < 9 * kSmall; ++u) {
      const cv::Mat part = drawn(cv::Rect{u * kShrink, v * kShrink, kShrink, kShrink});
      image(u + kMargin, v + kMargin) = static_cast<float>(40.0 + cv::mean(part)[0] / 255.0 * 160.0);
    }
  }
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < 110; ++u) image(u, v) = 200.0F;  // something covers its left third
  }
  const Sighting seen = findBoard(image, *target);
  ASSERT_TRUE(seen.isUsed()) << nameOf(seen.rejection) << seen.detail;
  EXPECT_GE(seen.corners.size(), 20U);
  EXPECT_LE(seen.corners.size(), 30U);
  for (const Corner& corner : seen.corners) {
    const auto column = static_cast<double>(corner.index % 8), row = static_cast<double>(corner.index / 8);
    EXPECT_NEAR(corner.at.u, kMargin + kSmall * (column + 1.0) - 0.5, 0.05) << corner.index;
    EXPECT_NEAR(corner.at.v, kMargin + kSmall * (row + 1.0) - 0.5, 0.05) << corner.index;
  }
  EXPECT_EQ(findBoard(Image<float>{200, 150, 80.0F}, *target).rejection, Rejection::NotFound);
}

/// At 1.3 m its markers of 70 mm leave two pixels around a corner; at 1 m those of 50 mm have cells of 1.5 pixels, and
/// from the few corners that they tell it looks tilted by 79 degrees, where it is by 11.
TEST(Charuco, OfTooFewPixelsIsSaidToBe) {
  struct Case {
    Length marker;
    double z_mm;
    const char* why;
  };
  for (const Case& one : {Case{70_mm, 1300.0, "its markers leave 1.92 px around each corner, 2.35 are needed"},
                          Case{50_mm, 1000.0, "cells of its markers of 1.5 px, 2 are needed"}}) {
    const auto target = charucoOf(*targetOf("6x4", 100_mm), one.marker, "DICT_4X4_50");
    if (!target && target.error().code == Error::Code::Unsupported) GTEST_SKIP() << target.error().message;
    ASSERT_TRUE(target.ok()) << target.error().message;
    constexpr int kSquare_px = 80;
    const cv::Mat drawn = drawMarkers(*target, kSquare_px);
    const auto print = [&](double x_mm, double y_mm) {
      const int u = static_cast<int>(std::floor((x_mm / 100.0 + 1.0) * kSquare_px)),
                v = static_cast<int>(std::floor((y_mm / 100.0 + 1.0) * kSquare_px));
      const bool is_there = u >= 0 && v >= 0 && u < drawn.cols && v < drawn.rows;
      return is_there ? drawn.at<unsigned char>(v, u) / 255.0 : -1.0;
    };
    BoardPose pose;
    pose.rotation = Eigen::AngleAxisd{0.2, Eigen::Vector3d::UnitY()}.toRotationMatrix();
    pose.translation_mm = Eigen::Vector3d{0.0, 0.0, one.z_mm} - pose.rotation * Eigen::Vector3d{250.0, 150.0, 0.0};
    std::mt19937_64 random{61};
    const Sighting seen = findBoard(testing::render(smallCamera(), print, pose, {.blur_px = 0.4}, random), *target);
    EXPECT_EQ(seen.rejection, Rejection::TooSmall) << nameOf(seen.rejection) << seen.detail;
    EXPECT_THAT(seen.detail, HasSubstr(one.why));
  }
}

TEST(Charuco, ThatCannotBeIsRefused) {
  const auto sound = charucoOf(checkerboard(), 22_mm, "DICT_4X4_50");
  if (!sound && sound.error().code == Error::Code::Unsupported) GTEST_SKIP() << sound.error().message;
  EXPECT_THAT(charucoOf(checkerboard(), 22_mm, "DICT_9X9").error().message, HasSubstr("DICT_4X4_50"));
  EXPECT_THAT(charucoOf(checkerboard(), 40_mm, "DICT_4X4_50").error().message, HasSubstr("do not fit"));
  EXPECT_THAT(charucoOf(*targetOf("20x20", 32_mm), 22_mm, "DICT_4X4_50").error().message, HasSubstr("larger dictionary"));
}

// ---- real boards --------------------------------------------------------------------------------------------

std::filesystem::path realBoards(const std::string& camera) {
  namespace fs = std::filesystem;
  const char* given = std::getenv("TOFTWIN_DATA");
  const fs::path data = given != nullptr ? fs::path{given} : fs::path{TOFTWIN_SOURCE_DIR} / ".." / "shared" / "data";
  for (const fs::path& root : {data / "tof-thesis-2018", data}) {
    if (fs::is_directory(root / "checkerboard" / camera)) return root / "checkerboard" / camera;
  }
  return {};
}

/// The bar of the project for these images: 0.2 px RMS, and not by leaving views out.
void expectGoodCalibration(const std::string& camera, double focal_px) {
  const auto folder = realBoards(camera);
  if (folder.empty()) GTEST_SKIP() << "no real boards: set TOFTWIN_DATA or put tof-thesis-2018 into ../shared/data";
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator{folder}) files.push_back(entry.path());
  std::ranges::sort(files);
  Collector collector{checkerboard()};
  for (const auto& file : files) {
    auto brightness = loadBrightness(file);
    ASSERT_TRUE(brightness.ok()) << brightness.error().message;
    ASSERT_TRUE(collector.add(NamedImage{file.filename().string(), *std::move(brightness)}).ok());
  }
  Calibrated calibrated{.target = checkerboard(), .size = collector.size(), .sightings = collector.sightings()};
  auto result = estimate(checkerboard(), calibrated.sightings, collector.size());
  ASSERT_TRUE(result.ok()) << result.error().message;
  calibrated.estimate = *std::move(result);
  std::printf("%s\n", describe(calibrated).c_str());
  EXPECT_LE(calibrated.estimate.rms_px_all, 0.2);
  EXPECT_LE(calibrated.estimate.scoreOf(calibrated.estimate.bundle.model)->held_out_rms_px, 0.2);
  EXPECT_GE(static_cast<double>(calibrated.estimate.used.size()), 0.9 * static_cast<double>(files.size()));
  // The thesis's own calibration by OpenCV has 361.0 and 354.6, with 0.33 px RMS: within 1.5 %.
  EXPECT_NEAR(calibrated.estimate.bundle.lens[0], focal_px, 0.015 * focal_px);
}

TEST(RealBoards, OfAKinectV2AreWithinAFifthOfAPixel) { expectGoodCalibration("kinect_v2", 361.0); }
TEST(RealBoards, OfAnO3d303AreWithinAFifthOfAPixel) { expectGoodCalibration("o3d303", 354.6); }

}  // namespace
}  // namespace toftwin::intrinsics
