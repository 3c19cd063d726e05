// SPDX-License-Identifier: Apache-2.0
// A frame as a head of an O3R sends it, against numbers by hand and a real frame.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <numbers>
#include <vector>

#include "daemon/facades/o3r/images.h"
#include "drivers/o3d303/wire/frame_content.h"
#include "drivers/o3r/wire/confidence.h"
#include "drivers/o3r/wire/numbers.h"

namespace toftwin::daemon::o3r {
namespace {

using toftwin::o3d303::Bytes;
using toftwin::o3d303::ChunkType;
using toftwin::o3r::ChunkTypes;

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

Plane planeOfFloats(PlaneKind kind, std::vector<float> pixels) {
  const int width = static_cast<int>(pixels.size());
  return {.kind = kind,
          .type = ElementType::F32,
          .width = width,
          .height = 1,
          .channels = 1,
          .data = toftwin::Buffer::adopt(std::move(pixels))};
}
Plane planeOfBytes(PlaneKind kind, std::vector<std::uint8_t> pixels, int channels = 1) {
  const int width = static_cast<int>(pixels.size()) / channels;
  return {.kind = kind,
          .type = ElementType::U8,
          .width = width,
          .height = 1,
          .channels = channels,
          .data = toftwin::Buffer::adopt(std::move(pixels))};
}

Frame smallFrame() {
  Frame frame;
  frame.sequence = 7;
  frame.camera = {.width = 4,
                  .height = 1,
                  .fx = 100.0,
                  .fy = 100.0,
                  .cx = 1.5,
                  .cy = 0.0,
                  .distortion = {},
                  .calibration_id = {}};
  frame.planes = {planeOfFloats(PlaneKind::Range, {1.0F, kNone, 9.9999F, 12.0F}),
                  planeOfFloats(PlaneKind::Amplitude, {6000.0F, kNone, 0.0F, 60.0F}),
                  planeOfBytes(PlaneKind::Flags, {0, 1, 32, 0}),
                  planeOfBytes(PlaneKind::Exposure, {0, 0, 1, 1})};
  frame.moment.exposures = {{{.ns = 1'000}, 1000_us, 20_MHz}, {{.ns = 5'000'000}, 100_us, 20_MHz}};
  frame.moment.clock = {.host_minus_device_ns = 2'000'000'000, .uncertainty_ns = 0};
  return frame;
}
constexpr double kLongest_m = 10.0;
Scales scales() { return {.distance_resolution_m = toftwin::o3r::distanceResolution(kLongest_m)}; }

TEST(O3rImages, DistancesAreCountsOfTheResolutionAndNoneIsZero) {
  const Frame frame = smallFrame();
  const auto images = images3d(frame, lensModelsOf(frame.camera), scales(), {});
  ASSERT_TRUE(images.ok()) << images.error().message;
  EXPECT_EQ(images->distance, (std::vector<std::uint16_t>{6554, 0, 65'534, 0})) << "12 m is beyond 10";
  EXPECT_NEAR(toftwin::o3r::metresOf(6554, scales().distance_resolution_m), 1.0F, 0.5 * 10.0 / 65'535.0);
}

TEST(O3rImages, AmplitudesAreRootsOfCountsPerMicrosecond) {
  const Frame frame = smallFrame();
  const auto images = images3d(frame, lensModelsOf(frame.camera), scales(), {});
  // 6000 electrons are 1000 counts, of 1000 µs 1 a µs: 1 + √(1 / 1.5523e-8) = 8027.3 of which half a count is
  // lost.
  EXPECT_EQ(images->amplitude, (std::vector<std::uint16_t>{8027, 0, 1, 2539}));
  EXPECT_EQ(toftwin::o3r::amplitudeOf(0, 1.0F), -1.0F) << "none";
  EXPECT_EQ(toftwin::o3r::amplitudeOf(4, 2.0F), 18.0F);
}

TEST(O3rImages, ConfidenceTellsFlagsAndExposure) {
  const Frame frame = smallFrame();
  const auto images = images3d(frame, lensModelsOf(frame.camera), scales(), {});
  EXPECT_EQ(images->confidence, (std::vector<std::uint16_t>{0x30, 0x31, 0x20 | 0x80, 0x21}));
  for (int flags = 0; flags < 128; ++flags) {
    const auto one = static_cast<std::uint8_t>(flags);
    EXPECT_EQ(toftwin::o3r::flagsOf(toftwin::o3r::confidenceOf(one)), one);
  }
}

TEST(O3rImages, TimesAreThisMachinesWhereTheRelationIsKnown) {
  Frame frame = smallFrame();
  auto images = images3d(frame, lensModelsOf(frame.camera), scales(), {});
  EXPECT_EQ(images->wire.time.seconds, 2u);
  EXPECT_EQ(images->wire.time.nanoseconds, 1000u);
  EXPECT_EQ(images->wire.tof_info->exposure_starts_ns[0], 2'005'000'000u) << "the shortest comes first";
  EXPECT_EQ(images->wire.tof_info->exposures_s[1], 1e-3F);
  EXPECT_EQ(images->wire.tof_info->amplitude_factors[0], 0.01F);
  frame.moment.clock.uncertainty_ns = -1;
  frame.moment.received.ns = 77'000'000'005;
  images = images3d(frame, lensModelsOf(frame.camera), scales(), {});
  EXPECT_EQ(images->wire.time.seconds, 77u);
}

TEST(O3rImages, ADepthBecomesTheRangeAlongThePixelsRay) {
  Frame frame = smallFrame();
  frame.planes = {planeOfFloats(PlaneKind::Depth, {1.0F, 1.0F, 1.0F, 1.0F})};
  const auto images = images3d(frame, lensModelsOf(frame.camera), scales(), {});
  const double range_m = std::sqrt(1.0 + 0.015 * 0.015);
  EXPECT_EQ(images->distance[0], std::lround(range_m / static_cast<double>(scales().distance_resolution_m)));
}

// ---- TOF_INFO ------------------------------------------------------------------------------------

template <class T>
T at(const Bytes& bytes, std::size_t place) {
  return toftwin::o3d303::numberAt<T>(bytes, place);
}

TEST(O3rTofInfo, StandsWhereTheVendorsClientReadsIt) {
  toftwin::o3r::TofInfo info;
  info.distance_resolution_m = 0.5F;
  info.optic_to_user = {{1.0F, 2.0F, 3.0F}, {4.0F, 5.0F, 6.0F}};
  info.intrinsics = {.model = 2};
  info.intrinsics.parameters[0] = 7.0F;
  info.inverse_intrinsics = {.model = 9};
  info.exposure_starts_ns = {11, 12, 13};
  info.exposures_s = {14.0F, 15.0F, 16.0F};
  info.illumination_c = 17.0F;
  info.mode = "standard_range4m";
  info.imager = "IRS2381C";
  info.measurement_block = 18;
  info.most_range_m = 19.0F;
  const Bytes bytes = encode(info);
  ASSERT_EQ(bytes.size(), 428u);
  EXPECT_EQ(at<std::uint32_t>(bytes, 0x00), 4u);
  EXPECT_EQ(at<float>(bytes, 0x04), 0.5F);
  EXPECT_EQ(at<float>(bytes, 0x18), 1.0F);
  EXPECT_EQ(at<float>(bytes, 0x2C), 6.0F);
  EXPECT_EQ(at<std::uint32_t>(bytes, 0x30), 2u);
  EXPECT_EQ(at<float>(bytes, 0x34), 7.0F);
  EXPECT_EQ(at<std::uint32_t>(bytes, 0xB4), 9u);
  EXPECT_EQ(at<std::uint64_t>(bytes, 0x138), 11u);
  EXPECT_EQ(at<float>(bytes, 0x158), 16.0F);
  EXPECT_EQ(at<float>(bytes, 0x15C), 17.0F);
  EXPECT_EQ(std::memcmp(bytes.data() + 0x160, "standard_range4m", 17), 0);
  EXPECT_EQ(std::memcmp(bytes.data() + 0x180, "IRS2381C", 9), 0);
  EXPECT_EQ(at<std::uint32_t>(bytes, 0x1A0), 18u);
  EXPECT_EQ(at<float>(bytes, 0x1A8), 19.0F);
  const auto read = toftwin::o3r::readTofInfo(bytes);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(encode(*read), bytes);
  EXPECT_FALSE(toftwin::o3r::readTofInfo(std::span{bytes}.first(427)).ok());
}

TEST(O3rTofInfo, OfARealFrameIsRead) {
  const char* named = std::getenv("TOFTWIN_DATA");
  const std::string data = named != nullptr ? named : std::string{TOFTWIN_SOURCE_DIR} + "/../shared/data";
  std::ifstream in{data + "/ifm-o3r-frame/O3RBuffer.data", std::ios::binary};
  if (!in)
    in.open(std::string{TOFTWIN_SOURCE_DIR} + "/../../shared/data/ifm-o3r-frame/O3RBuffer.data",
            std::ios::binary);
  if (!in) GTEST_SKIP() << "no ifm-o3r-frame in $TOFTWIN_DATA or ../shared/data";
  const std::string all{std::istreambuf_iterator<char>{in}, {}};
  const auto content = toftwin::o3d303::readFrameContent(
      std::as_bytes(std::span{all}).subspan(4, all.size() - 6));  // ticket before, line end behind
  ASSERT_TRUE(content.ok()) << content.error().message;
  const auto* chunk = content->find(ChunkTypes::kTofInfo);
  ASSERT_NE(chunk, nullptr);
  const auto info = toftwin::o3r::readTofInfo(chunk->data);
  ASSERT_TRUE(info.ok()) << info.error().message;
  EXPECT_EQ(info->version, 1u);
  EXPECT_EQ(info->distance_resolution_m, toftwin::o3r::distanceResolution(10.0)) << "as ours by default";
  EXPECT_EQ(info->amplitude_resolution, toftwin::o3r::kAmplitudeResolution);
  EXPECT_EQ(info->intrinsics.model, 0u);
  EXPECT_EQ(info->intrinsics.parameters[0], info->inverse_intrinsics.parameters[0]);
}

// ---- lens ----------------------------------------------------------------------------------------

TEST(O3rLens, RaysOfAPinholeAreThoseOfTheCamera) {
  const CameraInfo camera{.width = 224,
                          .height = 172,
                          .fx = 124.0,
                          .fy = 123.0,
                          .cx = 110.0,
                          .cy = 85.0,
                          .distortion = {},
                          .calibration_id = {}};
  const LensModels lens = lensModelsOf(camera);
  for (const auto& [u, v] : {std::pair{0, 0}, {223, 171}, {110, 85}, {17, 140}}) {
    const auto ray = toftwin::o3r::rayOf(lens.intrinsics, u, v);
    const Vec3d ours = rayThroughPixel(camera, u, v).v;
    constexpr double kFloat = 3e-7;
    EXPECT_NEAR(ray[0], ours.x, kFloat);
    EXPECT_NEAR(ray[1], ours.y, kFloat);
    EXPECT_NEAR(ray[2], ours.z, kFloat);
  }
}

TEST(O3rLens, AFishEyesRayHasTheAngleOfItsPolynomial) {
  toftwin::o3r::LensModel lens{.model = 2};
  lens.parameters = {100.0F, 100.0F, 0.5F, 0.5F, 0.0F, 0.1F, 0.0F, 0.0F, 0.0F, 10.0F};
  const auto ray = toftwin::o3r::rayOf(lens, 50, 0);
  const double theta = 0.5 * (1.0 + 0.1 * 0.25);
  EXPECT_NEAR(ray[0], std::sin(theta), 1e-6);
  EXPECT_NEAR(ray[2], std::cos(theta), 1e-6);
  EXPECT_EQ(toftwin::o3r::rayOf({.model = 3}, 1, 1), (std::array<float, 3>{})) << "not known";
}

TEST(O3rLens, RotationIsAboutXThenYThenZOfTheTurnedAxes) {
  const float quarter = std::numbers::pi_v<float> / 2.0F;
  const auto r = rotationOf(toftwin::o3r::OpticToUser{{}, {quarter, quarter, 0.0F}});
  // Rx Ry: z goes to x by Ry, which Rx leaves.
  EXPECT_NEAR(r[2], 1.0, 1e-6);
  EXPECT_NEAR(r[3], 1.0, 1e-6) << "x goes to -z by Ry, and that to y by Rx";
}

// ---- chunks --------------------------------------------------------------------------------------

TEST(O3rSchema, ABlobThatThisHeadHasNotIsLeftOutAndAnUnknownOneIsRefused) {
  const Frame frame = smallFrame();
  const auto images = images3d(frame, lensModelsOf(frame.camera), scales(), {});
  const auto both = writeHeadFrame(
      toftwin::o3r::schemaOf({toftwin::o3r::kJpegBlob, toftwin::o3r::kConfidenceBlob}), images->wire);
  ASSERT_TRUE(both.ok());
  const auto content = toftwin::o3d303::readFrameContent(*both);
  ASSERT_TRUE(content.ok()) << content.error().message;
  ASSERT_EQ(content->chunks.size(), 1u);
  EXPECT_EQ(content->chunks[0].header.type, ChunkType::Confidence);
  EXPECT_EQ(content->chunks[0].header.frame_count, 7u);
  EXPECT_FALSE(writeHeadFrame(toftwin::o3r::schemaOf({"x_image"}), images->wire).ok());
}

TEST(O3r2d, TheColourImageIsAJpegOfThatSize) {
  Frame frame = smallFrame();
  frame.camera = {.width = 16,
                  .height = 1,
                  .fx = 100.0,
                  .fy = 100.0,
                  .cx = 7.5,
                  .cy = 0.0,
                  .distortion = {},
                  .calibration_id = {}};
  frame.planes = {planeOfBytes(PlaneKind::Color, std::vector<std::uint8_t>(48, 200), 3)};
  const auto images = images2d(frame, lensModelsOf(frame.camera), scales(), {});
  ASSERT_TRUE(images.ok()) << images.error().message;
  ASSERT_GT(images->jpeg.size(), 4u);
  EXPECT_EQ(images->jpeg[0], std::byte{0xFF});
  EXPECT_EQ(images->jpeg[1], std::byte{0xD8});
  EXPECT_EQ(images->wire.width, 16u);
  EXPECT_EQ(encode(*images->wire.rgb_info).size(), 308u);
  EXPECT_FALSE(images2d(smallFrame(), lensModelsOf(frame.camera), scales(), {}).ok()) << "no colour";
}

}  // namespace
}  // namespace toftwin::daemon::o3r
