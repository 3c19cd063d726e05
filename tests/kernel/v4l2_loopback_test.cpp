// SPDX-License-Identifier: Apache-2.0
// The facade v4l2_loopback of a running daemon on the real module, with v4l2-ctl and our own driver as
// readers.
#include <fmt/format.h>
#include <linux/videodev2.h>

#include <cstring>
#include <fstream>
#include <iterator>

#include "daemon/facades/v4l2_loopback/output_node.h"
#include "facade_frames.h"

namespace toftwin::kernel_test {
namespace {

class V4l2Loopback : public FacadeFrames {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/v4l2loopback.ko"))
      GTEST_SKIP() << "v4l2loopback could not be compiled here (tests/kernel/loopback-module says why)";
    run("insmod /v4l2loopback.ko video_nr=10,11 exclusive_caps=0,0");
    FacadeFrames::SetUp();
  }
  void TearDown() override {
    if (!std::filesystem::exists("/v4l2loopback.ko")) return;
    FacadeFrames::TearDown();
    run("rmmod v4l2loopback");
  }
  static std::string facade(const std::string& more) {
    return fmt::format("[[facade]]\nkind = 'v4l2_loopback'\nsource = 'cam'\n{}\n", more);
  }
};

TEST_F(V4l2Loopback, ImagesAreTheNativeOnesBitForBitAndDepthIsY16WhereZ16IsNotKnown) {
  start(kFacadePattern + facade("") + facade("device = '/dev/video11'\nimage = 'amplitude'"));
  ASSERT_TRUE(log_->waitFor("64 x 48 as Y16", 2)) << "the module of Debian 12 does not know Z16";
  collect();
  run("v4l2-ctl -d /dev/video10 --get-fmt-video | grep -q \"'Y16 '\"");
  run("v4l2-ctl -d /dev/video10 --stream-mmap=4 --stream-count=10 --stream-to=/tmp/depth.raw > /dev/null "
      "2>&1");
  const auto images = imagesIn("/tmp/depth.raw");
  ASSERT_EQ(images.size(), 10u);
  // The first may be of before the subscription: the module keeps it for who comes later.
  const int second = placeOf(images[1]);
  ASSERT_GE(second, 0) << "it is none of the native frames";
  for (int i = 2; i < 10; ++i) EXPECT_EQ(placeOf(images[static_cast<std::size_t>(i)]), second + i - 1);
  run("v4l2-ctl -d /dev/video11 --stream-mmap=4 --stream-count=3 --stream-to=/tmp/amplitude.raw > /dev/null "
      "2>&1");
  EXPECT_GE(placeOf(imagesIn("/tmp/amplitude.raw").at(2), PlaneKind::Amplitude), 0);
}

TEST_F(V4l2Loopback, WhatCannotBeIsAnErrorThatSaysWhatToDo) {
  auto& system = daemon::v4l2_loopback::kernel();
  auto node = daemon::v4l2_loopback::OutputNode::open(system, "/dev/video10");
  ASSERT_TRUE(node.ok()) << node.error().message;
  const std::uint32_t z16 = V4L2_PIX_FMT_Z16;
  const auto set = node->setFormat({&z16, 1}, 64, 48, 10.0);
  ASSERT_FALSE(set.ok());
  EXPECT_NE(set.error().message.find("Z16  became"), std::string::npos) << set.error().message;
  const auto none = daemon::v4l2_loopback::OutputNode::open(system, "/dev/video42");
  EXPECT_EQ(none.error().code, Error::Code::NotFound) << none.error().message;
  const auto file = daemon::v4l2_loopback::OutputNode::open(system, "/dev/null");
  EXPECT_EQ(file.error().code, Error::Code::InvalidArgument) << file.error().message;
}

TEST_F(V4l2Loopback, ANodeThatComesLaterIsTakenThen) {
  run("rmmod v4l2loopback");
  start(kFacadePattern + facade(""));
  ASSERT_TRUE(log_->waitFor("modprobe v4l2loopback", 1));
  run("insmod /v4l2loopback.ko video_nr=10,11");
  EXPECT_TRUE(log_->waitFor("64 x 48 as Y16", 1));
}

}  // namespace
}  // namespace toftwin::kernel_test
