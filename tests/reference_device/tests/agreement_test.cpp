// SPDX-License-Identifier: Apache-2.0
// With nothing hidden, simulator and reference device see the same. Not theory for either: both were made
// from the same documents and nothing else.
#include <gtest/gtest.h>

#include <cmath>

#include <toftwin/units.h>

#include "tests/reference_device/agreement/agreement.h"

namespace toftwin::reference {
namespace {

AgreementJob job(const std::string& scene, Vec3d position_m, double turned_deg, int samples) {
  const std::string root = TOFTWIN_SOURCE_DIR;
  AgreementJob one{.camera = root + "/tests/reference_device/camera.toml",
                   .scene = root + "/docs/examples/plans/scenes/" + scene + ".toml"};
  one.world_from_camera = rotation<World, Camera>({0, 1, 0}, turned_deg * degree.in_si);
  one.world_from_camera.translation_m = position_m;
  one.samples_per_pixel = samples;
  return one;
}
Agreement at(const std::string& scene, Vec3d position_m, double turned_deg, int samples) {
  return agreementOf(job(scene, position_m, turned_deg, samples));
}

// The tracer works in float: 1e-6 of some metres; what is left of 64 samples of an even wall is less.
TEST(SimulatorAndReference, AgreeOnAWall) {
  for (const double turned : {0.0, 30.0, 50.0}) {
    const Agreement a = at("wall", {0, 0, 0.5}, turned, 64);
    EXPECT_GT(a.pixels, 2000U);
    EXPECT_LT(std::abs(a.mean_mm), 0.01) << turned;
    EXPECT_LT(a.rms_mm, 0.05) << turned;
    EXPECT_LT(a.rms_gain, 5e-4) << turned;
  }
}

// Shares of pixels at edges are found by 256 even samples there and 2400 here: some 1e-2 of a pixel each, of
// 150 mm.
TEST(SimulatorAndReference, AgreeOnEdges) {
  const Agreement a = at("checkerboard", {0, 0, 0.9}, 0.0, 256);
  EXPECT_GT(a.edges, 1000U);
  EXPECT_LT(std::abs(a.mean_mm), 0.01);
  EXPECT_LT(a.edge_rms_mm, 0.2);
}

// Monte-Carlo noise of 256 paths is some 4 mm a pixel; the mean over 2500 pixels is then right within 0.1 mm,
// and the patches of the radiosity within 0.1 mm: 4 σ of both together.
TEST(SimulatorAndReference, AgreeInACorner) {
  const Agreement a = at("corner-90", {0, 0, 0.5}, 0.0, 256);
  EXPECT_GT(a.pixels, 2000U);
  EXPECT_LT(std::abs(a.mean_mm), 0.56);
  EXPECT_LT(std::abs(a.mean_gain), 2e-3);
}

// The eight columns about the edge, where light from the other board changes within pixels: noise of 4096 paths is
// some 1.7 mm and 0.3 % a pixel, 0.09 mm and 0.014 % of the mean over 384 (of 1024 paths, twice that: docs); 4 σ, and as
// much again for the radiosity. One place a pixel and large patches as points made -1.3 mm of it.
TEST(SimulatorAndReference, AgreeBesideTheEdgeOfACorner) {
  AgreementJob beside = job("corner-60", {0, 0, 0.8}, 0.0, 4096);
  beside.first_column = 28, beside.columns = 8, beside.max_surfaces = 32;
  const Agreement a = agreementOf(beside);
  EXPECT_GT(a.pixels, 300U);
  EXPECT_LT(std::abs(a.mean_mm), 0.7);
  EXPECT_LT(std::abs(a.mean_gain), 1.1e-3);
}

}  // namespace
}  // namespace toftwin::reference
