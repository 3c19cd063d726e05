// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace toftwin::sim {
namespace {

constexpr double kPi = std::numbers::pi;
/// 1 − cos of the sun's angular radius, 0.2666°, without cancellation: 2 sin²(ρ/2).
const double kSunCap = 2.0 * std::pow(std::sin(0.2666 / 2.0 * kPi / 180.0), 2.0);

/// The index of the interval of the running sums that `u` falls into, and where within it.
struct Place {
  std::size_t index;
  double within;
};
Place invert(const double* sums, std::size_t count, double u) {
  const double at = u * sums[count];
  const double* above = std::upper_bound(sums + 1, sums + count, at);
  const auto i = static_cast<std::size_t>(above - sums - 1);
  const double size = sums[i + 1] - sums[i];
  return {i, size > 0.0 ? std::clamp((at - sums[i]) / size, 0.0, 1.0 - 1e-12) : 0.5};
}

}  // namespace

Environment::Environment(Image<float> radiance, Vec3d up, Vec3d ahead, Sun sun)
    : radiance_(std::move(radiance)), up_(up), ahead_(ahead), side_(cross(ahead, up)), sun_(sun) {
  const int w = radiance_.width(), h = radiance_.height();
  row_sums_.assign(1, 0.0);
  for (int y = 0; y < h; ++y) {
    // A pixel's radiance is the same all over it; its solid angle is Δφ (cos θ₀ − cos θ₁).
    const double solid_angle = 2.0 * kPi / w * (std::cos(kPi * y / h) - std::cos(kPi * (y + 1) / h));
    double sum = 0.0;
    pixel_sums_.push_back(0.0);
    for (int x = 0; x < w; ++x)
      pixel_sums_.push_back(sum += static_cast<double>(radiance_(x, y)) * solid_angle);
    row_sums_.push_back(row_sums_.back() + sum);
  }
  if (!radiance_.empty() && row_sums_.back() <= 0.0) radiance_ = {};  // black all over
}

Environment::Pixel Environment::pixelAt(Vec3d direction) const {
  const double theta = std::acos(std::clamp(dot(direction, up_), -1.0, 1.0));
  const double phi = std::atan2(dot(direction, side_), dot(direction, ahead_));  // 0: ahead
  const int w = radiance_.width(), h = radiance_.height();
  const int x = static_cast<int>((phi / (2.0 * kPi) + 0.5) * w), y = static_cast<int>(theta / kPi * h);
  return {std::clamp(x, 0, w - 1), std::clamp(y, 0, h - 1)};
}

/// Rows are drawn by their sum, pixels within them by theirs, places on a pixel evenly in φ and cos θ: by
/// solid angle. So the density of a direction is its radiance over that of all directions together.
double Environment::densityOf(Pixel pixel) const {
  return static_cast<double>(radiance_(pixel.x, pixel.y)) / row_sums_.back();
}

Environment::Seen Environment::seen(Vec3d direction) const {
  Seen seen;
  if (!radiance_.empty()) {
    const Pixel pixel = pixelAt(direction);
    seen.picture = static_cast<double>(radiance_(pixel.x, pixel.y));
    seen.picture_density = densityOf(pixel);
  }
  if (hasSun()) {
    const Vec3d apart = direction - sun_.towards;
    if (0.5 * dot(apart, apart) <= kSunCap) {
      // E = L ∫ cos dω over the cap, π sin²ρ = π cap (2 − cap)
      seen.sun = sun_.irradiance / (kPi * kSunCap * (2.0 - kSunCap));
      seen.sun_density = 1.0 / (2.0 * kPi * kSunCap);
    }
  }
  return seen;
}

double Environment::radiance(Vec3d direction) const {
  const Seen all = seen(direction);
  return all.picture + all.sun;
}

Environment::Drawn Environment::drawPicture(double u, double v) const {
  const auto w = static_cast<std::size_t>(radiance_.width()),
             h = static_cast<std::size_t>(radiance_.height());
  const Place row = invert(row_sums_.data(), h, u);
  const Place column = invert(pixel_sums_.data() + row.index * (w + 1), w, v);
  const double above = std::cos(kPi * static_cast<double>(row.index) / static_cast<double>(h));
  const double below = std::cos(kPi * static_cast<double>(row.index + 1) / static_cast<double>(h));
  const double cosine = above + row.within * (below - above),
               sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  const double phi =
      ((static_cast<double>(column.index) + column.within) / static_cast<double>(w) - 0.5) * 2.0 * kPi;
  const Pixel pixel{static_cast<int>(column.index), static_cast<int>(row.index)};
  return {up_ * cosine + (ahead_ * std::cos(phi) + side_ * std::sin(phi)) * sine,
          static_cast<double>(radiance_(pixel.x, pixel.y)), densityOf(pixel)};
}

Environment::Drawn Environment::drawSun(double u, double v) const {
  const Vec3d n = sun_.towards;
  const double down = u * kSunCap, sine = std::sqrt(down * (2.0 - down)), phi = 2.0 * kPi * v;
  const double sign = std::copysign(1.0, n.z), a = -1.0 / (sign + n.z), b = n.x * n.y * a;
  const Vec3d x{1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x}, y{b, sign + n.y * n.y * a, -n.y};
  const Vec3d direction = n * (1.0 - down) + x * (sine * std::cos(phi)) + y * (sine * std::sin(phi));
  return {direction, sun_.irradiance / (kPi * kSunCap * (2.0 - kSunCap)), 1.0 / (2.0 * kPi * kSunCap)};
}

}  // namespace toftwin::sim
