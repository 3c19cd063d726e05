// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/registration.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <toftwin/nan.h>

namespace toftwin::sim {
namespace {

constexpr double kJump = 0.05;  ///< share of the depth from which neighbours are two surfaces
constexpr double kHidden =
    0.02;  ///< share of the depth; libfreenect2 takes 0.01 and spots slanted surfaces

/// A depth pixel as the colour lens sees it.
struct Seen {
  double u, v;  ///< pixel of the colour image
  double z_m;   ///< along its axis
};

std::optional<Seen> project(const LensPair& lenses, const DecodeRays& rays,
                            const Image<float>& range_m, int x, int y) {
  const auto range = static_cast<double>(range_m(x, y));
  if (!(range > 0.0)) return std::nullopt;
  Vec3d ray = rayThroughPixel(lenses.depth, x, y).v;
  if (!rays.x.empty()) {
    const auto rx = static_cast<double>(rays.x(x, y)), rz = static_cast<double>(rays.z(x, y));
    ray = {rx,
           std::copysign(std::sqrt(std::max(0.0, 1.0 - rx * rx - rz * rz)), y - lenses.depth.cy),
           rz};
  }
  const Point<ColorLens> point = lenses.color_from_camera * Point<Camera>{ray * range};
  if (!(point.m.z > 1e-3)) return std::nullopt;
  const auto uv = pixelOfPoint(lenses.color, Point<Camera>{point.m});
  return Seen{uv[0], uv[1], point.m.z};
}

/// Twice the signed area of the triangle a, b, (u, v).
double area(const Seen& a, const Seen& b, double u, double v) {
  return (b.u - a.u) * (v - a.v) - (b.v - a.v) * (u - a.u);
}

/// Draws a triangle into the image of nearest depths. 1/z is linear in the image of a plane.
void draw(const std::array<Seen, 3>& corner, Image<float>& nearest_m) {
  const auto [left, right] = std::minmax({corner[0].u, corner[1].u, corner[2].u});
  const auto [top, bottom] = std::minmax({corner[0].v, corner[1].v, corner[2].v});
  const double whole = area(corner[0], corner[1], corner[2].u, corner[2].v);
  if (!(std::abs(whole) > 1e-12)) return;
  const int last_u =
      std::min(nearest_m.width() - 1, static_cast<int>(std::floor(std::min(right, 1e6))));
  const int last_v =
      std::min(nearest_m.height() - 1, static_cast<int>(std::floor(std::min(bottom, 1e6))));
  for (int v = std::max(0, static_cast<int>(std::ceil(std::max(top, -1.0)))); v <= last_v; ++v) {
    for (int u = std::max(0, static_cast<int>(std::ceil(std::max(left, -1.0)))); u <= last_u; ++u) {
      const double a = area(corner[1], corner[2], u, v) / whole,
                   b = area(corner[2], corner[0], u, v) / whole;
      const double c = 1.0 - a - b;
      if (a < -1e-9 || b < -1e-9 || c < -1e-9) continue;
      const auto z =
          static_cast<float>(1.0 / (a / corner[0].z_m + b / corner[1].z_m + c / corner[2].z_m));
      float& nearest = nearest_m(u, v);
      if (!(nearest <= z)) nearest = z;  // NaN: nothing yet
    }
  }
}

/// Two triangles of four neighbouring pixels, where they are one surface.
void drawQuad(const std::optional<Seen>& a, const std::optional<Seen>& b,
              const std::optional<Seen>& c, const std::optional<Seen>& d, Image<float>& nearest_m) {
  const auto drawIfWhole = [&](const auto& p, const auto& q, const auto& r) {
    if (!p || !q || !r) return;
    const auto [nearest, farthest] = std::minmax({p->z_m, q->z_m, r->z_m});
    if (farthest - nearest <= kJump * nearest) draw({*p, *q, *r}, nearest_m);
  };
  drawIfWhole(a, b, c);
  drawIfWhole(b, d, c);
}

using SeenRow = std::vector<std::optional<Seen>>;

SeenRow projectRow(const LensPair& lenses, const DecodeRays& rays, const Image<float>& range_m,
                   int y) {
  SeenRow row;
  for (int x = 0; x < range_m.width(); ++x) row.push_back(project(lenses, rays, range_m, x, y));
  return row;
}

/// The nearest that the colour lens sees there or, where that is nothing, within a pixel of it;
/// NaN: nothing.
float nearestAround(const Image<float>& depth_m, int u, int v) {
  float nearest = depth_m(u, v);
  if (!std::isnan(nearest)) return nearest;
  for (int y = std::max(0, v - 1); y <= std::min(depth_m.height() - 1, v + 1); ++y) {
    for (int x = std::max(0, u - 1); x <= std::min(depth_m.width() - 1, u + 1); ++x)
      nearest = std::fmin(nearest, depth_m(x, y));
  }
  return nearest;
}

}  // namespace

Image<float> depthInColor(const LensPair& lenses, const DecodeRays& rays,
                          const Image<float>& range_m) {
  Image<float> nearest_m{lenses.color.width, lenses.color.height, kNaN};
  SeenRow above = projectRow(lenses, rays, range_m, 0);
  for (int y = 1; y < range_m.height(); ++y) {
    SeenRow below = projectRow(lenses, rays, range_m, y);
    for (std::size_t x = 0; x + 1 < below.size(); ++x)
      drawQuad(above[x], above[x + 1], below[x], below[x + 1], nearest_m);
    above = std::move(below);
  }
  return nearest_m;
}

ColorImage colorInDepth(const LensPair& lenses, const DecodeRays& rays, const Image<float>& range_m,
                        const Image<float>& depth_in_color_m, const ColorImage& color) {
  ColorImage result;
  result.fill(Image<std::uint8_t>{range_m.width(), range_m.height()});
  for (int y = 0; y < range_m.height(); ++y) {
    for (int x = 0; x < range_m.width(); ++x) {
      const auto seen = project(lenses, rays, range_m, x, y);
      if (!seen) continue;
      const double u = std::round(seen->u), v = std::round(seen->v);
      if (!(u >= 0.0 && v >= 0.0 && u < lenses.color.width && v < lenses.color.height)) continue;
      const int column = static_cast<int>(u), row = static_cast<int>(v);
      const auto nearest = static_cast<double>(nearestAround(depth_in_color_m, column, row));
      if (seen->z_m - nearest > kHidden * seen->z_m) continue;  // NaN: nothing is before it
      for (std::size_t channel = 0; channel < 3; ++channel)
        result[channel](x, y) = color[channel](column, row);
    }
  }
  return result;
}

}  // namespace toftwin::sim
