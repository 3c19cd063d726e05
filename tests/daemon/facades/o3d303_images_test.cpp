// SPDX-License-Identifier: Apache-2.0
// What a client of the O3D303 facade sets is seen in the images, here and natively.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "daemon/facades/timing/unevenness.h"
#include "facade_testing.h"
#include "measured_intervals.h"
#include "o3d303_client.h"

namespace toftwin::daemon {
namespace {

using namespace test;

class O3d303Images : public RunningFacade {
 protected:
  O3d303Client camera() { return O3d303Client{xmlrpc_}; }
};

TEST_F(O3d303Images, TheTypeOfTheImagerSetsTheCamerasFrequenciesAndExposures) {
  startO3d303("driver = 'sim'\nuri = 'sim:o3d303_binned'\nsamples_per_pixel = 1\nmax_surfaces = 1\n");
  auto rpc = camera();
  PcicClient watches{rpc.pcicPort()};  // from before the camera has several exposures
  EXPECT_EQ(watches.setSchema({o3d303::kConfidenceBlob}), "*");
  watches.frame();
  const auto setType = [&](const char* type) {
    rpc.edit();
    rpc.call(rpc.imager(), "changeType", {type});
    rpc.call(rpc.session("edit/application/"), "save", {});
    rpc.endSession();
  };
  setType("upto30m_moderate");
  auto native = client();
  // The nearest surfaces fill so small a well.
  ASSERT_TRUE(native.setParameter("cam", "saturation.full_well_electrons", 18000.0).ok());
  auto frames = native.subscribe("cam", {});
  ASSERT_TRUE(frames.ok()) << frames.error().message;
  const auto frame = frames->next(kSoon);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  std::set<double> frequencies_mhz, exposures_us;
  for (const Exposure& one : frame->moment.exposures) {
    frequencies_mhz.insert(std::round(one.modulation.in(megahertz)));
    exposures_us.insert(std::round(one.duration.in(microsecond)));
  }
  EXPECT_THAT(frequencies_mhz, testing::ElementsAre(29.0, 30.0));
  EXPECT_THAT(exposures_us, testing::ElementsAre(25.0, 1000.0)) << "a fortieth, as the camera has it";
  std::ptrdiff_t longest = 0, shorter = 0;
  for (int i = 0; i < 50 && shorter == 0; ++i) {  // the first may be from before
    const auto sent = watches.frame();
    const auto confidence = sent.find(o3d303::ChunkType::Confidence)->data;
    const auto countOf = [&](unsigned exposure) {
      return std::ranges::count_if(
          confidence, [&](std::byte one) { return (std::to_integer<unsigned>(one) & 0x30U) == exposure; });
    };
    longest = countOf(0x30U);
    shorter = countOf(0x20U);
  }
  EXPECT_GT(longest, 176 * 132 / 2) << "most pixels are of the longer one";
  EXPECT_GT(shorter, 0) << "those that saturate in it are of the shorter one";
  EXPECT_EQ(longest + shorter, 176 * 132);
  setType("under5m_low");
  const auto details = native.describe("cam");
  for (const Parameter& one : details->parameters) {
    if (one.name == "frequencies" || one.name == "exposures") {
      EXPECT_EQ(one.value, 1.0) << one.name;
    }
  }
}

/// What a client computes points from: the source's lens, pixel by pixel, and where a client says that the
/// camera stands.
TEST_F(O3d303Images, LensAndPlaceAreThoseOfTheSource) {
  startO3d303(kSmallSim);
  auto rpc = camera();
  rpc.edit();
  for (const auto& [axis, mm] : {std::pair{"X", "12.5"}, {"Y", "-40"}, {"Z", "300"}}) {
    const std::string name = fmt::format("ExtrinsicCalibTrans{}", axis);
    rpc.call(rpc.session("edit/device/"), "setParameter", {name, mm});
  }
  rpc.call(rpc.session("edit/device/"), "save", {});
  rpc.endSession();
  PcicClient watches{rpc.pcicPort()};
  ASSERT_EQ(watches.setSchema({o3d303::kDistanceBlob, o3d303::kXBlob, o3d303::kYBlob, o3d303::kZBlob,
                               o3d303::kUnitVectorsBlob, o3d303::kExtrinsicsBlob, o3d303::kIntrinsicsBlob,
                               o3d303::kInverseIntrinsicsBlob}),
            "*");
  const auto frame = watches.frame();
  const auto floats = [&](o3d303::ChunkType type) {
    const o3d303::Chunk* chunk = frame.find(type);
    EXPECT_NE(chunk, nullptr) << static_cast<int>(type);
    return chunk != nullptr ? *o3d303::floatsOf(*chunk) : std::vector<float>(16);
  };
  const auto details = client().describe("cam");
  ASSERT_TRUE(details.ok()) << details.error().message;
  const CameraInfo& lens = details->camera;
  const auto& [k1, k2, p1, p2, k3] = lens.distortion;
  ASSERT_NE(p1, p2) << "or they could be exchanged";
  EXPECT_THAT(floats(o3d303::ChunkType::Extrinsics),
              testing::ElementsAre(12.5F, -40.0F, 300.0F, 0.0F, 0.0F, 0.0F));
  std::vector<float> expected;
  for (const double number :
       {lens.fx, lens.fy, lens.cx, lens.cy, 0.0, k1, k2, k3, p1, p2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0})
    expected.push_back(static_cast<float>(number));
  EXPECT_EQ(floats(o3d303::ChunkType::Intrinsics), expected);
  const auto vectors = floats(o3d303::ChunkType::UnitVectors),
             inverse = floats(o3d303::ChunkType::InverseIntrinsics);
  ASSERT_EQ(vectors.size(), 3U * 176U * 132U);
  const auto numbers = [&](o3d303::ChunkType type) { return *o3d303::numbersOf(*frame.find(type)); };
  const auto distance_mm = numbers(o3d303::ChunkType::RadialDistance), x_mm = numbers(o3d303::ChunkType::X),
             y_mm = numbers(o3d303::ChunkType::Y), z_mm = numbers(o3d303::ChunkType::Z);
  int with_value = 0;
  double worst_px = 0.0;
  for (std::size_t i = 0; i < distance_mm.size(); ++i) {
    const auto u = static_cast<double>(i % 176), v = static_cast<double>(i / 176);
    const auto ray = rayThroughPixel(lens, u, v).v;
    ASSERT_NEAR(vectors[3 * i], ray.x, 6e-8) << i;  // a float of at most 1
    ASSERT_NEAR(vectors[3 * i + 1], ray.y, 6e-8) << i;
    ASSERT_NEAR(vectors[3 * i + 2], ray.z, 6e-8) << i;
    const double x = (u - lens.cx) / lens.fx, y = (v - lens.cy) / lens.fy, rr = x * x + y * y;
    const double radial = 1.0 + rr * (inverse[5] + rr * (inverse[6] + rr * static_cast<double>(inverse[7])));
    const double undistorted = x * radial + 2.0 * inverse[8] * x * y + inverse[9] * (rr + 2.0 * x * x);
    worst_px = std::max(worst_px, lens.fx * std::abs(undistorted - ray.x / ray.z));
    if (distance_mm[i] <= 0.0F) continue;
    ++with_value;
    // p = e d + t, X right, Y down, Z forward. A count is a millimetre.
    ASSERT_NEAR(x_mm[i], distance_mm[i] * ray.x + 12.5, 0.501) << i;
    ASSERT_NEAR(y_mm[i], distance_mm[i] * ray.y - 40.0, 0.501) << i;
    ASSERT_NEAR(z_mm[i], distance_mm[i] * ray.z + 300.0, 0.501) << i;
  }
  EXPECT_GT(with_value, 176 * 132 / 2);
  // Five terms do not undo five: a fit over all pixels, made elsewhere, leaves 1.08 pixels in a corner; this
  // one sees 625.
  EXPECT_LT(worst_px, 1.2);
}

/// How much a pixel differs from the next one in its row, and from itself a frame later: medians over the
/// image.
struct Roughness {
  double in_image_mm, in_time_mm;
};
Roughness roughnessOf(const Frame& first, const Frame& second) {
  const auto a = first.find(PlaneKind::Range)->as<float>(), b = second.find(PlaneKind::Range)->as<float>();
  std::vector<double> in_image, in_time;
  for (std::size_t i = 0; i + 1 < a.size(); ++i) {
    if (std::isfinite(a[i]) && std::isfinite(a[i + 1])) in_image.push_back(std::abs(1e3 * (a[i + 1] - a[i])));
    if (std::isfinite(a[i]) && std::isfinite(b[i])) in_time.push_back(std::abs(1e3 * (b[i] - a[i])));
  }
  const auto medianOf = [](std::vector<double>& values) {
    std::ranges::nth_element(values, values.begin() + std::ssize(values) / 2);
    return values.at(values.size() / 2);
  };
  return {medianOf(in_image), medianOf(in_time)};
}

TEST_F(O3d303Images, FiltersSmoothTheSimulatedCamerasImagesForAll) {
  startO3d303(kSmallSim);
  auto rpc = camera();
  const auto roughness = [&] {
    auto native = client();
    auto frames = native.subscribe("cam", {});
    Frame last;
    for (int i = 0;; ++i) {
      auto next = frames->next(kSoon);
      EXPECT_TRUE(next.ok());
      if (!next) return Roughness{};
      if (i == 7) return roughnessOf(last, *next);  // the filter over frames is full
      last = *std::move(next);
    }
  };
  const auto set = [&](const std::string& object, const char* name, const char* value) {
    rpc.edit();
    rpc.call(object, "setParameter", {name, value});
    rpc.call(rpc.session("edit/application/"), "save", {});
    rpc.endSession();
  };
  const Roughness plain = roughness();
  set(rpc.imager(), "SpatialFilterType", "2");
  const Roughness mean = roughness();
  // Means of nine share six of them with their neighbour's: differences have sqrt(6/81 / 2) = 0.19 of the
  // noise.
  EXPECT_LT(mean.in_image_mm, 0.5 * plain.in_image_mm);
  EXPECT_LT(mean.in_time_mm, 0.5 * plain.in_time_mm) << "1/3 of the noise";
  set(rpc.imager(), "SpatialFilterType", "0");
  set(rpc.imager(), "TemporalFilterType", "1");
  set(rpc.imager() + "temporalfilter", "NumberOfImages", "4");
  const Roughness running = roughness();
  EXPECT_LT(running.in_time_mm, 0.5 * plain.in_time_mm) << "means of four share three: 1/4";
  set(rpc.imager(), "TemporalFilterType", "0");
  EXPECT_NEAR(roughness().in_time_mm, plain.in_time_mm, 0.1 * plain.in_time_mm) << "off again";
}

TEST_F(O3d303Images, AHigherMinimumAmplitudeLeavesNoPixelValid) {
  startO3d303(kSmallSim);
  auto rpc = camera();
  rpc.edit();
  rpc.call(rpc.imager(), "setParameter", {"MinimumAmplitude", "65535"});
  rpc.call(rpc.session("edit/application/"), "save", {});
  rpc.endSession();
  auto native = client();
  auto frames = native.subscribe("cam", {});
  const auto frame = frames->next(kSoon);
  ASSERT_TRUE(frame.ok());
  const auto range = frame->find(PlaneKind::Range)->as<float>();
  const auto flags = frame->find(PlaneKind::Flags)->as<std::uint8_t>();
  EXPECT_TRUE(std::ranges::none_of(range, [](float r) { return std::isfinite(r); }));
  const auto isDark = [](std::uint8_t f) {
    return (f & static_cast<unsigned>(PixelFlag::LowAmplitude)) != 0;
  };
  EXPECT_GT(std::ranges::count_if(flags, isDark), 176 * 132 / 2);
}

TEST_F(O3d303Images, WhatIsClippedIsInvalidInItsImagesAndSaysWhy) {
  startO3d303(kSmallSim);
  auto rpc = camera();
  rpc.edit();
  rpc.call(rpc.imager(), "setParameter", {"ClippingLeft", "88"});
  rpc.call(rpc.imager(), "setParameter", {"ClippingCuboid", R"({"YMin": 0})"});
  rpc.call(rpc.session("edit/application/"), "save", {});
  rpc.endSession();
  PcicClient watches{rpc.pcicPort()};
  EXPECT_EQ(watches.setSchema({o3d303::kDistanceBlob, o3d303::kConfidenceBlob, o3d303::kYBlob}), "*");
  const auto frame = watches.frame();
  const auto distance = frame.find(o3d303::ChunkType::RadialDistance)->data;
  const auto confidence = frame.find(o3d303::ChunkType::Confidence)->data;
  const auto y_mm = *o3d303::numbersOf(*frame.find(o3d303::ChunkType::Y));
  int clipped = 0, left = 0;
  for (std::size_t i = 0; i < confidence.size(); ++i) {
    const bool is_clipped = (std::to_integer<unsigned>(confidence[i]) & 0x40U) != 0;
    const bool has_distance = distance[2 * i] != std::byte{0} || distance[2 * i + 1] != std::byte{0};
    const bool is_above = y_mm[i] < 0.0F;
    EXPECT_FALSE(is_clipped && has_distance);
    EXPECT_TRUE(is_clipped || i % 176 >= 88);
    EXPECT_FALSE(has_distance && is_above);
    clipped += is_clipped ? 1 : 0;
    left += has_distance ? 1 : 0;
  }
  EXPECT_GT(left, 2000) << "a quarter of the image or so";
  EXPECT_GT(clipped, 176 * 132 / 2);
}

/// Each frame comes to a client when the real camera's would have, or later on a busy machine; never earlier.
TEST_F(O3d303Images, ComeAsUnevenlyAsARealCamerasDid) {
  const auto file = measuredIntervals("libo3d3xx_jitter-2000-30-8.txt");
  if (file.empty()) GTEST_SKIP() << "no ifm-frame-timing in $TOFTWIN_DATA or ../shared/data";
  constexpr int kFrames = 60;
  constexpr double kLatency_ms = 10.0;
  // 37.9 ms is the file's mean: evenly spaced frames at that are what the file's are late against.
  startO3d303("driver = 'pattern'\nwidth = 64\nheight = 48\nframe_rate_hz = 26.4\n",
              fmt::format("intervals = '{}'\nlatency_ms = {}", file.string(), kLatency_ms));
  auto native = client();
  auto stream = native.subscribe("cam", {.policy = SubscribeOptions::Policy::Queue, .queue = 4 * kFrames});
  ASSERT_TRUE(stream.ok()) << stream.error().message;
  PcicClient watches{camera().pcicPort()};
  std::map<std::uint64_t, std::int64_t> arrived_ns;  // by frame count
  for (int i = 0; i < kFrames; ++i) {
    const std::uint64_t count = watches.frame().chunks.at(0).header.frame_count;
    arrived_ns[count] = std::chrono::nanoseconds{std::chrono::system_clock::now().time_since_epoch()}.count();
  }
  const auto uneven = Unevenness::load(file);
  ASSERT_TRUE(uneven.ok()) << uneven.error().message;
  const std::uint64_t first = arrived_ns.begin()->first;
  double least_late_ms = 1e9;
  int compared = 0;
  while (compared < kFrames) {
    const auto frame = stream->next(kSoon);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    if (frame->sequence > arrived_ns.rbegin()->first) break;
    const auto arrived = arrived_ns.find(frame->sequence);
    if (arrived == arrived_ns.end()) continue;
    const double took_ms = static_cast<double>(arrived->second - frame->moment.received.ns) * 1e-6;
    const double held_ms =
        kLatency_ms + static_cast<double>(uneven->delay(frame->sequence - first).count()) * 1e-6;
    EXPECT_GE(took_ms, held_ms - 0.01) << "frame " << frame->sequence;  // the two clocks tick differently
    least_late_ms = std::min(least_late_ms, took_ms - held_ms);
    ++compared;
  }
  EXPECT_GT(compared, kFrames / 2);
  EXPECT_LT(least_late_ms, 10.0) << "some come in time on any machine";
}

/// The nearest surfaces fill a small well in a millisecond, and none in a large one.
TEST_F(O3d303Images, AnAutomaticExposureSetsTheSimulatedCameras) {
  startO3d303(kSmallSim);
  auto native = client();
  ASSERT_TRUE(native.setParameter("cam", "saturation.full_well_electrons", 18'000.0).ok());
  auto rpc = camera();
  rpc.edit();
  rpc.call(rpc.imager(), "setParameter", {"ContinuousAutoExposure", "true"});
  rpc.call(rpc.session("edit/application/"), "save", {});
  rpc.endSession();
  const auto exposure_us = [&] {
    const auto details = native.describe("cam");
    for (const Parameter& one : details->parameters) {
      if (one.name == "exposure_us") return one.value.value_or(0.0);
    }
    return 0.0;
  };
  PcicClient watches{rpc.pcicPort()};
  const auto watchUntil = [&](const auto& isThere) {
    for (int i = 0; i < 200 && !isThere(); ++i) watches.frame();
    return isThere();
  };
  EXPECT_TRUE(watchUntil([&] { return exposure_us() < 900.0; })) << exposure_us();
  ASSERT_TRUE(native.setParameter("cam", "saturation.full_well_electrons", 1e7).ok());
  EXPECT_TRUE(watchUntil([&] { return exposure_us() > 1000.0; })) << exposure_us();
}

TEST_F(O3d303Images, ResolutionZeroOfAFineSourceHasHalfItsRowsAndColumns) {
  startO3d303("driver = 'pattern'\nwidth = 352\nheight = 264\nframe_rate_hz = 20\n");
  auto rpc = camera();
  PcicClient watches{rpc.pcicPort()};
  EXPECT_EQ(watches.frame().chunks.at(0).header.width, 352u);
  rpc.edit();
  rpc.call(rpc.imager(), "setParameter", {"Resolution", "0"});
  rpc.call(rpc.session("edit/application/"), "save", {});
  rpc.endSession();
  EXPECT_TRUE(eventually([&] {
    const auto frame = watches.frame();
    return frame.chunks.at(0).header.width == 176u && frame.chunks.at(0).header.height == 132u;
  }));
}

TEST_F(O3d303Images, OurDriverFindsTheLensWhereverAClientTurnsTheCamera) {
  startO3d303(kSmallSim);
  auto rpc = camera();
  rpc.edit();
  for (const auto& [name, value] :
       {std::pair{"RotX", "25"}, {"RotY", "-40"}, {"RotZ", "130"}, {"TransX", "100"}}) {
    rpc.call(rpc.session("edit/device/"), "setParameter", {fmt::format("ExtrinsicCalib{}", name), value});
  }
  rpc.call(rpc.session("edit/device/"), "save", {});
  rpc.endSession();
  const auto driver = openDriver();
  ASSERT_TRUE(driver.ok()) << driver.error().message;
  const CameraInfo seen = (*driver)->info().camera, own = client().describe("cam")->camera;
  EXPECT_NEAR(seen.fx, own.fx, 0.01);
  EXPECT_NEAR(seen.fy, own.fy, 0.01);
  EXPECT_NEAR(seen.cx, own.cx, 0.01);
  EXPECT_NEAR(seen.cy, own.cy, 0.01);
}

TEST_F(O3d303Images, ASetClockIsThatOfTheFrames) {
  startO3d303(kPattern);
  auto rpc = camera();
  rpc.beginSession();
  rpc.call(rpc.session(""), "setOperatingMode", {1});
  rpc.call(rpc.session("edit/device/time/"), "setCurrentTime", {1'600'000'000});
  rpc.endSession();
  PcicClient watches{rpc.pcicPort()};
  const auto time = watches.frame().chunks.at(0).header.time;
  ASSERT_TRUE(time.has_value());
  EXPECT_NEAR(static_cast<double>(time->seconds), 1.6e9, 60.0);
}

}  // namespace
}  // namespace toftwin::daemon
