// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/ros/cdr.h"
#include "protocol/ros/definition.h"
#include "protocol/ros/of_frame.h"
#include "protocol/ros/ros1.h"

namespace toftwin::ros {
namespace {

std::vector<std::byte> bytesOf(std::initializer_list<int> numbers) {
  std::vector<std::byte> bytes;
  for (const int number : numbers) bytes.push_back(static_cast<std::byte>(number));
  return bytes;
}

TransformStamped someTransform() { return {{{1, 2}, "a"}, "b", {{0.0, 0.0, 1.0}, {0.0, 0.0, 0.0, 1.0}}}; }

// By the specification's rules, by hand: a head of four bytes; numbers at multiples of their sizes behind it; texts with
// their length and a zero.
TEST(Cdr, NumbersLieAtMultiplesOfTheirSizes) {
  const auto bytes = toCdr(TFMessage{{someTransform()}});
  const auto start = bytesOf({0, 1, 0, 0,               // little end first
                              1, 0, 0, 0,               // one transform
                              1, 0, 0, 0, 2, 0, 0, 0,   // stamp
                              2, 0, 0, 0, 'a', 0,       // frame
                              0, 0,                     // to a multiple of 4
                              2, 0, 0, 0, 'b', 0,       // child, up to 26
                              0, 0, 0, 0, 0, 0,         // to a multiple of 8: 32
                              0, 0, 0, 0, 0, 0, 0, 0}); // x
  ASSERT_EQ(bytes.size(), 4u + 32u + 7u * 8u);
  EXPECT_TRUE(std::equal(start.begin(), start.end(), bytes.begin()));
}

TEST(Cdr, WhatIsWrittenIsReadBack) {
  CameraInfo info = infoOf({3, 2, 1.5, 2.5, 3.5, 4.5, {1, 2, 3, 4, 5}, ""});
  info.header = {{-5, 7}, "frame"};
  info.roi.do_rectify = true;
  const auto bytes = toCdr(info);
  const auto read = fromCdr<CameraInfo>(bytes);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(toCdr(*read), bytes);
  EXPECT_EQ(read->header.stamp.sec, -5);
  EXPECT_EQ(read->d, info.d);
  EXPECT_TRUE(read->roi.do_rectify);
}

TEST(Cdr, TheBigEndMayComeFirst) {
  const auto read = fromCdr<Vector3>(bytesOf({0, 0, 0, 0, 0x3f, 0xf0, 0, 0, 0, 0, 0, 0, 0x40, 0, 0, 0, 0, 0, 0, 0, 0x40, 0x08, 0, 0, 0, 0, 0, 0}));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->x, 1.0);
  EXPECT_EQ(read->y, 2.0);
  EXPECT_EQ(read->z, 3.0);
}

TEST(Cdr, EveryShorterMessageIsAnError) {
  const std::vector<std::byte> data(9);
  Image image;
  image.encoding = "mono8";
  image.data = data;
  const auto bytes = toCdr(image);
  for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(fromCdr<Image>(std::span{bytes}.first(size))) << size;
  const auto transforms = toCdr(TFMessage{{someTransform(), someTransform()}});
  for (std::size_t size = 0; size < transforms.size(); ++size) EXPECT_FALSE(fromCdr<TFMessage>(std::span{transforms}.first(size))) << size;
}

TEST(Cdr, ALengthThatLiesTakesNoMemory) {
  EXPECT_FALSE(fromCdr<TFMessage>(bytesOf({0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff})));
  auto bytes = toCdr(CameraInfo{});
  std::fill(bytes.begin() + 4 + 32, bytes.begin() + 4 + 36, std::byte{0xff});  // how many terms the distortion has
  EXPECT_FALSE(fromCdr<CameraInfo>(bytes));
}

TEST(Cdr, AnotherVersionIsSaid) { EXPECT_FALSE(fromCdr<Vector3>(bytesOf({0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}))); }

TEST(Definition, NamesEveryPartOnceBehindALine) {
  EXPECT_EQ(Definition::of<TransformStamped>(),
            "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n" + std::string(80, '=') +
                "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + std::string(80, '=') +
                "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" + std::string(80, '=') +
                "\nMSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n" + std::string(80, '=') +
                "\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n" + std::string(80, '=') +
                "\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n");
}

TEST(Stamps, TimesBefore1970HaveAPositiveRest) {
  EXPECT_EQ(timeOf(-1).sec, -1);
  EXPECT_EQ(timeOf(-1).nanosec, 999'999'999u);
  EXPECT_EQ(timeOf(std::numeric_limits<std::int64_t>::max()).sec, std::numeric_limits<std::int32_t>::max());
}

TEST(Names, AreWhatRosTakes) {
  EXPECT_EQ(nameFor("kinect v2/left"), "kinect_v2_left");
  EXPECT_EQ(nameFor("3d"), "camera_3d");
}

}  // namespace
}  // namespace toftwin::ros
