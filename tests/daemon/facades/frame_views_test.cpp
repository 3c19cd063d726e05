// SPDX-License-Identifier: Apache-2.0
// What every facade looks at a frame's planes through.
#include <gtest/gtest.h>

#include "daemon/facades/frame_views.h"

namespace toftwin::daemon {
namespace {

/// A frame of 4 x 2 pixels whose range has that size, type and memory.
Frame frameWith(int width, int height, int channels, std::size_t bytes) {
  Frame frame;
  frame.camera.width = 4;
  frame.camera.height = 2;
  Plane plane;
  plane.kind = PlaneKind::Range;
  plane.type = ElementType::F32;
  plane.width = width;
  plane.height = height;
  plane.channels = channels;
  plane.data = Buffer::adopt(std::vector<std::byte>(bytes));
  frame.planes.push_back(std::move(plane));
  return frame;
}
bool isSeen(const Frame& frame) { return planeOf(frame, PlaneKind::Range, ElementType::F32) != nullptr; }

TEST(FrameViews, APlaneOfAnotherSizeThanTheCamerasIsNone) {
  EXPECT_TRUE(isSeen(frameWith(4, 2, 1, 32)));
  EXPECT_FALSE(isSeen(frameWith(2, 4, 1, 32))) << "as many pixels, in other rows";
  EXPECT_FALSE(isSeen(frameWith(4, 3, 1, 48)));
  EXPECT_FALSE(isSeen(frameWith(4, 2, 3, 96)));
}

TEST(FrameViews, APlaneWithLessMemoryThanItsSizeSaysIsNone) {
  EXPECT_FALSE(isSeen(frameWith(4, 2, 1, 31)));
  EXPECT_FALSE(isSeen(frameWith(4, 2, 1, 0)));
  EXPECT_EQ(planeOf(frameWith(4, 2, 1, 32), PlaneKind::Range, ElementType::U8), nullptr) << "of another type";
  EXPECT_EQ(planeOf(frameWith(4, 2, 1, 32), PlaneKind::Depth), nullptr);
}

}  // namespace
}  // namespace toftwin::daemon
