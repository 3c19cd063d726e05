// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "calib/compare/pose_comparison.h"

/// Cameras before a tilted wall, and what their frames are compared to.
namespace toftwin::compare {

inline constexpr int kWidth = 64, kHeight = 48, kFrames = 12;
inline constexpr double kSigma_m = 0.004;

inline CameraInfo camera(int width = kWidth, int height = kHeight, double focal = 60.0) {
  return {.width = width,
          .height = height,
          .fx = focal,
          .fy = focal,
          .cx = width / 2.0 - 0.5,
          .cy = height / 2.0 - 0.5,
          .distortion = {},
          .calibration_id = {}};
}

/// The range along each ray to what stands at depth z(x, y) in the camera's frame, plus noise.
inline Frame frame(const CameraInfo& info, const std::function<double(Vec3d)>& range_of_ray, double sigma,
                   std::mt19937_64& random, PlaneKind kind = PlaneKind::Range) {
  std::normal_distribution<double> noise{0.0, 1.0};
  Image<float> values(info.width, info.height), amplitude(info.width, info.height);
  for (int y = 0; y < info.height; ++y) {
    for (int x = 0; x < info.width; ++x) {
      const Vec3d ray = rayThroughPixel(info, x, y).v;
      const double range = range_of_ray(ray) + (sigma > 0.0 ? sigma * noise(random) : 0.0);
      values(x, y) = static_cast<float>(kind == PlaneKind::Depth ? range * ray.z : range);
      amplitude(x, y) = static_cast<float>(1000.0 / (range * range));
    }
  }
  Frame result;
  result.source = "synthetic";
  result.camera = info;
  result.moment.world_from_camera = Transform<World, Camera>{};
  result.planes.push_back(toPlane(kind, std::move(values)));
  result.planes.push_back(toPlane(PlaneKind::Amplitude, std::move(amplitude)));
  return result;
}

inline double tiltedWall(Vec3d ray) { return 1.5 / (ray.z + 0.3 * ray.x); }

inline Stack stackOf(const CameraInfo& info, const std::function<double(Vec3d)>& scene, double sigma,
                     unsigned seed) {
  std::mt19937_64 random{seed};
  Stack stack;
  for (int i = 0; i < kFrames; ++i) EXPECT_TRUE(stack.add(frame(info, scene, sigma, random)).ok());
  return stack;
}

/// Two cameras at a pose, the second one off by so much.
inline PoseComparison poseOffBy(double bias_m, double x_m, unsigned seed) {
  Stack a, b;
  std::mt19937_64 random{seed};
  for (int i = 0; i < kFrames; ++i) {
    Frame fa = frame(camera(), tiltedWall, kSigma_m, random);
    Frame fb = frame(
        camera(), [&](Vec3d ray) { return tiltedWall(ray) + bias_m; }, kSigma_m, random);
    fa.moment.world_from_camera->translation_m.x = x_m;
    fb.moment.world_from_camera->translation_m.x = x_m;
    EXPECT_TRUE(a.add(fa).ok() && b.add(fb).ok());
  }
  return *comparePose(a, b);
}

/// Of one pose's mean: the noise of all its pixels, in mm.
inline const double kMeanError_mm = 1e3 * kSigma_m * std::sqrt(2.0 / kFrames / (kWidth * kHeight));

}  // namespace toftwin::compare
