// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/point_cloud.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/plot.h"

namespace toftwin::compare {
namespace {

using Points = std::vector<std::array<float, 3>>;

constexpr std::size_t kMostPoints = 4000;   ///< of each camera: 32 kB of a page
constexpr double kYaw = 0.5, kPitch = 0.3;  ///< of the still, rad; where the script begins, too
constexpr int kWidth = 720, kHeight = 420;

std::array<float, 3> middleOf(const Points& points) {
  std::array<float, 3> sum{};
  for (const auto& p : points) {
    for (std::size_t k = 0; k < 3; ++k) sum[k] += p[k] / static_cast<float>(points.size());
  }
  return sum;
}

/// The distance from the middle within which nearly all points are.
double reachOf(const Points& points, const std::array<float, 3>& middle) {
  std::vector<double> away;
  for (const auto& p : points)
    away.push_back(std::hypot(p[0] - middle[0], std::hypot(p[1] - middle[1], p[2] - middle[2])));
  return std::max(1e-3, quantile(std::move(away), 0.98));
}

/// Millimetres from the middle as 16 bits each, little end first.
std::string packed(const Points& points, const std::array<float, 3>& middle) {
  std::vector<unsigned char> bytes;
  for (const auto& p : points) {
    for (std::size_t k = 0; k < 3; ++k) {
      const float mm = std::clamp(1e3F * (p[k] - middle[k]), -32767.0F, 32767.0F);
      const auto word = static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(mm)));
      bytes.push_back(static_cast<unsigned char>(word & 0xFF)),
          bytes.push_back(static_cast<unsigned char>(word >> 8));
    }
  }
  return base64(bytes);
}

/// Small squares, one path for each camera.
std::string still(const Points& points, const std::array<float, 3>& middle, double scale, const char* ink) {
  std::string path;
  for (const auto& p : points) {
    const double x = p[0] - middle[0], y = p[1] - middle[1], z = p[2] - middle[2];
    const double across = x * std::cos(kYaw) + z * std::sin(kYaw),
                 ahead = z * std::cos(kYaw) - x * std::sin(kYaw);
    const double down = y * std::cos(kPitch) + ahead * std::sin(kPitch);
    path +=
        fmt::format("M{:.0f} {:.0f}h2v2h-2z", 0.5 * kWidth + scale * across, 0.5 * kHeight + scale * down);
  }
  return fmt::format("<path class='dots {}' d='{}'/>", ink, path);
}

Points everyNth(const Points& points, std::size_t stride) {
  Points few;
  for (std::size_t i = 0; i < points.size(); i += stride) few.push_back(points[i]);
  return few;
}

}  // namespace

PointCloud pointCloudOf(const std::string& name, const PoseComparison& pose) {
  PointCloud cloud{.caption = fmt::format("{}: what A and B see in space, in A's frame of reference.", name)};
  const Image<float> difference = comparedDifference_mm(pose);
  if (pose.camera.width != difference.width() || pose.camera.height != difference.height()) return cloud;
  const auto stride = std::max(
      1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(difference.size()) / kMostPoints))));
  for (int y = stride / 2; y < difference.height(); y += stride) {
    for (int x = stride / 2; x < difference.width(); x += stride) {
      if (!std::isfinite(difference(x, y))) continue;
      const Vec3d ray = rayThroughPixel(pose.camera, x, y).v;
      const double a_m = 1e-3 * static_cast<double>(pose.range_a_mm(x, y)),
                   b_m = a_m + 1e-3 * static_cast<double>(difference(x, y));
      const auto at = [&](double range_m) {
        return std::array{static_cast<float>(range_m * ray.x), static_cast<float>(range_m * ray.y),
                          static_cast<float>(range_m * ray.z)};
      };
      cloud.a.push_back(at(a_m)), cloud.b.push_back(at(b_m));
    }
  }
  return cloud;
}

std::string html(const PointCloud& cloud) {
  if (cloud.a.empty()) return "";
  const auto middle = middleOf(cloud.a);
  const double reach = reachOf(cloud.a, middle), scale = 0.48 * kHeight / reach;
  const std::size_t thin = 1 + cloud.a.size() / 1000;
  return fmt::format(
      "<figure class='cloud alone' data-a='{}' data-b='{}' data-reach='{:.0f}'><div class='plot'><svg viewBox='0 0 "
      "{} {}' "
      "role='img' aria-label='{}'>{}{}</svg></div><div class='legend'><label class='inkA'><input "
      "type='checkbox' checked "
      "data-set='0'>A</label><label class='inkB'><input type='checkbox' checked data-set='1'>B</label><span "
      "class='hint'>drag or use the arrow keys to turn; wheel, + and − to "
      "zoom</span></div><figcaption>{}</figcaption></figure>",
      packed(cloud.a, middle), packed(cloud.b, middle), 1e3 * reach, kWidth, kHeight, escaped(cloud.caption),
      still(everyNth(cloud.a, thin), middle, scale, "measured"),
      still(everyNth(cloud.b, thin), middle, scale, "simulated"), escaped(cloud.caption));
}

std::string cloudScript() {
  return R"js(<script>
document.querySelectorAll('figure.cloud').forEach(figure => {
  const decode = text => { const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
    const view = new DataView(bytes.buffer), points = new Int16Array(bytes.length / 2);
    for (let i = 0; i < points.length; i++) points[i] = view.getInt16(2 * i, true);
    return points; };
  const sets = [{points: decode(figure.dataset.a), ink: '--measured'}, {points: decode(figure.dataset.b), ink: '--simulated'}];
  const still = figure.querySelector('svg'), canvas = document.createElement('canvas'), pen = canvas.getContext('2d');
  const boxes = [...figure.querySelectorAll('input')], reach = Number(figure.dataset.reach);
  let yaw = 0.5, pitch = 0.3, zoom = 1, drag = null;
  canvas.tabIndex = 0;
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', still.getAttribute('aria-label'));
  const draw = () => {
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = width * ratio; canvas.height = height * ratio;
    pen.scale(ratio, ratio);
    const scale = 0.48 * Math.min(height, width) / reach * zoom, style = getComputedStyle(document.documentElement);
    const cy = Math.cos(yaw), sy = Math.sin(yaw), cp = Math.cos(pitch), sp = Math.sin(pitch);
    sets.forEach((set, number) => {
      if (!boxes[number].checked) return;
      pen.fillStyle = style.getPropertyValue(set.ink);
      for (let i = 0; i < set.points.length; i += 3) {
        const x = set.points[i], y = set.points[i + 1], z = set.points[i + 2], ahead = z * cy - x * sy;
        pen.fillRect(width / 2 + scale * (x * cy + z * sy), height / 2 + scale * (y * cp + ahead * sp), 1.5, 1.5);
      }
    });
  };
  const turn = (dx, dy) => { yaw += dx; pitch = Math.max(-1.6, Math.min(1.6, pitch + dy)); draw(); };
  const zoomBy = factor => { zoom = Math.max(0.3, Math.min(20, zoom * factor)); draw(); };
  canvas.addEventListener('pointerdown', e => { drag = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener('pointermove', e => { if (!drag) return;
    turn((e.clientX - drag[0]) / 150, (drag[1] - e.clientY) / 150); drag = [e.clientX, e.clientY]; });
  canvas.addEventListener('pointerup', () => { drag = null; });
  canvas.addEventListener('wheel', e => { e.preventDefault(); zoomBy(Math.exp(-e.deltaY / 500)); }, {passive: false});
  canvas.addEventListener('keydown', e => {
    const by = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[e.key];
    if (by) turn(...by); else if (e.key === '+') zoomBy(1.2); else if (e.key === '-') zoomBy(1 / 1.2); else return;
    e.preventDefault(); });
  boxes.forEach(box => box.addEventListener('change', draw));
  still.replaceWith(canvas);
  figure.classList.add('turns');
  window.addEventListener('resize', draw);
  matchMedia('(prefers-color-scheme:dark)').addEventListener('change', draw);
  draw();
});
// What is closed on the screen is open on paper.
window.addEventListener('beforeprint', () => document.querySelectorAll('details').forEach(one => { one.open = true; }));
</script>)js";
}

}  // namespace toftwin::compare
