// SPDX-License-Identifier: Apache-2.0
// Grids of AprilTags: which are seen, how they were put up, poses and a lens from them.
#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <cstdio>

#include "calib/intrinsics/board_pose.h"
#include "calib/intrinsics/corner_fit.h"
#include "calib/intrinsics/estimate.h"
#include "calib/intrinsics/markers.h"
#include "synthetic.h"

namespace toftwin::intrinsics {
namespace {

using ::testing::HasSubstr;
using testing::Truth;

/// 4 × 3 tags of 60 mm, one every 75 mm.
Result<Target> smallBoard() { return tagsOf("4x3", 75_mm, 60_mm, "DICT_APRILTAG_36h11"); }

class Tags : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto board = smallBoard();
    if (!board && board.error().code == Error::Code::Unsupported) GTEST_SKIP() << board.error().message;
    ASSERT_TRUE(board) << board.error().message;
    board_ = *board;
  }
  /// Square to the image, 50 pixels from tag to tag, each tag turned by so many quarters where it is.
  [[nodiscard]] Image<float> squareOn(int quarters) const {
    const cv::Mat drawn = printed(quarters);
    Image<float> image{drawn.cols / kShrink + 2 * kMargin, drawn.rows / kShrink + 2 * kMargin, 200.0F};
    for (int v = 0; v < drawn.rows / kShrink; ++v) {
      for (int u = 0; u < drawn.cols / kShrink; ++u) {
        const cv::Mat part = drawn(cv::Rect{u * kShrink, v * kShrink, kShrink, kShrink});
        image(u + kMargin, v + kMargin) = static_cast<float>(40.0 + cv::mean(part)[0] / 255.0 * 160.0);
      }
    }
    return image;
  }
  [[nodiscard]] cv::Mat printed(int quarters) const {
    cv::Mat drawn = drawMarkers(board_, kPitch_px);
    for (int id = 0; quarters > 0 && id < 12; ++id) {
      cv::Mat tag = drawn(cv::Rect{id % 4 * kPitch_px, id / 4 * kPitch_px, kPitch_px, kPitch_px});
      cv::Mat turned;
      cv::rotate(tag, turned, quarters - 1);  // cv::ROTATE_90_CLOCKWISE is 0
      turned.copyTo(tag);
    }
    return drawn;
  }
  /// As a camera sees it from there.
  Image<float> seenFrom(const Truth& truth, const BoardPose& pose, std::mt19937_64& random) const {
    const cv::Mat drawn = printed(0);
    const double px_per_mm = kPitch_px / 75.0, rim_mm = 7.5;  // half a gap
    const auto print = [&](double x, double y) {
      const int column = static_cast<int>(std::floor((x + rim_mm) * px_per_mm)),
                row = static_cast<int>(std::floor((y + rim_mm) * px_per_mm));
      const bool is_there = column >= 0 && row >= 0 && column < drawn.cols && row < drawn.rows;
      return is_there ? drawn.at<unsigned char>(row, column) / 255.0 : -1.0;
    };
    return testing::render(truth, print, pose, {}, random);
  }
  static constexpr int kShrink = 4, kPitch_px = 200, kMargin = 20;
  Target board_;
};

TEST_F(Tags, CornersAreWhereTheyWerePrintedHoweverTheTagsWerePutUp) {
  for (int quarters = 0; quarters < 4; ++quarters) {
    Image<float> image = squareOn(quarters);
    for (int v = 0; v < image.height(); ++v) {
      for (int u = 0; u < 60; ++u) image(u, v) = 200.0F;  // something covers the first column of tags
    }
    const Sighting seen = findBoard(image, board_);
    ASSERT_TRUE(seen.isUsed()) << nameOf(seen.rejection) << seen.detail;
    ASSERT_EQ(seen.corners.size(), 36U) << quarters;
    for (const Corner& corner : seen.corners) {
      // Of 75 mm that are 50 px, the first tag begins half a gap, 5 px, from the picture's edge; pixels are
      // counted from their centres.
      const double u = kMargin + 5.0 + board_.x(corner.index).in(millimetre) / 1.5 - 0.5;
      const double v = kMargin + 5.0 + board_.y(corner.index).in(millimetre) / 1.5 - 0.5;
      EXPECT_NEAR(corner.at.u, u, 0.05) << corner.index << " turned by " << quarters;
      EXPECT_NEAR(corner.at.v, v, 0.05) << corner.index << " turned by " << quarters;
    }
  }
}

TEST_F(Tags, ThatLieOtherwiseThanTheBoardAreNotTakenForIt) {
  // Its first row has the same tags in the same places, but then numbers go on elsewhere.
  const auto other = tagsOf("5x3", 75_mm, 60_mm, "DICT_APRILTAG_36h11");
  ASSERT_TRUE(other);
  const Sighting seen = findBoard(squareOn(0), *other);
  EXPECT_FALSE(seen.isUsed()) << seen.corners.size();
  const Sighting none = findBoard(Image<float>{200, 150, 80.0F}, board_);
  EXPECT_EQ(none.rejection, Rejection::NotFound);
  EXPECT_THAT(none.detail, HasSubstr("DICT_APRILTAG_36h11"));
}

/// Its middle ahead of the camera, tilted about an axis.
BoardPose tilted(double degrees, const Eigen::Vector3d& axis, double z_mm) {
  BoardPose pose;
  pose.rotation = Eigen::AngleAxisd{degrees * M_PI / 180.0, axis.normalized()}.toRotationMatrix();
  pose.translation_mm = Eigen::Vector3d{0.0, 0.0, z_mm} - pose.rotation * Eigen::Vector3d{142.5, 105.0, 0.0};
  return pose;
}

/// Cells of tags need more pixels than squares of a checkerboard.
Truth camera384() { return {.lens = {270.0, 271.0, 191.5, 157.4, 0.08, -0.1}, .size = {384, 318}}; }

TEST_F(Tags, TellThePoseOfARenderedBoard) {
  const Truth truth = camera384();
  const CameraInfo camera{.width = truth.size.width,
                          .height = truth.size.height,
                          .fx = truth.lens[0],
                          .fy = truth.lens[1],
                          .cx = truth.lens[2],
                          .cy = truth.lens[3],
                          .distortion = {truth.lens[4], truth.lens[5], 0, 0, 0},
                          .calibration_id = {}};
  std::mt19937_64 random{5};
  for (const double degrees : {-35.0, 25.0, 40.0}) {
    const BoardPose pose = tilted(degrees, {0.4, 1.0, 0.1}, 380.0);
    const auto found = locateBoard(seenFrom(truth, pose, random), board_, camera);
    ASSERT_TRUE(found) << found.error().message;
    const auto& known = found->camera_from_board;
    const auto& q = known.pose.rotation_wxyz;
    const Eigen::AngleAxisd turn{Eigen::Quaterniond{q[0], q[1], q[2], q[3]}.toRotationMatrix() *
                                 pose.rotation.transpose()};
    const Eigen::Vector3d off =
        Eigen::Vector3d{known.pose.translation_m.x, known.pose.translation_m.y, known.pose.translation_m.z} -
        1e-3 * pose.translation_mm;
    std::printf("%g degrees: %zu corners, %.3f px RMS, off by %.2f mm, %.2f degrees\n", degrees,
                found->corners, found->rms_px, 1e3 * off.norm(), turn.angle() * 180.0 / M_PI);
    EXPECT_EQ(found->corners, 48U);
    // Corners as good as the bar for reprojection, and a pose no farther off than such corners put it in one
    // of ten thousand boards: its Mahalanobis distance by its own covariance is F of 6 and 2n − 6.
    EXPECT_LT(found->rms_px, 0.2);
    Eigen::Matrix<double, 6, 1> error;
    error << turn.angle() * turn.axis(), off;
    const boost::math::fisher_f allowed{6.0, known.degrees};
    EXPECT_LT(error.dot(known.covariance.ldlt().solve(error)) / 6.0, quantile(complement(allowed, 1e-4)))
        << degrees;
  }
}

TEST_F(Tags, OfTooFewPixelsAreSaidToBe) {
  std::mt19937_64 random{6};
  const Truth truth = camera384();
  const Sighting seen = findBoard(seenFrom(truth, tilted(25.0, {0.4, 1.0, 0.1}, 900.0), random), board_);
  EXPECT_EQ(seen.rejection, Rejection::TooSmall);
  EXPECT_THAT(seen.detail, HasSubstr("cells of tags of 1.8 px, 2.5 are needed"));
}

TEST_F(Tags, CalibrateALens) {
  const Truth truth = camera384();
  std::mt19937_64 random{7};
  std::vector<Sighting> sightings;
  for (int i = 0; i < 12; ++i) {
    const double towards = i * M_PI / 3.0;
    const BoardPose pose =
        tilted(20.0 + 2.0 * i, {std::cos(towards), std::sin(towards), 0.1}, 330.0 + 10.0 * i);
    sightings.push_back(findBoard(seenFrom(truth, pose, random), board_));
  }
  const auto result = estimate(board_, sightings, truth.size, {.model = LensModel::K1K2, .degree = 0});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_GE(result->used.size(), 11U);
  std::printf("%.4f px RMS\n", result->rms_px_all);
  // Edges of four pixels, and a tag's own cells beyond them: some five times worse than a checkerboard's
  // corners.
  EXPECT_LT(result->rms_px_all, 0.2);
  for (std::size_t i = 0; i < 6; ++i) {
    // Twice the 95 % interval: missed once in 10^4 by each.
    EXPECT_NEAR(result->bundle.lens[i], truth.lens[i],
                2.0 * result->uncertainty.half_width[static_cast<Eigen::Index>(i)])
        << kParameterNames[i];
  }
}

TEST_F(Tags, ThatCannotBeAreRefused) {
  const auto why = [](const char* tags, Length pitch, Length tag, const char* dictionary) {
    const auto board = tagsOf(tags, pitch, tag, dictionary);
    return board ? std::string{} : board.error().message;
  };
  EXPECT_EQ(why("4x3", 75_mm, 60_mm, "DICT_APRILTAG_36h11"), "");
  EXPECT_THAT(why("4", 75_mm, 60_mm, "DICT_APRILTAG_36h11"), HasSubstr("COLSxROWS"));
  EXPECT_THAT(why("1x3", 75_mm, 60_mm, "DICT_APRILTAG_36h11"), HasSubstr("2 to 50"));
  EXPECT_THAT(why("4x3", 75_mm, 0_mm, "DICT_APRILTAG_36h11"), HasSubstr("dark border"));
  EXPECT_THAT(why("4x3", 64_mm, 60_mm, "DICT_APRILTAG_36h11"), HasSubstr("gap of a cell (7.5 mm)"));
  EXPECT_THAT(why("4x3", 75_mm, 60_mm, "tag36h11"), HasSubstr("DICT_APRILTAG_36h11"));
  EXPECT_THAT(why("9x9", 75_mm, 60_mm, "DICT_APRILTAG_16h5"), HasSubstr("larger dictionary"));
  const auto both = targetOf(BoardWords{.corners = "8x5", .tags = "4x3", .square = 75_mm, .marker = 60_mm});
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().message, HasSubstr("either corners"));
}

TEST(CornerFit, FindsTheOuterCornerOfADarkSquare) {
  // Dark to the right of and below (10.3, 9.6), in light that rises to the right.
  Image<float> image{20, 20};
  for (int v = 0; v < 20; ++v) {
    for (int u = 0; u < 20; ++u) {
      const double s = 1.0 + std::erf((u - 10.3) / 0.9), t = 1.0 + std::erf((v - 9.6) / 0.9);
      image(u, v) = static_cast<float>(150.0 + 3.0 * (u - 10.3) - 30.0 * s * t);
    }
  }
  for (const bool is_turned : {false, true}) {
    CornerGuess guess{.at = {10.0, 10.0}, .along = {14.0, 0.5}, .across = {-0.5, 14.0}, .is_outer = true};
    if (is_turned) std::swap(guess.along, guess.across);
    const auto corner = fitCorner(image, guess, HUGE_VALF);
    ASSERT_TRUE(corner.has_value());
    EXPECT_NEAR(corner->at.u, 10.3, 1e-3);
    EXPECT_NEAR(corner->at.v, 9.6, 1e-3);
  }
}

}  // namespace
}  // namespace toftwin::intrinsics
