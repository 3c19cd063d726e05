// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "protocol/ros/cdr.h"
#include "protocol/ros/of_frame.h"
#include "tests/record/record_testing.h"
#include "tools/cli/export/frame_sink.h"
#include "tools/cli/import/import_source.h"

namespace toftwin::cli {

/// A frame with planes of every type, a lens that bends, a pose and a time; some pixels are invalid.
inline Frame frameOfAll(std::uint64_t number = 0) {
  constexpr int kWidth = 7, kHeight = 5;
  constexpr std::size_t kPixels = kWidth * kHeight;
  Image<float> range_m{kWidth, kHeight}, amplitude{kWidth, kHeight};
  Image<std::uint8_t> flags{kWidth, kHeight};
  Image<std::uint16_t> ambient{kWidth, kHeight};
  for (std::size_t i = 0; i < kPixels; ++i) {
    range_m[i] = i % 6 == 2 ? std::numeric_limits<float>::quiet_NaN() : 0.731f + 0.0371f * static_cast<float>(i + number);
    amplitude[i] = 3.3f * static_cast<float>(i) - 1.7f;
    flags[i] = static_cast<std::uint8_t>(i);
    ambient[i] = static_cast<std::uint16_t>(1'999 * i);
  }
  std::vector<std::uint8_t> colors(3 * kPixels);
  std::vector<float> normals(3 * kPixels);
  for (std::size_t i = 0; i < 3 * kPixels; ++i) {
    colors[i] = static_cast<std::uint8_t>(2 * i);
    normals[i] = 0.01f * static_cast<float>(i);
  }
  Frame frame;
  frame.source = "front";
  frame.sequence = number;
  frame.camera = {kWidth, kHeight, 6.1, 6.3, 3.2, 1.9, {0.02, -0.03, 0.001, -0.002, 0.004}, ""};
  frame.moment.exposures = {{.start = {1'700'000'000'123'456'789 + static_cast<std::int64_t>(number) * 33'000'000}, .duration = {}, .modulation = {}}};
  frame.moment.received.ns = frame.moment.exposures[0].start.ns + 5'000'000;
  frame.moment.world_from_camera = Transform<World, Camera>{{0.6, 0.0, 0.8, 0.0}, {1.25, -0.5, 0.1 * static_cast<double>(number)}};
  frame.planes = {toPlane(PlaneKind::Range, std::move(range_m)), toPlane(PlaneKind::Amplitude, std::move(amplitude)),
                  toPlane(PlaneKind::Flags, std::move(flags)), toPlane(PlaneKind::Ambient, std::move(ambient))};
  frame.planes.push_back({PlaneKind::Color, ElementType::U8, kWidth, kHeight, 3, Buffer::adopt(std::move(colors))});
  frame.planes.push_back({PlaneKind::TruthNormal, ElementType::F32, kWidth, kHeight, 3, Buffer::adopt(std::move(normals))});
  return frame;
}

inline void writeFrames(const std::filesystem::path& file, const std::string& format, int frames) {
  ExportOptions how;
  how.format = format;
  auto sink = openSink(file, how, {});
  ASSERT_TRUE(sink) << sink.error().message;
  for (int i = 0; i < frames; ++i) {
    const auto added = (*sink)->add(frameOfAll(static_cast<std::uint64_t>(i)));
    ASSERT_TRUE(added) << added.error().message;
  }
  const auto finished = (*sink)->finish();
  ASSERT_TRUE(finished) << finished.error().message;
}

inline std::vector<ImportedFrame> framesIn(const std::filesystem::path& what, const ImportOptions& options = {}, std::vector<std::string>* notes = nullptr) {
  std::vector<ImportedFrame> frames;
  auto source = openImport(what, options);
  EXPECT_TRUE(source) << source.error().message;
  if (!source) return frames;
  for (auto frame = (*source)->next(); frame; frame = (*source)->next()) frames.push_back(*std::move(frame));
  if (notes != nullptr) *notes = (*source)->notes();
  return frames;
}

inline const Plane* find(const ImportedFrame& frame, PlaneKind kind) {
  const auto found = std::ranges::find(frame.planes, kind, &Plane::kind);
  return found == frame.planes.end() ? nullptr : &*found;
}

/// All that a frame has came, bit for bit.
inline void expectAll(const ImportedFrame& frame, const Frame& expected) {
  for (const Plane& plane : expected.planes) {
    const Plane* found = find(frame, plane.kind);
    ASSERT_NE(found, nullptr) << static_cast<int>(plane.kind);
    EXPECT_EQ(found->type, plane.type);
    EXPECT_EQ(found->channels, plane.channels);
    EXPECT_TRUE(std::ranges::equal(found->data.bytes(), plane.data.bytes())) << static_cast<int>(plane.kind);
  }
  EXPECT_EQ(frame.world_from_camera, expected.moment.world_from_camera);
  EXPECT_EQ(frame.lens, expected.camera);
  EXPECT_EQ(frame.time_ns, expected.moment.exposures[0].start.ns);
  EXPECT_EQ(frame.received_ns, expected.moment.received.ns);
  EXPECT_EQ(frame.source, "front");
}

/// The messages of a depth image of 2 × 1 pixels, 1.5 m and invalid, and of its lens.
inline ros::Header headerForBag(std::uint32_t nanosec) { return {{1'700'000'000, nanosec}, "cam_optical"}; }
inline ros::Image depthForBag(std::uint32_t nanosec) {
  static constexpr std::uint16_t kCounts[]{1'500, 0};
  ros::Image image;
  image.header = headerForBag(nanosec);
  image.width = 2;
  image.height = 1;
  image.encoding = "16UC1";
  image.step = 4;
  image.data = std::as_bytes(std::span{kCounts});
  return image;
}
inline ros::CameraInfo infoForBag() {
  auto info = ros::infoOf({2, 1, 500.0, 501.0, 0.5, 0.25, {0.1, -0.2, 0.001, 0.002, 0.03}, ""});
  info.header = headerForBag(0);
  return info;
}
inline void expectDepthForBag(const std::vector<ImportedFrame>& frames, std::size_t count) {
  ASSERT_EQ(frames.size(), count);
  const Plane* depth = find(frames[0], PlaneKind::Depth);
  ASSERT_NE(depth, nullptr);
  EXPECT_EQ(depth->as<float>()[0], 1.5f);
  EXPECT_TRUE(std::isnan(depth->as<float>()[1]));
  ASSERT_TRUE(frames[0].lens);
  EXPECT_EQ(frames[0].lens->fy, 501.0);
  EXPECT_EQ(frames[0].source, "cam");
}

}  // namespace toftwin::cli
