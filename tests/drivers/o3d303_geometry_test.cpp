// SPDX-License-Identifier: Apache-2.0
// Where a frame's points lie, from its bytes alone: decoded here as the vendor's clients do it, beside our
// writer.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "drivers/o3d303/wire/extrinsics.h"
#include "drivers/o3d303/wire/frame_writer.h"
#include "drivers/o3d303/wire/pcic.h"

namespace toftwin::o3d303 {
namespace {

/// Four pixels by hand: straight ahead, right, down and invalid. Each ray has length 1 as decimals go.
constexpr std::array<float, 12> kRays{0.0F, 0.0F,  1.0F,  0.6F, 0.0F, 0.8F,
                                      0.0F, 0.28F, 0.96F, 0.0F, 0.6F, 0.8F};
constexpr std::array<std::uint16_t, 4> kDistance_mm{1000, 2000, 2500, 3000};
constexpr std::array<std::uint16_t, 4> kAmplitude{100, 200, 300, 400};
constexpr std::array<std::uint8_t, 4> kConfidence{0x30, 0x30, 0x30, 0x31};  // bit 0: invalid

/// The bytes of a message with all that a client needs to make points of it.
Bytes messageWith(const ExtrinsicCalibration& extrinsics, std::span<const float> unit_vectors) {
  CameraFrame frame;
  frame.width = frame.height = 2;
  frame.distance_mm = kDistance_mm;
  frame.amplitude = frame.raw_amplitude = kAmplitude;
  frame.confidence = kConfidence;
  frame.unit_vectors = unit_vectors;
  frame.extrinsics = extrinsics;
  const auto content = writeFrameContent(
      schemaOf({kDistanceBlob, kXBlob, kYBlob, kZBlob, kUnitVectorsBlob, kExtrinsicsBlob, kConfidenceBlob}),
      frame);
  EXPECT_TRUE(content.ok());
  return encodePcic("0000", std::span<const std::byte>{*content});
}

template <class T>
T littleEndianAt(const Bytes& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// As a client walks: 16 bytes of ticket and length, the inner ticket and "star", then from chunk to chunk.
template <class T>
std::vector<T> elementsOf(const Bytes& message, std::uint32_t type, std::size_t count) {
  constexpr std::size_t kFirstChunk = 16 + 8;
  std::size_t at = kFirstChunk;
  while (littleEndianAt<std::uint32_t>(message, at) != type)
    at += littleEndianAt<std::uint32_t>(message, at + 4);
  at += littleEndianAt<std::uint32_t>(message, at + 8);
  std::vector<T> elements(count);
  for (std::size_t i = 0; i < count; ++i) elements[i] = littleEndianAt<T>(message, at + i * sizeof(T));
  return elements;
}

using Point = std::array<int, 3>;

/// The client's cloud: x forward, y left, z up.
std::vector<Point> cloudOf(const Bytes& message) {
  const auto x = elementsOf<std::int16_t>(message, 200, 4), y = elementsOf<std::int16_t>(message, 201, 4),
             z = elementsOf<std::int16_t>(message, 202, 4);
  const auto confidence = elementsOf<std::uint8_t>(message, 300, 4);
  std::vector<Point> cloud(4);
  for (std::size_t i = 0; i < 4; ++i) {
    if ((confidence[i] & 1U) == 0) cloud[i] = {z[i], -x[i], -y[i]};
  }
  return cloud;
}

/// What the client computes by itself from distances, unit vectors and translation.
std::vector<Point> computedCloudOf(const Bytes& message) {
  const auto e = elementsOf<float>(message, 223, 12), t = elementsOf<float>(message, 400, 6);
  const auto d = elementsOf<std::uint16_t>(message, 100, 4);
  const auto confidence = elementsOf<std::uint8_t>(message, 300, 4);
  std::vector<Point> cloud(4);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = [&](std::size_t axis) {
      return static_cast<int>(std::lround(e[3 * i + axis] * static_cast<float>(d[i]) + t[axis]));
    };
    if ((confidence[i] & 1U) == 0) cloud[i] = {p(2), -p(0), -p(1)};
  }
  return cloud;
}

TEST(O3d303Geometry, XIsRightYDownAndZForwardOnTheWire) {
  const Bytes message = messageWith({}, kRays);
  EXPECT_EQ(elementsOf<std::int16_t>(message, 200, 4), (std::vector<std::int16_t>{0, 1200, 0, 0}));
  EXPECT_EQ(elementsOf<std::int16_t>(message, 201, 4), (std::vector<std::int16_t>{0, 0, 700, 0}));
  EXPECT_EQ(elementsOf<std::int16_t>(message, 202, 4), (std::vector<std::int16_t>{1000, 1600, 2400, 0}));
}

TEST(O3d303Geometry, AClientsCloudIsForwardLeftUp) {
  const Bytes message = messageWith({}, kRays);
  EXPECT_EQ(cloudOf(message),
            (std::vector<Point>{{1000, 0, 0}, {1600, -1200, 0}, {2400, 0, -700}, {0, 0, 0}}));
}

/// A quarter turn about the optical axis, Rz(90 degrees): what was right is down, what was down is left. Then
/// the optics are 100 mm right of, 20 mm above and 5 mm before the origin.
TEST(O3d303Geometry, RotationComesBeforeTranslation) {
  const ExtrinsicCalibration turned{100.0F, -20.0F, 5.0F, 0.0F, 0.0F, 90.0F};
  const Bytes message = messageWith(turned, unitVectorsFrom(kRays, turned));
  EXPECT_EQ(elementsOf<std::int16_t>(message, 200, 4), (std::vector<std::int16_t>{100, 100, -600, 0}));
  EXPECT_EQ(elementsOf<std::int16_t>(message, 201, 4), (std::vector<std::int16_t>{-20, 1180, -20, 0}));
  EXPECT_EQ(elementsOf<std::int16_t>(message, 202, 4), (std::vector<std::int16_t>{1005, 1605, 2405, 0}));
}

/// Rx(90) Ry(90) takes ahead, z, to right, x; down, y, to ahead, z; right, x, to down, y. Another order of
/// the angles, or another sign, takes them elsewhere.
TEST(O3d303Geometry, TheRotationIsAboutXThenYThenZOfTheTurnedAxes) {
  const std::vector<float> turned = unitVectorsFrom(kRays, {0, 0, 0, 90.0F, 90.0F, 0});
  const std::array<float, 9> expected{1.0F, 0.0F, 0.0F, 0.8F, 0.6F, 0.0F, 0.96F, 0.0F, 0.28F};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(turned[i], expected[i], 1e-6) << i;
}

TEST(O3d303Geometry, WhatAClientComputesFromUnitVectorsIsWhatTheCameraSays) {
  const ExtrinsicCalibration anywhere{42.1F, 44.2F, 46.3F, 5.6F, 7.8F, 9.1F};
  const Bytes message = messageWith(anywhere, unitVectorsFrom(kRays, anywhere));
  const auto said = cloudOf(message), computed = computedCloudOf(message);
  EXPECT_EQ(said, computed);
}

TEST(O3d303Geometry, RaysComeBackFromUnitVectors) {
  const ExtrinsicCalibration anywhere{42.1F, 44.2F, 46.3F, 5.6F, 7.8F, 9.1F};
  const auto rays = raysFrom(unitVectorsFrom(kRays, anywhere), anywhere);
  for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_NEAR(rays[i], kRays[i], 1e-6) << i;
}

}  // namespace
}  // namespace toftwin::o3d303
