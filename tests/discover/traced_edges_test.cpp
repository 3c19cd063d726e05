// SPDX-License-Identifier: Apache-2.0
// Which pixels count beside an edge, by how well it is known where the edge is.
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/discover/campaign/campaign.h"
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

/// So many columns are left out about the edge, by a camera of that focal length.
int widthOfEdge(double focal_px, const std::vector<Stood>& stood) {
  std::string text = smallCamera();
  for (const std::string key : {"fx = 42.0", "fy = 42.0"}) {
    const auto at = text.find(key);
    if (at == std::string::npos) throw std::runtime_error("the small camera has another focal length");
    text.replace(at, key.size(), key.substr(0, 5) + std::to_string(focal_px));
  }
  const auto model = sim::SensorModel::parse(text, "camera.toml");
  const auto scene = sim::Scene::parse(kHalves, "scene.toml");
  if (!model || !scene) throw std::runtime_error("the camera or the scene is wrong");
  MeasuredCapture capture;
  capture.moment.world_from_camera = Transform<World, Camera>{};
  const auto traced =
      traceAll({*model, *scene}, {capture}, {.samples_per_pixel = 4, .max_surfaces = 1}, {}, stood);
  if (!traced) throw std::runtime_error(traced.error().message);
  const Image<std::uint8_t>& edge = traced->front()->is_edge;
  const int row = edge.height() / 2, border = 6;  // the image's own edges, whose neighbours nobody knows
  int width = 0;
  for (int x = border; x < edge.width() - border; ++x) width += edge(x, row);
  return width;
}

TEST(TracedEdges, LeaveOutWhatAPoseAsItWasToldMayReach) {
  EXPECT_EQ(widthOfEdge(42.0, {}), 2);  // three deviations are 0.23 pixels
  // 366 × √(0.1°² + (1 mm / 2 m)²) = 0.66 pixels, of which three deviations are 2.
  EXPECT_EQ(widthOfEdge(366.0, {}), 6);
  // Also where each capture has light of its own, but stands where it was told to.
  EXPECT_EQ(widthOfEdge(366.0, {Stood{}}), 6);
}

TEST(TracedEdges, LeaveOutOnePixelWhereTheLightSaysWhereTheCameraStands) {
  EXPECT_EQ(widthOfEdge(366.0, {Stood{0.0, 0.0, 0.5, 0.0, 0.0}}), 2);
}

}  // namespace
}  // namespace toftwin::discover
