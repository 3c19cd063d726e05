// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include <toftwin/image.h>

#include "calib/intrinsics/bundle.h"
#include "calib/intrinsics/seed.h"

/// Boards as a camera that is known exactly would see them.
namespace toftwin::intrinsics::testing {

struct Truth {
  LensParameters lens{};
  ImageSize size{};
};
/// Near the Kinect v2's infrared camera.
inline Truth kinectLike() {
  return {.lens = {361.0, 362.0, 251.5, 204.9, 0.09, -0.25, 0.001, -0.0005, 0.08}, .size = {512, 424}};
}

/// Of a quarter of the pixels, so that images are made fast, and without k3.
inline Truth smallCamera() { return {.lens = {180.0, 181.0, 127.5, 104.9, 0.08, -0.1}, .size = {256, 212}}; }

inline Target checkerboard() { return *targetOf("8x5", 32_mm); }

/// A place of the board that a person would choose: all of it in the image, tilted by up to 50 degrees.
BoardPose drawPose(const Truth& truth, const Surface& surface, std::mt19937_64& random);

/// The corners of that board in pixels, with normal errors of `noise_px` in each coordinate.
Sighting sightingAt(const Truth& truth, const Surface& surface, const BoardPose& pose, double noise_px,
                    std::mt19937_64& random);

std::vector<Sighting> drawViews(const Truth& truth, const Surface& surface, std::size_t count, double noise_px,
                                std::mt19937_64& random);

/// How an image is made of it.
struct Exposure {
  double bright = 180.0, dark = 40.0;
  double blur_px = 0.6;       ///< standard deviation
  double noise = 2.0;         ///< standard deviation, counts
  double most = 255.0;        ///< cut there and rounded
  double shading = 0.3;       ///< dimmer by this share at the corners of the image
};
/// What is printed at a place of a board's plane, mm from its first corner: 0 dark to 1 bright; less than 0:
/// no board.
using Print = std::function<double(double x_mm, double y_mm)>;
/// An image of the board: each pixel's rays are traced back through the distortion to the board's plane, 4 × 4 a
/// pixel, so edges and distortion are exact to 1/8 px before the blur; then blur, shading, noise, rounding.
Image<float> render(const Truth& truth, const Print& print, const BoardPose& pose, const Exposure& exposure,
                    std::mt19937_64& random);
/// Of a checkerboard.
Image<float> render(const Truth& truth, const Target& target, const BoardPose& pose, const Exposure& exposure,
                    std::mt19937_64& random);

}  // namespace toftwin::intrinsics::testing
