// SPDX-License-Identifier: Apache-2.0
#include "synthetic.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <toftwin/camera_info.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace toftwin::intrinsics::testing {
namespace {

double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>{low, high}(random);
}

bool isInside(const Truth& truth, const Surface& surface, const BoardPose& pose) {
  constexpr double kMargin_px = 6.0;
  for (std::size_t i = 0; i < checkerboard().corners(); ++i) {
    const Eigen::Vector3d at = pose.rotation * surface.at(i) + pose.translation_mm;
    if (at.z() < 150.0) return false;
    const Eigen::Vector2d pixel = project(truth.lens, at);
    if (pixel.x() < kMargin_px || pixel.y() < kMargin_px || pixel.x() > truth.size.width - kMargin_px ||
        pixel.y() > truth.size.height - kMargin_px) {
      return false;
    }
  }
  return true;
}

/// Bright or dark there, in squares from the first corner; -1 beyond the white rim.
double reflectanceAt(const Target& target, double x, double y) {
  constexpr double kRim = 0.4;  // squares
  const double right = target.columns, bottom = target.rows;
  if (x < -1.0 - kRim || y < -1.0 - kRim || x > right + kRim || y > bottom + kRim) return -1.0;
  if (x < -1.0 || y < -1.0 || x > right || y > bottom) return 1.0;
  const auto column = static_cast<long>(std::floor(x)), row = static_cast<long>(std::floor(y));
  return (column + row) % 2 == 0 ? 1.0 : 0.0;
}

Image<float> blurred(const Image<float>& image, double sigma) {
  const int reach = static_cast<int>(std::ceil(4.0 * sigma));
  std::vector<double> kernel;
  double sum = 0.0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
    sum += kernel.back();
  }
  const auto pass = [&](const Image<float>& from, int du, int dv) {
    Image<float> to{from.width(), from.height()};
    for (int v = 0; v < from.height(); ++v) {
      for (int u = 0; u < from.width(); ++u) {
        double value = 0.0;
        for (int i = -reach; i <= reach; ++i) {
          value += kernel[static_cast<std::size_t>(i + reach)] *
                   from(std::clamp(u + du * i, 0, from.width() - 1), std::clamp(v + dv * i, 0, from.height() - 1));
        }
        to(u, v) = static_cast<float>(value / sum);
      }
    }
    return to;
  };
  return pass(pass(image, 1, 0), 0, 1);
}

}  // namespace

BoardPose drawPose(const Truth& truth, const Surface& surface, std::mt19937_64& random) {
  const Target target = checkerboard();
  const Eigen::Vector3d middle{0.5 * (target.columns - 1) * target.square.in(millimetre),
                               0.5 * (target.rows - 1) * target.square.in(millimetre), 0.0};
  while (true) {
    const double tilt = uniform(random, 0.0, 50.0) * std::numbers::pi / 180.0;
    const double towards = uniform(random, 0.0, 2.0 * std::numbers::pi);
    const double roll = uniform(random, -0.4, 0.4);
    BoardPose pose;
    pose.rotation = (Eigen::AngleAxisd{tilt, Eigen::Vector3d{std::cos(towards), std::sin(towards), 0.0}} *
                     Eigen::AngleAxisd{roll, Eigen::Vector3d::UnitZ()})
                        .toRotationMatrix();
    const double z = uniform(random, 280.0, 700.0);
    const double u = uniform(random, 0.1, 0.9) * truth.size.width, v = uniform(random, 0.1, 0.9) * truth.size.height;
    pose.translation_mm = Eigen::Vector3d{z * (u - truth.lens[2]) / truth.lens[0],
                                          z * (v - truth.lens[3]) / truth.lens[1], z} -
                          pose.rotation * middle;
    if (isInside(truth, surface, pose)) return pose;
  }
}

Sighting sightingAt(const Truth& truth, const Surface& surface, const BoardPose& pose, double noise_px,
                    std::mt19937_64& random) {
  std::normal_distribution<double> normal{0.0, 1.0};
  Sighting sighting;
  sighting.square_px = 15.0;
  for (std::size_t i = 0; i < checkerboard().corners(); ++i) {
    const Eigen::Vector2d at = project(truth.lens, pose.rotation * surface.at(i) + pose.translation_mm);
    const double du = noise_px * normal(random), dv = noise_px * normal(random);
    sighting.corners.push_back({i, {at.x() + du, at.y() + dv}, noise_px});
  }
  return sighting;
}

std::vector<Sighting> drawViews(const Truth& truth, const Surface& surface, std::size_t count, double noise_px,
                                std::mt19937_64& random) {
  std::vector<Sighting> views;
  for (std::size_t i = 0; i < count; ++i) {
    views.push_back(sightingAt(truth, surface, drawPose(truth, surface, random), noise_px, random));
    views.back().name = "view " + std::to_string(i);
  }
  return views;
}

Image<float> render(const Truth& truth, const Target& target, const BoardPose& pose, const Exposure& exposure,
                    std::mt19937_64& random) {
  const double square = target.square.in(millimetre);
  return render(
      truth, [&](double x, double y) { return reflectanceAt(target, x / square, y / square); }, pose,
      exposure, random);
}

Image<float> render(const Truth& truth, const Print& print, const BoardPose& pose, const Exposure& exposure,
                    std::mt19937_64& random) {
  constexpr int kRays = 4;
  const CameraInfo camera{.width = truth.size.width,
                          .height = truth.size.height,
                          .fx = truth.lens[0],
                          .fy = truth.lens[1],
                          .cx = truth.lens[2],
                          .cy = truth.lens[3],
                          .distortion = {truth.lens[4], truth.lens[5], truth.lens[6], truth.lens[7], truth.lens[8]},
                          .calibration_id = {}};
  const Eigen::Matrix3d back = pose.rotation.transpose();
  const Eigen::Vector3d lens = -back * pose.translation_mm;  // where the lens is, on the board
  Image<float> image{camera.width, camera.height};
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      double sum = 0.0;
      for (int k = 0; k < kRays * kRays; ++k) {
        const Vec3d ray = rayThroughPixel(camera, u + (k % kRays + 0.5) / kRays - 0.5,
                                          v + (k / kRays + 0.5) / kRays - 0.5)
                              .v;
        const Eigen::Vector3d along = back * Eigen::Vector3d{ray.x, ray.y, ray.z};
        const double way = -lens.z() / along.z();
        const Eigen::Vector3d hit = lens + way * along;
        const double share = way > 0.0 ? print(hit.x(), hit.y()) : -1.0;
        sum += share < 0.0 ? 0.0 : exposure.dark + share * (exposure.bright - exposure.dark);
      }
      image(u, v) = static_cast<float>(sum / (kRays * kRays));
    }
  }
  image = blurred(image, exposure.blur_px);
  std::normal_distribution<double> normal{0.0, exposure.noise};
  const double reach = std::hypot(camera.width, camera.height) / 2.0;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const double from_middle = std::hypot(u - camera.width / 2.0, v - camera.height / 2.0) / reach;
      const double shade = 1.0 - exposure.shading * from_middle * from_middle;
      const double value = image(u, v) * shade + normal(random);
      image(u, v) = static_cast<float>(std::clamp(std::round(value), 0.0, exposure.most));
    }
  }
  return image;
}

}  // namespace toftwin::intrinsics::testing
