// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "protocol/ros/of_frame.h"
#include "tools/cli/export/folders.h"
#include "tools/cli/import/lens/lens_file.h"

namespace toftwin::cli {
namespace {

using testing::HasSubstr;

// As camera_calibration writes it, of a lens of 640 x 480 pixels.
constexpr const char* kRos = R"(image_width: 640
image_height: 480
camera_name: head_camera
camera_matrix:
  rows: 3
  cols: 3
  data: [ 438.78306,    0.     ,  305.59336,
            0.     ,  437.30288,  243.73889,
            0.     ,    0.     ,    1.     ]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
projection_matrix:
  rows: 3
  cols: 4
  data: [393.65, 0, 322.79, 0, 0, 241.45, 0, 0, 0, 0, 1, 0]
)";
constexpr const char* kOpenCvYaml = R"(%YAML:1.0
---
calibration_time: "Thu Mar  3 2022"
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 4.3878306e+02, 0., 3.0559336e+02, 0., 4.3730288e+02, 2.4373889e+02,
       0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -3.61976e-01, 1.10510e-01, 1.014e-03, 5.05e-04, 0. ]
avg_reprojection_error: 0.2
)";
constexpr const char* kOpenCvXml = R"(<?xml version="1.0"?>
<opencv_storage>
<image_Width>640</image_Width>
<image_Height>480</image_Height>
<Camera_Matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt><data>
    438.78306 0. 305.59336 0. 437.30288 243.73889 0. 0. 1.</data></Camera_Matrix>
<Distortion_Coefficients type_id="opencv-matrix"><rows>5</rows><cols>1</cols><dt>d</dt><data>
    -0.361976 0.110510 0.001014 0.000505 0.</data></Distortion_Coefficients>
</opencv_storage>
)";

class LensFiles : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Texts, LensFiles, testing::Values(kRos, kOpenCvYaml, kOpenCvXml));

TEST_P(LensFiles, RaysMeetTheirPixelsByRossOwnFormulasToANanometrePerMetre) {
  const auto lens = lensOfText(GetParam(), "lens");
  ASSERT_TRUE(lens) << lens.error().message;
  EXPECT_EQ(lens->camera.width, 640);
  EXPECT_EQ(lens->camera.height, 480);
  EXPECT_TRUE(lens->note.empty()) << lens->note;
  const double k1 = -0.361976, k2 = 0.110510, p1 = 0.001014, p2 = 0.000505;
  for (int v = 0; v < 480; v += 40) {
    for (int u = 0; u < 640; u += 40) {
      const Vec3d ray = rayThroughPixel(lens->camera, u, v).v;
      const double x = ray.x / ray.z, y = ray.y / ray.z, r2 = x * x + y * y, radial = 1 + k1 * r2 + k2 * r2 * r2;
      const double bent_x = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), bent_y = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
      EXPECT_NEAR(bent_x, (u - 305.59336) / 438.78306, 1e-9) << u << ", " << v;
      EXPECT_NEAR(bent_y, (v - 243.73889) / 437.30288, 1e-9) << u << ", " << v;
    }
  }
}

TEST(LensText, WhatWeWriteIsReadBackToTheLastBit) {
  const CameraInfo camera{512, 424, 365.456, 365.1234567890123, 254.878, 205.395, {0.0905, -0.268, 1e-5, -2e-17, 0.0951}, ""};
  const auto lens = lensOfText(cameraYaml(camera, "kinect"), "camera.yaml");
  ASSERT_TRUE(lens) << lens.error().message;
  EXPECT_EQ(lens->camera, camera);
}

TEST(LensText, WithoutAMatrixItIsNoLens) {
  for (const char* text : {"", "camera_matrix", "camera_matrix:", "camera_matrix:\n  data: [1, 2]\n", "<camera_matrix>", "camera_matrix: [nan, 1e999, -]", "K"}) {
    const auto lens = lensOfText(text, "lens.yaml");
    ASSERT_FALSE(lens) << text;
    EXPECT_THAT(lens.error().message, HasSubstr("lens.yaml"));
  }
}

ros::CameraInfo infoOf(const std::string& model, std::vector<double> terms) {
  auto info = ros::infoOf(CameraInfo{160, 120, 130.0, 131.0, 80.5, 59.0, {}, ""});
  info.distortion_model = model;
  info.d = std::move(terms);
  return info;
}

TEST(LensOfInfo, ARationalModelIsFittedAndSaysHowWell) {
  const auto lens = lensOf(infoOf("rational_polynomial", {0.3, -0.1, 0.001, 0.0005, 0.01, 0.25, -0.08, 0.012}), false);
  ASSERT_TRUE(lens) << lens.error().message;
  EXPECT_THAT(lens->note, HasSubstr("rational_polynomial"));
  // At a pixel's ray the model of ROS and ours differ by less than a tenth of a pixel.
  const double x = 0.3, y = -0.2, r2 = x * x + y * y;
  const double radial = (1 + 0.3 * r2 - 0.1 * r2 * r2 + 0.01 * r2 * r2 * r2) / (1 + 0.25 * r2 - 0.08 * r2 * r2 + 0.012 * r2 * r2 * r2);
  const double u = 130.0 * (x * radial + 2 * 0.001 * x * y + 0.0005 * (r2 + 2 * x * x)) + 80.5;
  EXPECT_NEAR(pixelOfPoint(lens->camera, {{x, y, 1.0}})[0], u, 0.1);
}

TEST(LensOfInfo, RegionAndBinningMoveTheCentre) {
  auto info = infoOf("plumb_bob", {0, 0, 0, 0, 0});
  info.roi = {.x_offset = 40, .y_offset = 20, .height = 60, .width = 80, .do_rectify = false};
  info.binning_x = info.binning_y = 2;
  const auto lens = lensOf(info, false);
  ASSERT_TRUE(lens) << lens.error().message;
  EXPECT_EQ(lens->camera.width, 40);
  EXPECT_EQ(lens->camera.fx, 65.0);
  EXPECT_EQ(lens->camera.cx, (80.5 - 40.0 + 0.5) / 2.0 - 0.5);
}

TEST(LensOfInfo, OfARectifiedImageItIsTheProjection) {
  auto info = infoOf("plumb_bob", {0.1, 0, 0, 0, 0});
  info.p[0] = 120.0;
  const auto lens = lensOf(info, true);
  ASSERT_TRUE(lens);
  EXPECT_EQ(lens->camera.fx, 120.0);
  EXPECT_EQ(lens->camera.distortion[0], 0.0);
}

TEST(LensOfInfo, WhatIsNotCalibratedOrNotKnownIsSaid) {
  auto info = infoOf("plumb_bob", {});
  info.k = {};
  EXPECT_THAT(lensOf(info, false).error().message, HasSubstr("not calibrated"));
  EXPECT_THAT(lensOf(infoOf("mei", {0.1}), false).error().message, HasSubstr("\"mei\""));
}

}  // namespace
}  // namespace toftwin::cli
