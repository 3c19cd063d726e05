// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <toftwin/geometry.h>

#include "tests/sim/camera_testing.h"
#include "tests/sim/figures/canvas.h"
#include "tests/sim/figures/figures.h"

namespace toftwin::sim::figures {
namespace {

std::string effect(const std::string& type, const std::string& keys = {}) {
  return "[[effect]]\ntype = '" + type + "'\n" + keys + "\n";
}

constexpr int kWidth = 64, kHeight = 48;

/// 30 MHz, four steps of two taps, a small wide image.
SensorModel camera(const std::string& effects) {
  return modelOf(
      "[lens]\nwidth = 64\nheight = 48\nfx = 62\nfy = 62\ncx = 31.5\ncy = 23.5\n[[emitter]]\nposition_mm = "
      "[40, 0, 0]\nhalf_angle_deg = 60\n[[modulation]]\nfrequency_mhz = 30\nexposure_us = 1000\ncontrast = 0.5\n"
      "[sampling]\nsteps = 4\ntaps = 2\n[pixel]\nelectrons_per_radiance_s = 4e8\n" + effects);
}

/// The box before the wall: direct light of 1 W beside the lens, 16 rays per pixel, by hand so that these
/// figures do not change with the tracer's sampling.
class BoxBeforeWall {
 public:
  explicit BoxBeforeWall(double box_right) : box_right_(box_right) {}

  [[nodiscard]] Way along(double across, double up) const {
    const Vec3d direction = normalised(Vec3d{across, up, 1.0});
    const Hit box = hitBox({}, direction), wall{kWallDepth_m / direction.z, Vec3d{0.0, 0.0, -1.0}};
    const bool is_box = box.distance_m < wall.distance_m;
    const Hit& hit = is_box ? box : wall;
    const Vec3d point = direction * hit.distance_m;
    const Vec3d to_lamp = kLamp_m - point;
    const double away_m = norm(to_lamp);
    const Vec3d towards = to_lamp * (1.0 / away_m);
    const bool is_in_shadow = !is_box && hitBox(point, towards).distance_m < away_m;
    const double lit = is_in_shadow ? 0.0 : std::max(0.0, dot(hit.normal, towards));
    const double albedo = is_box ? 0.8 : 0.3;
    // Lambertian lamp and surfaces: I = cos γ / π, L = ρ/π · I cos θ / r².
    const double radiance = albedo / kPi * -towards.z / kPi * lit / (away_m * away_m);
    return {radiance, 0.5 * (hit.distance_m + away_m)};
  }

 private:
  struct Hit {
    double distance_m;
    Vec3d normal;
  };
  static constexpr double kWallDepth_m = 2.4;
  static constexpr Vec3d kLamp_m{0.04, 0.0, 0.0};

  /// Slabs in the frame of a box of 0.4 × 0.5 × 0.3 m that is turned by 25 degrees.
  [[nodiscard]] Hit hitBox(const Vec3d& from, const Vec3d& direction) const {
    const double c = std::cos(25.0 * kPi / 180.0), s = std::sin(25.0 * kPi / 180.0);
    const auto turned = [&](const Vec3d& v) { return Vec3d{c * v.x - s * v.z, v.y, s * v.x + c * v.z}; };
    const Vec3d start = turned(from - Vec3d{box_right_, 0.15, 1.1}), along = turned(direction);
    const double starts[] = {start.x, start.y, start.z}, alongs[] = {along.x, along.y, along.z};
    const double half[] = {0.2, 0.25, 0.15};
    double enter = 1e-6, leave = 1e6;
    int side = 0;
    for (int i = 0; i < 3; ++i) {
      const double a = (-half[i] - starts[i]) / alongs[i], b = (half[i] - starts[i]) / alongs[i];
      if (std::min(a, b) > enter) enter = std::min(a, b), side = i;
      leave = std::min(leave, std::max(a, b));
    }
    if (enter >= leave) return {1e6, {}};
    const double sign = alongs[side] > 0.0 ? -1.0 : 1.0;
    const Vec3d local = side == 0 ? Vec3d{sign, 0, 0} : side == 1 ? Vec3d{0, sign, 0} : Vec3d{0, 0, sign};
    return {enter, {c * local.x + s * local.z, local.y, -s * local.x + c * local.z}};
  }
  double box_right_;
};

Light boxBeforeWall(double box_right = 0.0) {
  const BoxBeforeWall scene{box_right};
  return syntheticLight(kWidth, kHeight, {30_MHz}, 1, [&](int x, int y) {
    std::vector<Way> ways;
    for (int i = 0; i < 16; ++i) {
      Way way = scene.along((x - 31.875 + 0.25 * (i % 4)) / 62.0, (y - 23.875 + 0.25 * (i / 4)) / 62.0);
      way.radiance /= 16.0;
      ways.push_back(way);
    }
    return ways;
  });
}

Image<float> errors_mm(const RangeImage& image, const RangeImage& right) {
  Image<float> error{image.range_m.width(), image.range_m.height()};
  for (std::size_t i = 0; i < error.size(); ++i) error[i] = 1e3F * (image.range_m[i] - right.range_m[i]);
  return error;
}

Image<float> errorOf(const std::string& effects, const Light& light, History before = {}) {
  return errors_mm(camera(effects).expose(light, {}, 1, 0, 0, 0, before).range,
                   camera("").expose(light, {}, 1, 0).range);
}

Light wall(double radiance) {
  const SensorModel model = camera("");
  return evenLight(model, radiance, 2.0);
}

Image<float> amplitudeOf(const std::string& effects, const Light& light) {
  Image<float> amplitude = camera(effects).expose(light, {}, 1, 0).range.amplitude;
  for (float& value : amplitude.pixels()) value /= 1e3F;
  return amplitude;
}

/// Points seen from above, from the rows across the box.
compare::Curve fromAbove(const RangeImage& image, std::string name, compare::Ink ink) {
  compare::Curve points{.name = std::move(name), .ink = ink, .stroke = compare::Stroke::Dots};
  for (int y = 18; y < 30; y += 2) {
    for (int x = 0; x < kWidth; ++x) {
      const double across = (x - 31.5) / 62.0, up = (y - 23.5) / 62.0;
      const double depth_m = static_cast<double>(image.range_m(x, y)) / std::sqrt(1.0 + across * across + up * up);
      points.x.push_back(across * depth_m);
      points.y.push_back(depth_m);
    }
  }
  return points;
}

std::string pointsWithFilter(const std::string& filter) {
  const Light light = boxBeforeWall();
  const std::string noise = effect("shot_noise") + effect("read_noise", "sigma_electrons = 20");
  return standalone(compare::Plot{
      .title = "a box before a wall, seen from above",
      .x_label = "to the right, m",
      .y_label = "depth, m",
      .curves = {fromAbove(camera(noise).expose(light, {}, 1, 0).range, "rejected", compare::Ink::Published),
                 fromAbove(camera(noise + filter).expose(light, {}, 1, 0).range, "kept", compare::Ink::Simulated)},
      .y_range = std::pair{0.7, 2.6}});
}

std::string lag() {
  const Light light = boxBeforeWall(0.15), earlier = boxBeforeWall(-0.25);
  const SensorModel model = camera("");
  const Samples before = model.collect(earlier, {}, 1, 0);
  const auto with = [&](const char* share) {
    return errorOf(effect("lag", std::string{"exposure_share = 0\nframe_share = "} + share), light,
                   {.collected = &before});
  };
  return standalone(Panels{.label = "error of the range, mm",
                           .low = -200.0,
                           .high = 200.0,
                           .diverging = true,
                           .panels = {{"0.2 % of the frame before", with("0.002")}, {"1 %", with("0.01")}}});
}

}  // namespace

void addImageFigures(std::map<std::string, Draw>& figures) {
  figures["lens_scatter"] = [] {
    const Light light = boxBeforeWall();
    return standalone(Panels{.label = "error of the range, mm",
                             .low = -120.0,
                             .high = 120.0,
                             .diverging = true,
                             .panels = {{"veil of 1 %", errorOf(effect("lens_scatter", "halo = 0"), light)},
                                        {"halo of 2 %, σ = 6 px",
                                         errorOf(effect("lens_scatter", "veil = 0\nhalo_radius_px = 6"), light)}}});
  };
  figures["lens_ghost"] = [] {
    const Light light = boxBeforeWall(0.25);
    return standalone(Panels{.label = "error of the range, mm",
                             .low = -80.0,
                             .high = 80.0,
                             .diverging = true,
                             .panels = {{"ghost of 0.5 %", errorOf(effect("lens_ghost"), light)},
                                        {"of 2 %", errorOf(effect("lens_ghost", "share = 0.02"), light)}}});
  };
  figures["learned"] = [] {
    const Light light = boxBeforeWall();
    const auto of = [&](const std::string& term) { return errorOf(effect("learned", "terms = ['" + term + "']"), light); };
    return standalone(Panels{.label = "error of the range, mm",
                             .low = -40.0,
                             .high = 40.0,
                             .diverging = true,
                             .panels = {{"range: wave × column", of("range_mm += 0.6 * sine(range_mm, 700) * column")},
                                        {"light: 1 % of its row", of("light_percent += 1 * row_mean()")},
                                        {"samples: 8th columns", of("quadrature_e += 60 * class(column, 8, 3)")}}});
  };
  figures["vignetting"] = [] {
    return standalone(Panels{.label = "amplitude, ke-",
                             .low = 0.0,
                             .high = 2.2,
                             .panels = {{"an even light", amplitudeOf("", wall(0.01))},
                                        {"with the fourth power", amplitudeOf(effect("vignetting"), wall(0.01))}}});
  };
  figures["propagation_delay"] = [] {
    return standalone(Panels{
        .label = "error of the range, mm",
        .low = -1.0,
        .high = 1.0,
        .diverging = true,
        .panels = {{"0.02 mm per column", errorOf(effect("propagation_delay"), wall(0.01))},
                   {"0.03 mm per row from the middle",
                    errorOf(effect("propagation_delay", "per_column_mm = 0\nper_row_from_middle_mm = 0.03"), wall(0.01))}}});
  };
  figures["fixed_pattern_phase"] = [] {
    return standalone(Panels{.label = "error of the range, mm",
                             .low = -40.0,
                             .high = 40.0,
                             .diverging = true,
                             .panels = {{"device 1", errorOf(effect("fixed_pattern_phase"), wall(0.01))},
                                        {"device 2", errorOf(effect("fixed_pattern_phase", "device = 2"), wall(0.01))}}});
  };
  figures["column_comb"] = [] {
    const std::string comb = effect("column_comb", "period = 8");
    return standalone(Panels{.label = "error of the range, mm",
                             .low = -20.0,
                             .high = 20.0,
                             .diverging = true,
                             .panels = {{"a grey wall", errorOf(comb, wall(0.01))},
                                        {"four times darker", errorOf(comb, wall(0.0025))}}});
  };
  figures["lag"] = lag;
  figures["flying_pixel_filter"] = [] { return pointsWithFilter(effect("flying_pixel_filter")); };
  figures["edge_filter"] = [] { return pointsWithFilter(effect("edge_filter", "limit_mm = 80")); };
}

}  // namespace toftwin::sim::figures
