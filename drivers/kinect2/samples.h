// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstdint>
#include <span>
#include <vector>

#include <toftwin/camera_info.h>

#include "drivers/kinect2/assembly.h"
#include "drivers/kinect2/commands.h"
#include "sim/decode/decode.h"
#include "sim/images/samples.h"

/// From a frame's bytes, and what the factory measured, to what the decoder takes. Images are as the camera
/// sends them: left is right.
namespace toftwin::drivers::kinect2 {

/// A code of 11 bits as counts. The upper bit is the sign, the others the magnitude in steps that grow with
/// it: the inverse of what sim/effects/companding.h does. Minus zero means saturated.
///     128 codes of step 1, 128 of step 1, then 128 each of step 2, 4 … 64
///  [libfreenect2.cpp, lookup table of the depth processor]
constexpr std::uint32_t kSaturatedCode = 1024;
/// `kSaturatedCode` is given as the largest count.
float countsOf(std::uint32_t code);

/// Where image and bytes of a row lie for an image's row, upright: the upper half is stored from the top, the
/// lower half from the bottom, so that both end in the middle.
constexpr int storedRow(int y) { return y < kHeight / 2 ? y : kHeight / 2 + kHeight - 1 - y; }
/// The place of a pixel's code in its row, in codes of 11 bits, lowest bit first: every fourth pixel lies
/// beside the next.
constexpr int storedColumn(int x) { return x / 4 + (kWidth / 4) * (x % 4); }
/// Which step of the decoder's convention, Sₖ = B + A cos(φ − 2πk/3), each image of a frequency is. The
/// camera delays its reference the other way: cos(φ + 2πk/3).
constexpr int stepOfImage(int image) { return (3 - image % 3) % 3; }

/// The nine images as samples in counts at 80, 16 and 120 MHz, flagged where saturated. The outer columns
/// are 0: no known decoder uses them. Precondition: `images` has kUsedImages × kImageBytes bytes.
sim::Samples samplesOf(std::span<const std::byte> images);

/// The lens in our convention, where pixel (0, 0)'s centre is the origin; left is right.
CameraInfo cameraOf(const Lens& lens);
/// The camera that sees the same with left and right exchanged.
CameraInfo mirrored(const CameraInfo& camera);
/// e^(iφ₀) of each pixel, φ₀ = −0.000031 π × table: what DecodeSettings::pixel_turns takes.
std::vector<Image<std::complex<float>>> turnsOf(const PhaseTables& tables);
sim::DecodeRays raysOf(const CameraInfo& camera);

/// The same as those of the simulator's preset kinect_v2, for samples in counts.
sim::DecodeSettings decodeSettings();

}  // namespace toftwin::drivers::kinect2
