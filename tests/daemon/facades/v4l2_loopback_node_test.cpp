// SPDX-License-Identifier: Apache-2.0
// What v4l2_loopback makes of a node, where this program is the kernel. The module itself is the judge in
// tests/kernel/v4l2_loopback_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include "daemon/facades/v4l2_loopback/output_node.h"

namespace toftwin::daemon::v4l2_loopback {
namespace {

using testing::HasSubstr;

/// A node as v4l2loopback's: what it does not know becomes BGR4, without an error.
class FakeNode final : public System {
 public:
  int open(const std::string&) override { return open_result; }
  void close(int) override { ++closed; }
  int ioctl(int, unsigned long request, void* argument) override {
    if (request == VIDIOC_QUERYCAP) {
      auto& can = *static_cast<v4l2_capability*>(argument);
      can.capabilities = caps;
      std::memcpy(can.driver, "uvcvideo", 9);
      return query_result;
    }
    if (request != VIDIOC_S_FMT) return 0;
    auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
    ++tried;
    if (pix.pixelformat == V4L2_PIX_FMT_Z16 && refuses_z16) return -EINVAL;
    if (pix.pixelformat == V4L2_PIX_FMT_Z16 && !knows_z16) pix.pixelformat = V4L2_PIX_FMT_BGR32;
    pix.width = std::min(pix.width, most_width);
    return set_result;
  }
  std::int64_t write(int, std::span<const std::byte> bytes) override {
    return write_result != 0 ? write_result : static_cast<std::int64_t>(bytes.size());
  }
  int open_result = 7, query_result = 0, set_result = 0, closed = 0, tried = 0;
  std::int64_t write_result = 0;
  std::uint32_t caps = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_READWRITE, most_width = 8192;
  bool knows_z16 = false, refuses_z16 = false;
};

constexpr std::array<std::uint32_t, 2> kDepthCodes{V4L2_PIX_FMT_Z16, V4L2_PIX_FMT_Y16};

TEST(LoopbackNode, DepthIsZ16WhereTheModuleKnowsItAndElseY16) {
  for (const bool knows : {true, false}) {
    FakeNode fake;
    fake.knows_z16 = knows;
    auto node = OutputNode::open(fake, "/dev/video10");
    ASSERT_TRUE(node.ok());
    ASSERT_TRUE(node->setFormat(kDepthCodes, 8, 4, 30.0).ok());
    EXPECT_EQ(node->format()->code, knows ? V4L2_PIX_FMT_Z16 : V4L2_PIX_FMT_Y16);
    EXPECT_TRUE(node->write(std::vector<std::byte>(64)).ok());
    EXPECT_FALSE(node->write(std::vector<std::byte>(63)).ok());
  }
}

TEST(LoopbackNode, AFormatOrSizeThatBecomesAnotherOneIsRefused) {
  FakeNode fake;
  auto node = OutputNode::open(fake, "/dev/video10");
  const auto z16 = node->setFormat(std::span{kDepthCodes}.first(1), 8, 4, 0.0);
  ASSERT_FALSE(z16.ok());
  EXPECT_THAT(z16.error().message, HasSubstr("Z16  became BGR4"));
  EXPECT_FALSE(node->format().has_value());
  fake.most_width = 4;
  const auto wide = node->setFormat(kDepthCodes, 8, 4, 0.0);
  ASSERT_FALSE(wide.ok());
  EXPECT_THAT(wide.error().message, HasSubstr("of 4 x 4"));
}

TEST(LoopbackNode, AFormatThatIsRefusedIsFollowedByTheNextOneAndOtherErrorsAreNot) {
  FakeNode fake;
  fake.refuses_z16 = true;
  auto node = OutputNode::open(fake, "/dev/video10");
  ASSERT_TRUE(node->setFormat(kDepthCodes, 8, 4, 0.0).ok());
  EXPECT_EQ(node->format()->code, V4L2_PIX_FMT_Y16);
  const auto z16 = node->setFormat(std::span{kDepthCodes}.first(1), 8, 4, 0.0);
  ASSERT_FALSE(z16.ok());
  EXPECT_THAT(z16.error().message, HasSubstr("Z16  is refused"));
  EXPECT_FALSE(node->format().has_value());
  FakeNode busy;
  busy.set_result = -EBUSY;
  auto other = OutputNode::open(busy, "/dev/video10");
  EXPECT_FALSE(other->setFormat(kDepthCodes, 8, 4, 0.0).ok());
  EXPECT_EQ(busy.tried, 1);
}

TEST(LoopbackNode, EachErrorSaysWhatToDo) {
  const auto messageOf = [](FakeNode& fake) {
    auto node = OutputNode::open(fake, "/dev/video10");
    if (!node) return node.error().message;
    const auto set = node->setFormat(kDepthCodes, 8, 4, 0.0);
    if (!set) return set.error().message;
    const auto written = node->write(std::vector<std::byte>(64));
    return written ? std::string{} : written.error().message;
  };
  FakeNode none, forbidden, no_video, camera, taken, gone, half;
  none.open_result = -ENOENT;
  EXPECT_THAT(messageOf(none), HasSubstr("modprobe v4l2loopback"));
  forbidden.open_result = -EACCES;
  EXPECT_THAT(messageOf(forbidden), HasSubstr("group \"video\""));
  no_video.query_result = -ENOTTY;
  EXPECT_THAT(messageOf(no_video), HasSubstr("is no video node"));
  EXPECT_EQ(no_video.closed, 1);
  camera.caps = V4L2_CAP_VIDEO_CAPTURE;
  EXPECT_THAT(messageOf(camera), HasSubstr("it is of \"uvcvideo\""));
  taken.set_result = -EBUSY;
  EXPECT_THAT(messageOf(taken), HasSubstr("another program writes to it"));
  gone.write_result = -ENODEV;
  EXPECT_THAT(messageOf(gone), HasSubstr("modprobe v4l2loopback"));
  half.write_result = 32;
  EXPECT_THAT(messageOf(half), HasSubstr("took 32 of 64 bytes"));
}

}  // namespace
}  // namespace toftwin::daemon::v4l2_loopback
