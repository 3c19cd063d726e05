// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/color.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace toftwin::sim {
namespace {

/// What sRGB (IEC 61966-2-1) shows for a linear value of 0 to 1, as 0 to 255.
std::uint8_t toSrgb(double linear) {
  const double l = std::clamp(linear, 0.0, 1.0);
  const double shown = l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1.0 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255.0 * shown));
}

/// The radiance below which 99 % of all values are.
double whiteLevel(const std::array<Image<float>, 3>& radiance) {
  std::vector<float> values;
  for (const Image<float>& band : radiance)
    values.insert(values.end(), band.pixels().begin(), band.pixels().end());
  const auto rank = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), rank, values.end());
  return std::max(static_cast<double>(*rank), 1e-30);
}

bool isDark(const Image<float>& radiance) {
  return std::ranges::none_of(radiance.pixels(), [](float value) { return value > 0.0F; });
}

template <class Load>
Result<VisibleScene> inThreeBands(const Load& load) {
  std::vector<Scene> scenes;
  for (const Band band : {Band::Red, Band::Green, Band::Blue}) {
    auto scene = load(band);
    if (!scene) return scene.error();
    scenes.push_back(*std::move(scene));
  }
  return VisibleScene{scenes[0], scenes[1], scenes[2]};
}

}  // namespace

Result<VisibleScene> loadVisible(const std::filesystem::path& scene_file, const SceneLoading& how) {
  return inThreeBands([&](Band band) { return Scene::load(scene_file, band, how); });
}

Result<VisibleScene> parseVisible(std::string_view toml, const std::filesystem::path& name) {
  return inThreeBands([&](Band band) { return Scene::parse(toml, name, band); });
}

Result<ColorImage> renderColor(const VisibleScene& scene, const ColorRequest& request,
                               const TraceBand& trace_band) {
  const Transform<Camera, ColorLens> camera_from_color = request.lenses.color_from_camera.inverse();
  const Transform<World, ColorLens> world_from_color =
      request.world_from_camera * camera_from_color;
  TraceRequest trace;
  trace.camera = request.lenses.color;
  trace.world_from_camera = {world_from_color.rotation_wxyz, world_from_color.translation_m};
  trace.samples_per_pixel = request.samples_per_pixel;
  trace.max_surfaces = request.max_surfaces;
  trace.seed = request.seed;
  std::array<Image<float>, 3> radiance;
  for (std::size_t band = 0; band < 3; ++band) {
    auto light = trace_band(scene[band], trace);
    if (!light) return light.error();
    if (band == 0 && trace.emitters.empty() && isDark(light->ambient)) {
      trace.emitters.push_back(
          {.position_m = {0.0, -0.3, 0.0}, .radius = 100.0 * millimetre, .isotropic = true});
      light = trace_band(scene[band], trace);
      if (!light) return light.error();
    }
    radiance[band] = std::move(light->ambient);
    for (std::size_t i = 0; i < radiance[band].size(); ++i) radiance[band][i] += light->steady[i];
  }
  const double white = whiteLevel(radiance);
  ColorImage image;
  for (std::size_t band = 0; band < 3; ++band) {
    image[band] = Image<std::uint8_t>{trace.camera.width, trace.camera.height};
    for (std::size_t i = 0; i < image[band].size(); ++i)
      image[band][i] = toSrgb(static_cast<double>(radiance[band][i]) / white);
  }
  return image;
}

CameraInfo scaled(const CameraInfo& camera, double share) {
  CameraInfo result = camera;
  result.width = std::max(1, static_cast<int>(std::lround(camera.width * share)));
  result.height = std::max(1, static_cast<int>(std::lround(camera.height * share)));
  const double by_x = static_cast<double>(result.width) / camera.width;
  const double by_y = static_cast<double>(result.height) / camera.height;
  result.fx *= by_x;
  result.fy *= by_y;
  result.cx = (camera.cx + 0.5) * by_x - 0.5;
  result.cy = (camera.cy + 0.5) * by_y - 0.5;
  return result;
}

}  // namespace toftwin::sim
