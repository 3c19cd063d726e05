// SPDX-License-Identifier: Apache-2.0
// Which pixels count beside an edge, by how well it is known where the edge is.
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/discover/campaign/captures/campaign.h"
#include "tests/discover/simulated_run.h"

namespace toftwin::discover {
namespace {

/// A wall whose left half is darker: one edge, along a column.
constexpr auto kHalves = R"(
[[material]]
name = "grey"
albedo = 0.5
[[material]]
name = "dark"
albedo = 0.2
[[object]]
name = "wall"
shape = "rectangle"
size_m = [9, 7, 0]
position_m = [0, 0, 2]
material = "grey"
[[object]]
name = "half"
shape = "rectangle"
size_m = [4, 7, 0]
position_m = [-2, 0, 1.999]
material = "dark"
)";

/// Stripes of 5 cm, which a camera of 366 pixels at 2 m sees 9 pixels wide.
std::string stripes() {
  std::string scene = kHalves;
  for (int i = 0; i < 20; ++i)
    scene += "[[object]]\nname = \"stripe" + std::to_string(i) +
             "\"\nshape = \"rectangle\"\nsize_m = [0.05, 7, 0]\nmaterial = \"grey\"\nposition_m = [" +
             std::to_string(-0.975 + 0.1 * i) + ", 0, 1.998]\n";
  return scene;
}

struct Seen {
  std::string scene = kHalves;
  double focal_px = 366.0;
  Transform<World, Camera> pose{};
  std::vector<Stood> stood{};
};

TracedCapture traced(const Seen& seen) {
  const std::string focal_px = std::to_string(seen.focal_px);
  const std::string text =
      withReplaced(smallCamera(), {{"fx = 42.0", "fx = " + focal_px}, {"fy = 42.0", "fy = " + focal_px}});
  const auto model = sim::SensorModel::parse(text, "camera.toml");
  const auto scene = sim::Scene::parse(seen.scene, "scene.toml");
  if (!model || !scene) throw std::runtime_error("the camera or the scene is wrong");
  MeasuredCapture capture;
  capture.moment.world_from_camera = seen.pose;
  const auto all = traceAll({*model, *scene}, {capture}, {.samples_per_pixel = 4, .max_surfaces = 1}, {}, seen.stood);
  if (!all) throw std::runtime_error(all.error().message);
  return *all->front();
}

/// So many pixels of the middle row are left out, but for the image's own edges, whose neighbours nobody knows.
int leftOut(const Image<std::uint8_t>& edge) {
  constexpr int kBorder = 6;
  int count = 0;
  for (int x = kBorder; x < edge.width() - kBorder; ++x) count += edge(x, edge.height() / 2);
  return count;
}

const std::vector<Stood> kAsTheLightSays{Stood{0.0, 0.0, 0.5, 0.0, 0.0}};

TEST(TracedEdges, LeaveOutWhatAPoseAsItWasToldMayReach) {
  EXPECT_EQ(leftOut(traced({.focal_px = 42.0}).is_edge), 2);  // four deviations are 0.30 pixels
  // 366 × √(0.1°² + (1 mm / 2 m)²) = 0.66 pixels, of which four deviations are 3.
  EXPECT_EQ(leftOut(traced({}).is_edge), 8);
  // Also where each capture has light of its own, but stands where it was told to.
  EXPECT_EQ(leftOut(traced({.stood = {Stood{}}}).is_edge), 8);
}

/// Light that says how far away a wall is, and how it lies, does not say where along it the camera stands: four times
/// 366 × 1 mm / 2 m are 0.73 pixels; of 420 pixels 1.7 where poses err by 2 mm, and no more where they seem to err by 9
/// mm.
TEST(TracedEdges, LeaveOutWhatLightDoesNotSayOfThePose) {
  EXPECT_EQ(leftOut(traced({.stood = kAsTheLightSays}).is_edge), 4);
  EXPECT_EQ(leftOut(traced({.focal_px = 200.0, .stood = kAsTheLightSays}).is_edge), 2);
  for (const double ahead : {2.0, 9.0})
    EXPECT_EQ(leftOut(traced({.focal_px = 420.0, .stood = {Stood{0.0, 0.0, ahead, 0.0, 0.0}}}).is_edge), 6) << ahead;
}

TEST(TracedEdges, AreNoWiderForTheLightsNoise) { EXPECT_EQ(leftOut(traced({}).is_jump), 2); }

/// From pixel to pixel its range changes by less than 3 %, over three of them by more.
TEST(TracedEdges, ASlantedWallHasNone) {
  const auto slanted = rotation<World, Camera>({0.0, 1.0, 0.0}, 1.3);
  EXPECT_EQ(leftOut(traced({.pose = slanted}).is_edge),
            leftOut(traced({.pose = slanted, .stood = kAsTheLightSays}).is_edge));
}

/// Three deviations would leave three of nine pixels, of the seven that are beside no edge; two leave five.
TEST(TracedEdges, LeaveHalfOfWhatIsBesideNoEdge) {
  const TracedCapture told = traced({.scene = stripes()});
  const auto kept = [](const Image<std::uint8_t>& edges) {
    return static_cast<double>(std::ranges::count(edges.pixels(), 0));
  };
  EXPECT_LT(kept(told.is_edge), kept(told.is_jump));
  EXPECT_GE(kept(told.is_edge), 0.5 * kept(told.is_jump));
}

}  // namespace
}  // namespace toftwin::discover
