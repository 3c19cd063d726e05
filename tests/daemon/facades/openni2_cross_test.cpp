// SPDX-License-Identifier: Apache-2.0
// One truth: the same frame, read natively and through OpenNI2 by an unmodified program.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "openni2_testing.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using Policy = SubscribeOptions::Policy;

/// What docs/facades/openni2.md says becomes of a depth.
std::uint16_t depthCode(float depth_m, double per_metre, double beyond) {
  const double code = std::round(per_metre * static_cast<double>(depth_m));
  return code >= 1.0 && code < beyond ? static_cast<std::uint16_t>(code) : std::uint16_t{0};
}
std::uint16_t amplitudeCode(float amplitude, double per_count) {
  const double count = std::round(static_cast<double>(amplitude) / per_count);
  return std::isnan(count) ? std::uint16_t{0} : static_cast<std::uint16_t>(std::clamp(count, 0.0, 65'535.0));
}

class OpenNI2Cross : public OpenNI2Program {
 protected:
  /// Reads frames of a stream until so many were compared with the native ones of the same time stamp.
  template <class Compare>
  void compare(const OniStreamPtr& stream, int frames, Compare same) {
    auto native_client = client();
    auto native_stream = native_client.subscribe("cam", {.policy = Policy::Queue, .queue = 64});
    ASSERT_TRUE(native_stream.ok()) << native_stream.error().message;
    Natives natives{*std::move(native_stream), microsecondsOf};
    ASSERT_EQ(oniStreamStart(stream.get()), ONI_STATUS_OK);
    int compared = 0;
    for (int i = 0; i < 60 && compared < frames; ++i) {
      const OniFramePtr frame = readFrame(stream);
      ASSERT_NE(frame, nullptr);
      const auto native = natives.at(static_cast<std::int64_t>(frame->timestamp));
      ASSERT_TRUE(native.ok()) << native.error().message;
      if (*native == nullptr) continue;
      ASSERT_EQ(frame->dataSize, frame->stride * frame->height);
      ASSERT_NO_FATAL_FAILURE(same(*frame, **native));
      ++compared;
    }
    EXPECT_EQ(compared, frames);
    oniStreamStop(stream.get());
  }
};

TEST_F(OpenNI2Cross, DepthIsTheNativeOneBitForBitInBothUnitsWithItsTimeStamp) {
  startWith(kSmallSim);
  const auto device = openDevice("toftwin:cam");
  ASSERT_NE(device, nullptr);
  for (const auto& [format, per_metre, beyond] : {std::tuple{ONI_PIXEL_FORMAT_DEPTH_1_MM, 1000.0, 10'000.0},
                                                  {ONI_PIXEL_FORMAT_DEPTH_100_UM, 10'000.0, 65'535.0}}) {
    const auto stream = createStream(device, ONI_SENSOR_DEPTH);
    ASSERT_NE(stream, nullptr);
    auto mode = streamProperty<OniVideoMode>(stream, ONI_STREAM_PROPERTY_VIDEO_MODE);
    ASSERT_TRUE(mode);
    mode->pixelFormat = format;
    ASSERT_EQ(setStream(stream, ONI_STREAM_PROPERTY_VIDEO_MODE, *mode), ONI_STATUS_OK) << oniGetExtendedError();
    compare(stream, 3, [&](const OniFrame& frame, const Frame& native) {
      ASSERT_EQ(frame.width, native.camera.width);
      ASSERT_EQ(frame.height, native.camera.height);
      ASSERT_EQ(frame.videoMode.pixelFormat, format);
      const auto depth_m = native.find(PlaneKind::Depth)->as<float>();
      int with_value = 0;
      for (int y = 0; y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x) {
          const std::uint16_t got = wordAt(frame, x, y);
          const auto i = static_cast<std::size_t>(y * frame.width + x);
          ASSERT_EQ(got, depthCode(depth_m[i], per_metre, beyond)) << x << ' ' << y;
          with_value += got > 0 ? 1 : 0;
        }
      }
      EXPECT_GT(with_value, frame.width * frame.height / 2);
    });
  }
}

TEST_F(OpenNI2Cross, DepthOfASourceWithRangeAloneIsRangeTimesTheRaysZ) {
  startWith(kSmallSim + "planes = ['range', 'amplitude']\n");
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_DEPTH);
  compare(stream, 2, [](const OniFrame& frame, const Frame& native) {
    const auto range_m = native.find(PlaneKind::Range)->as<float>();
    for (int y = 0; y < frame.height; ++y) {
      for (int x = 0; x < frame.width; ++x) {
        const double z = rayThroughPixel(native.camera, x, y).v.z;
        const auto i = static_cast<std::size_t>(y * frame.width + x);
        const double mm = std::round(1000.0 * (static_cast<double>(range_m[i]) * z));
        ASSERT_EQ(wordAt(frame, x, y), mm >= 1.0 && mm < 10'000.0 ? static_cast<int>(mm) : 0) << x << ' ' << y;
      }
    }
  });
}

TEST_F(OpenNI2Cross, InfraredIsTheNativeAmplitudeInCountsMirroredAndCroppedAsAsked) {
  startWith(kSmallSim, "amplitude_per_count = 6.0\n");
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_IR);
  ASSERT_EQ(setStream(stream, ONI_STREAM_PROPERTY_MIRRORING, OniBool{TRUE}), ONI_STATUS_OK);
  const OniCropping window{TRUE, 10, 20, 31, 17};
  ASSERT_EQ(setStream(stream, ONI_STREAM_PROPERTY_CROPPING, window), ONI_STATUS_OK);
  EXPECT_EQ(streamProperty<int>(stream, ONI_STREAM_PROPERTY_STRIDE), 2 * window.width);
  compare(stream, 3, [&](const OniFrame& frame, const Frame& native) {
    ASSERT_EQ(frame.width, window.width);
    ASSERT_EQ(frame.height, window.height);
    EXPECT_EQ(frame.croppingEnabled, TRUE);
    EXPECT_EQ(frame.cropOriginX, window.originX);
    EXPECT_EQ(frame.cropOriginY, window.originY);
    const auto amplitude = native.find(PlaneKind::Amplitude)->as<float>();
    int brightest = 0;
    for (int y = 0; y < frame.height; ++y) {
      for (int x = 0; x < frame.width; ++x) {
        const int u = native.camera.width - 1 - (window.originX + x), v = window.originY + y;
        const auto i = static_cast<std::size_t>(v * native.camera.width + u);
        ASSERT_EQ(wordAt(frame, x, y), amplitudeCode(amplitude[i], 6.0)) << x << ' ' << y;
        brightest = std::max<int>(brightest, wordAt(frame, x, y));
      }
    }
    EXPECT_GT(brightest, 10);
  });
}

TEST_F(OpenNI2Cross, ColorIsTheNativeOneInterleaved) {
  startWith(
      "driver = 'sim'\nuri = 'sim:xtion_2'\nsamples_per_pixel = 1\nmax_surfaces = 1\nframe_interval_ms = 200\n"
      "planes = ['depth', 'color']\n");
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_COLOR);
  compare(stream, 1, [](const OniFrame& frame, const Frame& native) {
    ASSERT_EQ(frame.stride, 3 * native.camera.width);
    const auto color = native.find(PlaneKind::Color)->as<std::uint8_t>();
    const std::size_t pixels = color.size() / 3;
    const auto* got = static_cast<const std::uint8_t*>(frame.data);
    int coloured = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(got[3 * i + c], color[c * pixels + i]) << i;
      coloured += got[3 * i] > 0 ? 1 : 0;
    }
    EXPECT_GT(coloured, 1000);
  });
}

}  // namespace
}  // namespace toftwin::daemon
