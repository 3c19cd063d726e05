// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <toftwin/camera_info.h>
#include <toftwin/frame.h>
#include <toftwin/geometry.h>
#include <toftwin/modulation.h>
#include <toftwin/names.h>
#include <toftwin/units.h>

#include <array>
#include <span>

namespace toftwin {
namespace {

TEST(Units, UnambiguousRangeOf16MHzIsTheOneOfTheTextbook) {
  EXPECT_NEAR(unambiguousRange(16_MHz).in(metre), 9.3685, 5e-5);  // c / 2f
}

TEST(Units, SeveralFrequenciesRepeatTogetherAtTheOneTheyHaveInCommon) {
  EXPECT_DOUBLE_EQ(commonFrequency(std::array{80_MHz, 16_MHz, 120_MHz}).in(megahertz), 8.0);
  EXPECT_DOUBLE_EQ(commonFrequency(std::array{29_MHz, 29.001_MHz}).in(hertz), 1e3);
  EXPECT_DOUBLE_EQ(commonFrequency(std::array{30_MHz}).in(megahertz), 30.0);
  EXPECT_DOUBLE_EQ(commonFrequency(std::span<const Frequency>{}).in(hertz), 0.0);
}

TEST(Units, LeavesInTheUnitAskedFor) {
  EXPECT_DOUBLE_EQ((15_um).in(millimetre), 0.015);
  EXPECT_DOUBLE_EQ((180_deg).in(radian), std::numbers::pi);
  EXPECT_DOUBLE_EQ((1_m + 5_cm) / 1_cm, 105.0);
}

TEST(Transform, InverseUndoesIt) {
  Transform<World, Camera> world_from_camera =
      rotation<World, Camera>(normalised(Vec3d{1.0, 2.0, -0.5}), 0.7);
  world_from_camera.translation_m = {0.3, -2.0, 1.5};
  const Point<Camera> p{{0.1, 0.2, 3.0}};
  const Point<Camera> back = world_from_camera.inverse() * (world_from_camera * p);
  EXPECT_NEAR(norm(back.m - p.m), 0.0, 1e-15 * 8);
}

TEST(Transform, ComposesInReadingOrder) {
  Transform<World, Board> world_from_board = rotation<World, Board>({0, 0, 1}, 0.4);
  world_from_board.translation_m = {1, 0, 0};
  Transform<Board, Camera> board_from_camera = rotation<Board, Camera>({0, 1, 0}, -0.9);
  board_from_camera.translation_m = {0, 2, 0};
  const Point<Camera> p{{0.5, -0.25, 2.0}};
  const Point<World> stepwise = world_from_board * (board_from_camera * p);
  const Point<World> composed = (world_from_board * board_from_camera) * p;
  EXPECT_NEAR(norm(stepwise.m - composed.m), 0.0, 1e-15 * 8);
}

TEST(CameraInfo, RayThroughAPixelProjectsBackOntoIt) {
  // Kinect v2, a real unit (iai_kinect2): the strongest distortion of the presets.
  const CameraInfo camera{512, 424, 365.456, 365.456, 254.88, 205.40,
                          {0.0905, -0.268, 0.0, 0.0, 0.0951}, ""};
  for (double v = 0; v < 424; v += 53) {
    for (double u = 0; u < 512; u += 64) {
      const Direction<Camera> ray = rayThroughPixel(camera, u, v);
      const auto back = pixelOfPoint(camera, {ray.v * 2.5});
      EXPECT_NEAR(back[0], u, 1e-8) << "v = " << v;
      EXPECT_NEAR(back[1], v, 1e-8) << "u = " << u;
      EXPECT_NEAR(norm(ray.v), 1.0, 1e-15);
    }
  }
}

TEST(Plane, AdoptsAnImageWithoutCopyingIt) {
  Image<float> image{3, 2, 1.5f};
  const float* pixels = image.pixels().data();
  const Plane plane = toPlane(PlaneKind::Range, std::move(image));
  EXPECT_EQ(plane.as<float>().data(), pixels);
  EXPECT_EQ(plane.byteSize(), plane.data.size());
}

TEST(Names, EveryPlaneKindComesBackFromItsName) {
  for (int i = 0; i <= static_cast<int>(kLastPlaneKind); ++i) {
    const auto kind = static_cast<PlaneKind>(i);
    EXPECT_EQ(planeKindNamed(nameOf(kind)), kind);
  }
  EXPECT_EQ(planeKindNamed("distance"), std::nullopt);
  EXPECT_EQ(otherWordFor("distance"), "; for what others call \"distance\" see range");
  EXPECT_EQ(otherWordFor("range"), "");
}

}  // namespace
}  // namespace toftwin
