// SPDX-License-Identifier: Apache-2.0
// One truth: the same frame, read natively and as ROS 2's messages by a DDS of another maker.
#include <array>
#include <bit>
#include <cmath>

#include "ros2_testing.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using Policy = SubscribeOptions::Policy;

std::uint32_t bitsOf(float value) {
  return std::isnan(value) ? 0x7FC0'0000U : std::bit_cast<std::uint32_t>(value);
}

class Ros2Cross : public RunningRos2 {
 protected:
  /// Calls `compare(native, message)` for three messages of the reader.
  template <class Compare>
  void compare(dds::DataReader* reader, Compare compare_one) {
    auto native_client = client();
    auto stream = native_client.subscribe("cam", {.policy = Policy::Queue, .queue = 64});
    ASSERT_TRUE(stream.ok()) << stream.error().message;
    Natives natives{*std::move(stream), rosTimeOf};
    int compared = 0;
    for (int i = 0; i < 60 && compared < 3; ++i) {
      auto message = nextOf(reader);
      ASSERT_TRUE(message);
      CdrReader head{*message};
      const auto native = natives.at(readHeader(head));
      ASSERT_TRUE(native.ok()) << native.error().message;
      if (*native == nullptr) continue;
      CdrReader cdr{*std::move(message)};
      readHeader(cdr);
      ASSERT_NO_FATAL_FAILURE(compare_one(**native, cdr));
      EXPECT_LT(cdr.left(), 4U);  // messages are filled up to a multiple of 4 bytes
      ++compared;
    }
    EXPECT_EQ(compared, 3);
  }
};

struct ImageHead {
  std::uint32_t height, width;
  std::string encoding;
  std::uint8_t is_bigendian;
  std::uint32_t step, size;
};
ImageHead readImageHead(CdrReader& cdr) {
  ImageHead head{};
  head.height = cdr.number<std::uint32_t>();
  head.width = cdr.number<std::uint32_t>();
  head.encoding = cdr.text();
  head.is_bigendian = cdr.number<std::uint8_t>();
  head.step = cdr.number<std::uint32_t>();
  head.size = cdr.number<std::uint32_t>();
  return head;
}
void expectHead(const ImageHead& head, const Frame& native, const std::string& encoding,
                std::uint32_t bytes) {
  EXPECT_EQ(head.width, static_cast<std::uint32_t>(native.camera.width));
  EXPECT_EQ(head.height, static_cast<std::uint32_t>(native.camera.height));
  EXPECT_EQ(head.encoding, encoding);
  EXPECT_EQ(head.is_bigendian, 0);
  EXPECT_EQ(head.step, bytes * head.width);
  ASSERT_EQ(head.size, head.step * head.height);
}

/// What docs/facades/ros2.md says becomes of a range.
float depthOf(const Frame& frame, std::size_t i) {
  const auto width = static_cast<std::size_t>(frame.camera.width);
  const auto u = static_cast<double>(i % width), v = static_cast<double>(i / width);
  const float range_m = frame.find(PlaneKind::Range)->as<float>()[i];
  if (const Plane* depth = frame.find(PlaneKind::Depth)) return depth->as<float>()[i];
  return static_cast<float>(static_cast<double>(range_m) * rayThroughPixel(frame.camera, u, v).v.z);
}

TEST_F(Ros2Cross, DepthIsTheNativeOneBitForBitWithItsTimeStamp) {
  startRos2(kSmallSim);
  compare(program_->read("/cam/depth/image_raw", kImage), [](const Frame& native, CdrReader& cdr) {
    ASSERT_NO_FATAL_FAILURE(expectHead(readImageHead(cdr), native, "32FC1", 4));
    const auto got = cdr.numbers<std::uint8_t>(cdr.left());
    std::size_t valid = 0;
    for (std::size_t i = 0; i < got.size() / 4; ++i) {
      float metres = 0.0F;
      std::memcpy(&metres, got.data() + 4 * i, 4);
      ASSERT_EQ(bitsOf(metres), bitsOf(depthOf(native, i))) << i;
      valid += std::isfinite(metres) ? 1 : 0;
    }
    EXPECT_GT(valid, got.size() / 8);
  });
}

TEST_F(Ros2Cross, DepthInMillimetresIsRoundedAsDocumented) {
  startRos2(kSmallSim, "depth_format = '16UC1'\nname = 'front/left'\nframe_id = 'cam_optical_frame'\n");
  compare(program_->read("/front/left/depth/image_raw", kImage), [](const Frame& native, CdrReader& cdr) {
    ASSERT_NO_FATAL_FAILURE(expectHead(readImageHead(cdr), native, "16UC1", 2));
    const auto got = cdr.numbers<std::uint8_t>(cdr.left());
    for (std::size_t i = 0; i < got.size() / 2; ++i) {
      const double expected = std::round(1000.0 * static_cast<double>(depthOf(native, i)));
      ASSERT_EQ(got[2 * i] + 256 * got[2 * i + 1], std::isfinite(expected) ? expected : 0.0) << i;
    }
  });
}

TEST_F(Ros2Cross, AmplitudeIsTheNativeOneForAReaderThatAsksForReliable) {
  startRos2(kSmallSim, "reliability = 'reliable'\n");
  compare(program_->read("/cam/amplitude/image_raw", kImage, Asks::Reliable),
          [](const Frame& native, CdrReader& cdr) {
            ASSERT_NO_FATAL_FAILURE(expectHead(readImageHead(cdr), native, "32FC1", 4));
            const auto got = cdr.numbers<std::uint8_t>(cdr.left());
            const auto expected = native.find(PlaneKind::Amplitude)->data.bytes();
            EXPECT_EQ(std::memcmp(got.data(), expected.data(), expected.size()), 0);
          });
}

TEST_F(Ros2Cross, CameraInfoIsTheLens) {
  startRos2(kSmallSim);
  compare(program_->read("/cam/depth/camera_info", kInfo), [](const Frame& native, CdrReader& cdr) {
    const CameraInfo& camera = native.camera;
    EXPECT_EQ(cdr.number<std::uint32_t>(), 132U);
    EXPECT_EQ(cdr.number<std::uint32_t>(), 176U);
    EXPECT_EQ(cdr.text(), "plumb_bob");
    const auto& d = camera.distortion;
    EXPECT_EQ(cdr.sequence<double>(), (std::vector<double>{d.begin(), d.end()}));
    const std::vector<double> k{camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
    const std::vector<double> p{camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0};
    EXPECT_EQ(cdr.numbers<double>(9), k);
    EXPECT_EQ(cdr.numbers<double>(9), (std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1}));
    EXPECT_EQ(cdr.numbers<double>(12), p);
    EXPECT_EQ(cdr.numbers<std::uint32_t>(6), std::vector<std::uint32_t>(6, 0U));  // binning, region
    EXPECT_EQ(cdr.number<std::uint8_t>(), 0);
  });
}

TEST_F(Ros2Cross, PointsAreTheNativeRangesAlongTheirRays) {
  startRos2(kSmallSim);
  compare(program_->read("/cam/points", kPoints), [](const Frame& native, CdrReader& cdr) {
    EXPECT_EQ(cdr.number<std::uint32_t>(), 132U);
    EXPECT_EQ(cdr.number<std::uint32_t>(), 176U);
    ASSERT_EQ(cdr.number<std::uint32_t>(), 4U);
    std::uint32_t offset = 0;
    for (const char* name : {"x", "y", "z", "intensity"}) {
      EXPECT_EQ(cdr.text(), name);
      EXPECT_EQ(cdr.number<std::uint32_t>(), offset);
      EXPECT_EQ(cdr.number<std::uint8_t>(), 7);  // FLOAT32
      EXPECT_EQ(cdr.number<std::uint32_t>(), 1U);
      offset += 4;
    }
    EXPECT_EQ(cdr.number<std::uint8_t>(), 0);  // little endian
    EXPECT_EQ(cdr.number<std::uint32_t>(), 16U);
    EXPECT_EQ(cdr.number<std::uint32_t>(), 16U * 176U);
    const auto data = cdr.sequence<std::uint8_t>();
    ASSERT_EQ(data.size(), 16U * 176U * 132U);
    const auto range_m = native.find(PlaneKind::Range)->as<float>();
    const auto amplitude = native.find(PlaneKind::Amplitude)->as<float>();
    for (std::size_t i = 0; i < range_m.size(); ++i) {
      std::array<float, 4> point{};
      std::memcpy(point.data(), data.data() + 16 * i, 16);
      const Vec3d ray =
          rayThroughPixel(native.camera, static_cast<double>(i % 176), static_cast<double>(i / 176)).v;
      const auto range = static_cast<double>(range_m[i]);
      ASSERT_EQ(bitsOf(point[0]), bitsOf(static_cast<float>(range * ray.x))) << i;
      ASSERT_EQ(bitsOf(point[1]), bitsOf(static_cast<float>(range * ray.y))) << i;
      ASSERT_EQ(bitsOf(point[2]), bitsOf(static_cast<float>(range * ray.z))) << i;
      ASSERT_EQ(bitsOf(point[3]), bitsOf(amplitude[i])) << i;
    }
    EXPECT_EQ(cdr.number<std::uint8_t>(), 0);  // not dense
  });
}

}  // namespace
}  // namespace toftwin::daemon
