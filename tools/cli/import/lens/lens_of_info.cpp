// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/lens/lens_of_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <toftwin/nan.h>

#include "drivers/ray_fit.h"

namespace toftwin::cli {
namespace {

Error wrong(std::string_view what) { return {Error::Code::InvalidArgument, fmt::format("camera info: {}", what)}; }

/// x and y of the ray at z = 1; NaN where there is none.
struct Slope {
  double x, y;
};

/// Undoes OpenCV's rational model [calib3d: (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)] by fixed-point steps.
Slope undistortRational(Slope seen, const std::vector<double>& d) {
  Slope s = seen;
  for (int step = 0; step < 200; ++step) {
    const double r2 = s.x * s.x + s.y * s.y;
    const double radial = (1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]))) / (1 + r2 * (d[5] + r2 * (d[6] + r2 * d[7])));
    const double dx = 2 * d[2] * s.x * s.y + d[3] * (r2 + 2 * s.x * s.x), dy = d[2] * (r2 + 2 * s.y * s.y) + 2 * d[3] * s.x * s.y;
    const Slope next{(seen.x - dx) / radial, (seen.y - dy) / radial};
    const bool is_there = std::hypot(next.x - s.x, next.y - s.y) < 1e-12;
    s = next;
    if (is_there) return s;
  }
  return {kNaN, kNaN};
}

/// Undoes the fisheye model: θ_d = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸), by Newton's method.
Slope undistortEquidistant(Slope seen, const std::vector<double>& d) {
  const double bent = std::hypot(seen.x, seen.y);
  if (bent < 1e-12) return seen;
  double angle = bent;
  for (int step = 0; step < 50; ++step) {
    const double a2 = angle * angle;
    const double value = angle * (1 + a2 * (d[0] + a2 * (d[1] + a2 * (d[2] + a2 * d[3])))) - bent;
    const double slope = 1 + a2 * (3 * d[0] + a2 * (5 * d[1] + a2 * (7 * d[2] + a2 * 9 * d[3])));
    angle -= value / slope;
    if (std::abs(value) < 1e-13) break;
  }
  if (!(angle > 0.0 && angle < 1.5)) return {kNaN, kNaN};
  return {seen.x * std::tan(angle) / bent, seen.y * std::tan(angle) / bent};
}

/// Fits our own model to the rays of another one.
template <class Undistort>
Result<FoundLens> fit(const CameraInfo& pinhole, const std::string& model, const Undistort& undistort) {
  std::vector<float> rays;
  rays.reserve(3 * static_cast<std::size_t>(pinhole.width) * static_cast<std::size_t>(pinhole.height));
  for (int v = 0; v < pinhole.height; ++v) {
    for (int u = 0; u < pinhole.width; ++u) {
      const Slope s = undistort({(u - pinhole.cx) / pinhole.fx, (v - pinhole.cy) / pinhole.fy});
      const bool is_ray = std::isfinite(s.x) && std::isfinite(s.y);
      for (const double e : {s.x, s.y, 1.0}) rays.push_back(is_ray ? static_cast<float>(e) : 0.0f);
    }
  }
  const auto fitted = drivers::fitCamera(pinhole.width, pinhole.height, rays);
  if (!fitted) return fitted.error();
  return FoundLens{fitted->camera, fmt::format("the lens is of the model {}, which five terms fit to {:.3f} px (RMS)", model, fitted->rms_px)};
}

Result<CameraInfo> pinholeOf(const ros::CameraInfo& info, bool is_rectified) {
  constexpr std::uint32_t kMostSide = 16'384;
  CameraInfo camera;
  camera.fx = is_rectified ? info.p[0] : info.k[0];
  camera.fy = is_rectified ? info.p[5] : info.k[4];
  camera.cx = is_rectified ? info.p[2] : info.k[2];
  camera.cy = is_rectified ? info.p[6] : info.k[5];
  const bool is_finite = std::ranges::all_of(std::array{camera.fx, camera.fy, camera.cx, camera.cy}, [](double n) { return std::isfinite(n) && std::abs(n) < 1e7; });
  if (!is_finite || !(camera.fx > 0.0) || !(camera.fy > 0.0)) return wrong("the camera is not calibrated: it has no focal length");
  const bool has_region = info.roi.width != 0 && info.roi.height != 0;
  const std::uint32_t width = has_region ? info.roi.width : info.width, height = has_region ? info.roi.height : info.height;
  if (width > kMostSide || height > kMostSide || info.roi.x_offset > kMostSide || info.roi.y_offset > kMostSide)
    return wrong(fmt::format("{} x {} pixels cannot be", width, height));
  // Pixels of a binned image are as large as several, and their centres lie between those.
  const double bin_x = std::clamp(info.binning_x, 1u, 64u), bin_y = std::clamp(info.binning_y, 1u, 64u);
  camera.cx = (camera.cx - info.roi.x_offset + 0.5) / bin_x - 0.5;
  camera.cy = (camera.cy - info.roi.y_offset + 0.5) / bin_y - 0.5;
  camera.fx /= bin_x;
  camera.fy /= bin_y;
  camera.width = static_cast<int>(width / static_cast<std::uint32_t>(bin_x));
  camera.height = static_cast<int>(height / static_cast<std::uint32_t>(bin_y));
  return camera;
}

}  // namespace

Result<FoundLens> lensOf(const ros::CameraInfo& info, bool is_rectified) {
  auto camera = pinholeOf(info, is_rectified);
  if (!camera) return camera.error();
  const bool is_bent = std::ranges::any_of(info.d, [](double term) { return term != 0.0; });
  if (is_rectified || !is_bent) return FoundLens{*camera, {}};
  if (info.d.size() > 14 || std::ranges::any_of(info.d, [](double term) { return !std::isfinite(term) || std::abs(term) > 1e4; }))
    return wrong("its distortion cannot be");
  std::vector<double> d = info.d;
  d.resize(14);
  const std::string& model = info.distortion_model;
  if (model == "equidistant" || model == "fisheye" || model == "kannala_brandt") return fit(*camera, model, [&](Slope s) { return undistortEquidistant(s, d); });
  if (!model.empty() && model != "plumb_bob" && model != "rational_polynomial") return wrong(fmt::format("the model \"{}\" is not known; plumb_bob, rational_polynomial and equidistant are", model.substr(0, 40)));
  const auto isZero = [](double term) { return term == 0.0; };
  if (!std::all_of(d.begin() + 8, d.end(), isZero)) return wrong("terms of a thin prism or a tilted sensor are not known");
  if (!std::all_of(d.begin() + 5, d.begin() + 8, isZero)) return fit(*camera, "rational_polynomial", [&](Slope s) { return undistortRational(s, d); });
  std::copy_n(d.begin(), 5, camera->distortion.begin());
  return FoundLens{*camera, {}};
}

}  // namespace toftwin::cli
