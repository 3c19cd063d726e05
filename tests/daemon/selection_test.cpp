// SPDX-License-Identifier: Apache-2.0
#include "daemon/selection.h"

#include <gtest/gtest.h>

namespace toftwin::daemon {
namespace {

/// 5 × 4 pixels; range = 10 y + x; samples with two channels, the second 100 more.
Frame numbered() {
  Frame frame;
  frame.camera = {.width = 5,
                  .height = 4,
                  .fx = 6,
                  .fy = 8,
                  .cx = 2,
                  .cy = 1.5,
                  .distortion = {0.1, 0, 0, 0, 0},
                  .calibration_id = "c"};
  Image<float> range{5, 4};
  std::vector<std::uint16_t> samples;
  for (int channel = 0; channel < 2; ++channel) {
    for (int y = 0; y < 4; ++y) {
      for (int x = 0; x < 5; ++x) {
        range(x, y) = static_cast<float>(10 * y + x);
        samples.push_back(static_cast<std::uint16_t>(100 * channel + 10 * y + x));
      }
    }
  }
  frame.planes = {toPlane(PlaneKind::Range, range),
                  {PlaneKind::Samples, ElementType::U16, 5, 4, 2, Buffer::adopt(samples)}};
  return frame;
}

TEST(Selection, OfEverythingSharesTheBytes) {
  const Frame frame = numbered();
  const auto all = select(frame, {});
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->camera, frame.camera);
  ASSERT_EQ(all->planes.size(), 2u);
  EXPECT_EQ(all->planes[0].data.bytes().data(), frame.planes[0].data.bytes().data());
}

TEST(Selection, OfPlanesKeepsTheOrderAskedFor) {
  const auto some =
      select(numbered(), {.planes = {PlaneKind::Samples, PlaneKind::Range}, .region = {}});
  ASSERT_EQ(some->planes.size(), 2u);
  EXPECT_EQ(some->planes[0].kind, PlaneKind::Samples);
}

TEST(Selection, OfARegionWithDecimationTakesEveryNthPixelFromItsTopLeft) {
  const auto part = select(numbered(), {.planes = {}, .region = {1, 1, 4, 3}, .decimation = 2});
  ASSERT_TRUE(part.ok());
  const Plane& range = part->planes[0];
  ASSERT_EQ(range.width, 2);
  ASSERT_EQ(range.height, 2);
  const std::vector<float> expected{11, 13, 31, 33};
  EXPECT_EQ(std::vector<float>(range.as<float>().begin(), range.as<float>().end()), expected);
  const std::vector<std::uint16_t> samples{11, 13, 31, 33, 111, 113, 131, 133};
  const auto seen = part->planes[1].as<std::uint16_t>();
  EXPECT_EQ(std::vector<std::uint16_t>(seen.begin(), seen.end()), samples);
}

TEST(Selection, MovesTheCameraWithThePixels) {
  const Frame frame = numbered();
  const auto part = select(frame, {.planes = {}, .region = {1, 1, 4, 3}, .decimation = 2});
  // Pixel (u, v) of the part is pixel (1 + 2u, 1 + 2v) of the frame and must look the same way.
  for (int v = 0; v < 2; ++v) {
    for (int u = 0; u < 2; ++u) {
      const Vec3d a = rayThroughPixel(part->camera, u, v).v;
      const Vec3d b = rayThroughPixel(frame.camera, 1 + 2 * u, 1 + 2 * v).v;
      EXPECT_LT(norm(a - b), 1e-11);  // Newton's method stops at 1e-12
    }
  }
}

TEST(Selection, OfThoseItHasLeavesOutTheOthersAndCountsNoRoomForThem) {
  const Frame frame = numbered();
  const std::vector<PlaneKind> planes{PlaneKind::Range, PlaneKind::Samples};
  const Selection wanted{.planes = {PlaneKind::Range, PlaneKind::Depth}, .region = {}, .those_it_has = true};
  EXPECT_TRUE(checkSelection(wanted, frame.camera, planes).ok());
  const auto some = select(frame, wanted);
  ASSERT_TRUE(some.ok());
  ASSERT_EQ(some->planes.size(), 1u);
  EXPECT_EQ(some->planes[0].kind, PlaneKind::Range);
  EXPECT_EQ(bytesOf(wanted, frame.camera, planes, {}), sizeof(float) * 5 * 4);
}

TEST(Selection, RefusesWhatIsNotThere) {
  const Frame frame = numbered();
  const std::vector<PlaneKind> planes{PlaneKind::Range, PlaneKind::Samples};
  const auto check = [&](const Selection& s) {
    return checkSelection(s, frame.camera, planes).ok();
  };
  EXPECT_TRUE(check({.planes = {}, .region = {0, 0, 5, 4}}));
  EXPECT_FALSE(check({.planes = {}, .region = {1, 0, 5, 4}}));
  EXPECT_FALSE(check({.planes = {}, .region = {0, 1, 5, 4}}));
  EXPECT_FALSE(check({.planes = {}, .region = {0, 0, 5, 0}}));
  EXPECT_FALSE(check({.planes = {}, .region = {0xffffffff, 0, 2, 2}}));  // the sum wraps in 32 bit
  EXPECT_FALSE(check({.planes = {PlaneKind::Depth}, .region = {}}));
  EXPECT_FALSE(check({.planes = {PlaneKind::Range, PlaneKind::Range}, .region = {}}));
  EXPECT_FALSE(check({.planes = {}, .region = {}, .decimation = 0}));
}

TEST(Selection, KnowsHowLargeAFrameIs) {
  CameraInfo camera;
  camera.width = camera.height = 4096;
  const std::vector<PlaneKind> all{PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude,
                                   PlaneKind::Ambient, PlaneKind::Flags};
  EXPECT_EQ(bytesOf({}, camera, all, {}), 4096u * 4096 * 17);
  EXPECT_EQ(bytesOf({.planes = {PlaneKind::Flags}, .region = {}}, camera, all, {}), 4096u * 4096);
  EXPECT_EQ(bytesOf({.planes = {}, .region = {10, 10, 100, 50}, .decimation = 3}, camera, all, {}),
            34u * 17 * 17);
  EXPECT_EQ(bytesOf({.planes = {}, .region = {}}, camera, {PlaneKind::Samples},
                    {{PlaneKind::Samples, 48}}),
            4096u * 4096 * 48);
}

TEST(Selection, SaysWhatToDoAboutAFrameThatIsTooLarge) {
  EXPECT_TRUE(checkFrameBytes(256ull << 20).ok());
  const auto refused = checkFrameBytes((256ull << 20) + 1);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, Error::Code::TooLarge);
  EXPECT_EQ(refused.error().message,
            "one frame has 257 MiB, and a message at most 256: ask for fewer planes, a region or a "
            "decimation");
}

TEST(Selection, ADecimationBeyondTheImageLeavesOnePixel) {
  const auto part = select(numbered(), {.planes = {}, .region = {}, .decimation = 0xffffffff});
  ASSERT_TRUE(part.ok());
  EXPECT_EQ(part->camera.width, 1);
  EXPECT_EQ(part->planes[0].as<float>()[0], 0.0F);
}

}  // namespace
}  // namespace toftwin::daemon
