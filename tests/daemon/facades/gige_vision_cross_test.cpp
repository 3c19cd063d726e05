// SPDX-License-Identifier: Apache-2.0
// One truth: the same frame, natively and through GigE Vision, read by our own driver of such cameras.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "calib/file/calibration_file.h"
#include "drivers/aravis/aravis.h"
#include "drivers/compliance.h"
#include "gige_vision_testing.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using Policy = SubscribeOptions::Policy;

class GigeVisionCross : public RunningGigeVision {
 protected:
  Result<std::unique_ptr<drivers::Source>> openDriver(const std::string& keys) {
    auto table = settings::Table::parse(fmt::format("uri = 'aravis:{}'\n{}", address_, keys), "driver.toml");
    EXPECT_TRUE(table.ok());
    return drivers::aravis::row().open(*table);
  }
  /// Frames of the driver with the native ones of the same device time.
  template <class Compare>
  void compare(const std::string& keys, Compare compare_frames) {
    auto native_client = client();
    auto driver = openDriver(keys);
    ASSERT_TRUE(driver.ok()) << driver.error().message;
    auto native_stream = native_client.subscribe("cam", {.policy = Policy::Queue, .queue = 64});
    ASSERT_TRUE(native_stream.ok()) << native_stream.error().message;
    ASSERT_TRUE((*driver)->start().ok());
    Natives natives{*std::move(native_stream), deviceTimeOf};
    int compared = 0;
    for (int i = 0; i < 60 && compared < 4; ++i) {
      const auto through = nextFrame(**driver);
      ASSERT_TRUE(through.ok()) << through.error().message;
      const auto native = natives.at(deviceTimeOf(*through));
      ASSERT_TRUE(native.ok()) << native.error().message;
      if (*native == nullptr) continue;
      ASSERT_NO_FATAL_FAILURE(compare_frames(**native, *through));
      ++compared;
    }
    EXPECT_EQ(compared, 4);
    (*driver)->stop();
  }
};

/// What docs/facades/gige_vision.md says becomes of a range, and what the driver makes of that.
float rangeThroughC16(float range_m) {
  const double count = std::round(1000.0 * static_cast<double>(range_m) / 0.5);
  return count >= 1.0 && count <= 65'535.0 ? static_cast<float>(0.5 * count * 1e-3) : std::nanf("");
}
float rangeThroughC32f(float range_m) {
  return static_cast<float>(static_cast<double>(static_cast<float>(1000.0 * static_cast<double>(range_m))) *
                            1e-3);
}

template <class Convert>
void expectSame(const Frame& native, const Frame& through, Convert convert) {
  const auto range_m = native.find(PlaneKind::Range)->as<float>();
  const auto amplitude = native.find(PlaneKind::Amplitude)->as<float>();
  const auto flags = native.find(PlaneKind::Flags)->as<std::uint8_t>();
  const auto range_got = through.find(PlaneKind::Range)->as<float>();
  const auto amplitude_got = through.find(PlaneKind::Amplitude)->as<float>();
  const auto flags_got = through.find(PlaneKind::Flags)->as<std::uint8_t>();
  ASSERT_EQ(range_got.size(), range_m.size());
  std::size_t with_value = 0;
  for (std::size_t i = 0; i < range_m.size(); ++i) {
    const bool is_invalid = (flags[i] & 1U) != 0;
    ASSERT_EQ((flags_got[i] & 1U) != 0, is_invalid) << i;
    ASSERT_EQ(amplitude_got[i], std::fmin(65'535.0F, std::round(std::fmax(0.0F, amplitude[i])))) << i;
    ASSERT_EQ(std::isnan(range_got[i]), is_invalid) << i;
    if (is_invalid) continue;
    ++with_value;
    ASSERT_EQ(range_got[i], convert(range_m[i])) << i;
  }
  EXPECT_GT(with_value, range_m.size() / 2);
}

TEST_F(GigeVisionCross, FloatsAreTheNativeOnesBitForBitWithTheirTimeStamps) {
  startGige(kSmallSim);
  compare(
      "components = ['Range', 'Intensity', 'Confidence']\npixel_format = 'Coord3D_C32f'\n"
      "set = ['Scan3dCoordinateSystem = Spherical']",
      [](const Frame& native, const Frame& through) { expectSame(native, through, rangeThroughC32f); });
}

TEST_F(GigeVisionCross, CountsAreTheNativeFloatsRoundedAsDocumented) {
  startGige(kSmallSim);
  compare(
      "components = ['Range', 'Intensity', 'Confidence']\npixel_format = 'Coord3D_C16'\n"
      "set = ['Scan3dCoordinateSystem = Spherical']",
      [](const Frame& native, const Frame& through) { expectSame(native, through, rangeThroughC16); });
}

TEST_F(GigeVisionCross, PointsAreTheNativeRangesAlongTheirRays) {
  startGige(kSmallSim);
  compare("components = ['Range', 'Confidence']\npixel_format = 'Coord3D_ABC32f'", [](const Frame& native,
                                                                                      const Frame& through) {
    const auto range_m = native.find(PlaneKind::Range)->as<float>();
    const auto range_got = through.find(PlaneKind::Range)->as<float>();
    const auto depth_got = through.find(PlaneKind::Depth)->as<float>();
    for (std::size_t i = 0; i < range_m.size(); ++i) {
      ASSERT_EQ(std::isnan(range_got[i]), std::isnan(range_m[i])) << i;
      if (std::isnan(range_m[i])) continue;
      const auto u = static_cast<double>(i % 176), v = static_cast<double>(i / 176);
      // Three floats of 6e-8 each in the ray, and three in the point.
      const double z = rayThroughPixel(native.camera, u, v).v.z;
      ASSERT_NEAR(range_got[i], range_m[i], 4e-7 * static_cast<double>(range_m[i])) << i;
      ASSERT_NEAR(depth_got[i], static_cast<double>(range_m[i]) * z, 4e-7 * static_cast<double>(range_m[i]))
          << i;
    }
  });
}

TEST_F(GigeVisionCross, FeaturesAreReadAndSetByNameThroughTheProtocol) {
  startGige(kSmallSim, "",
            "[[source]]\nname = 'gige'\ndriver = 'aravis'\nuri = 'aravis:{}'\n"
            "parameters = ['Scan3dCoordinateSystem', 'PtpEnable', 'AcquisitionFrameRate']\n");
  auto native = client();
  Result<SourceDetails> details = Error{Error::Code::Timeout, ""};
  ASSERT_TRUE(eventually([&] { return (details = native.describe("gige")).ok(); }))
      << details.error().message;
  ASSERT_EQ(details->parameters.size(), 3U);
  EXPECT_EQ(details->parameters[0].text, "Cartesian");
  EXPECT_THAT(details->parameters[0].choices, testing::UnorderedElementsAre("Cartesian", "Spherical"));
  EXPECT_EQ(details->parameters[1].text, "false");
  EXPECT_FALSE(details->parameters[2].text);
  for (const auto& [name, text] : {std::pair{"Scan3dCoordinateSystem", "Spherical"}, {"PtpEnable", "true"}}) {
    const auto set = native.setParameter("gige", name, text);
    EXPECT_TRUE(set.ok()) << set.error().message;
  }
  details = native.describe("gige");
  ASSERT_TRUE(details.ok());
  EXPECT_EQ(details->parameters[0].text, "Spherical");
  EXPECT_EQ(details->parameters[1].text, "true");
  EXPECT_EQ(details->parameters[1].value, 1.0);
  const auto unknown = native.setParameter("gige", "Scan3dCoordinateSystem", "Cylindrical");
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().code, Error::Code::InvalidArgument);
  EXPECT_THAT(unknown.error().message, testing::HasSubstr("Spherical"));
}

TEST_F(GigeVisionCross, CountsOfPointsAreWithinHalfACountOfThem) {
  startGige(kSmallSim);
  compare("components = ['Range']\npixel_format = 'Coord3D_ABC16'",
          [](const Frame& native, const Frame& through) {
            const auto range_m = native.find(PlaneKind::Range)->as<float>();
            const auto range_got = through.find(PlaneKind::Range)->as<float>();
            for (std::size_t i = 0; i < range_m.size(); ++i) {
              ASSERT_EQ(std::isnan(range_got[i]), std::isnan(range_m[i])) << i;
              if (std::isnan(range_m[i])) continue;
              // Half a count of 0.5 mm in each of three coordinates.
              ASSERT_NEAR(range_got[i], range_m[i], 0.25e-3 * std::sqrt(3.0) + 1e-6) << i;
            }
          });
}

TEST_F(GigeVisionCross, DepthIsTheNativeOneBitForBit) {
  startGige(kSmallSim);
  compare("components = ['Range']\npixel_format = 'Coord3D_C32f'",
          [](const Frame& native, const Frame& through) {
            ASSERT_NE(native.find(PlaneKind::Depth), nullptr);
            const auto depth_m = native.find(PlaneKind::Depth)->as<float>();
            const auto depth_got = through.find(PlaneKind::Depth)->as<float>();
            for (std::size_t i = 0; i < depth_m.size(); ++i) {
              ASSERT_EQ(std::isnan(depth_got[i]), std::isnan(depth_m[i])) << i;
              if (std::isnan(depth_m[i])) continue;
              ASSERT_EQ(depth_got[i], rangeThroughC32f(depth_m[i])) << i;
            }
          });
}

constexpr int kX = 40, kY = 24, kWidth = 88, kHeight = 66;  // half of 176 x 132, and not its middle
const std::string kRegion = fmt::format("'Width = {}', 'Height = {}', 'OffsetX = {}', 'OffsetY = {}'", kWidth, kHeight, kX, kY);

/// A lens of the whole image, as a person calibrated it.
std::filesystem::path calibrationOf(const CameraInfo& camera, const std::filesystem::path& file) {
  calibration::CalibrationFile made;
  made.lens = {camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, camera.distortion};
  std::ofstream{file} << calibration::toText(made);
  return file;
}

TEST_F(GigeVisionCross, OfARegionTheLensIsThatPartOfIt) {
  startGige(kSmallSim);
  const CameraInfo whole = client().describe("cam")->camera;
  const auto file = calibrationOf(whole, folder_ / "lens.toml");
  const std::string table = fmt::format("lens.width = {}\nlens.height = {}\nlens.fx = {}\nlens.cx = {}\nlens.cy = {}\n",
                                        whole.width, whole.height, whole.fx, whole.cx, whole.cy);
  for (const std::string& lens : {std::string{}, fmt::format("calibration = '{}'\n", file.string()), table}) {
    SCOPED_TRACE(lens.empty() ? "as the camera says it" : lens);
    const auto driver =
        openDriver(fmt::format("{}components = ['Range']\npixel_format = 'Coord3D_C32f'\nset = [{}]", lens, kRegion));
    ASSERT_TRUE(driver.ok()) << driver.error().message;
    const CameraInfo got = (*driver)->info().camera;
    EXPECT_EQ(got.width, kWidth);
    EXPECT_EQ(got.height, kHeight);
    EXPECT_NEAR(got.fx, whole.fx, 1e-4) << "a crop magnifies nothing";
    EXPECT_NEAR(got.cx, whole.cx - kX, 1e-4);
    EXPECT_NEAR(got.cy, whole.cy - kY, 1e-4);
    EXPECT_EQ(got.calibration_id.size(), 32u);
  }
  {
    const auto driver =
        openDriver(fmt::format("lens.width = {}\nlens.height = {}\nlens.field_of_view_deg = 60\nset = [{}]",
                               whole.width, whole.height, kRegion));
    ASSERT_TRUE(driver.ok()) << driver.error().message;
    const CameraInfo got = (*driver)->info().camera;
    EXPECT_NEAR(got.fx, whole.width / 2.0 / std::tan((30_deg).in(radian)), 1e-9) << "of the whole image";
    EXPECT_NEAR(got.cx, (whole.width - 1) / 2.0 - kX, 1e-9);
    EXPECT_NEAR(got.cy, (whole.height - 1) / 2.0 - kY, 1e-9);
  }
  // Ranges that the driver makes of depth by that lens are the native ones of those pixels.
  compare(fmt::format("calibration = '{}'\ncomponents = ['Range']\npixel_format = 'Coord3D_C32f'\nset = [{}]",
                      file.string(), kRegion),
          [](const Frame& native, const Frame& through) {
            const auto range_m = native.find(PlaneKind::Range)->as<float>();
            const auto range_got = through.find(PlaneKind::Range)->as<float>();
            ASSERT_EQ(range_got.size(), std::size_t{kWidth} * kHeight);
            for (std::size_t i = 0; i < range_got.size(); ++i) {
              const double m = static_cast<double>(range_m[(kY + i / kWidth) * 176 + kX + i % kWidth]);
              ASSERT_EQ(std::isnan(range_got[i]), std::isnan(m)) << i;
              if (std::isnan(m)) continue;
              ASSERT_NEAR(static_cast<double>(range_got[i]), m, 4e-7 * m) << i;  // floats, as above
            }
          });
}

TEST_F(GigeVisionCross, OfARegionALensOfAnotherSizeIsRefused) {
  startGige(kSmallSim);
  // Of the same shape: taken for binning, it would halve the focal length.
  const auto driver = openDriver(fmt::format("lens.width = 352\nlens.height = 264\nlens.fx = 300\nset = [{}]", kRegion));
  ASSERT_FALSE(driver.ok());
  EXPECT_EQ(driver.error().code, Error::Code::Incompatible);
  EXPECT_NE(driver.error().message.find("88 x 66 from (40, 24) on of 176 x 132"), std::string::npos)
      << driver.error().message;
}

TEST_F(GigeVisionCross, IsCompliantThroughOurDriver) {
  startGige(kSmallSim);
  const drivers::Driver driver = drivers::aravis::row();
  const drivers::Candidate candidate{.driver = &driver,
                                     .keys = fmt::format("uri = 'aravis:{}'", address_),
                                     .absent_keys = "uri = 'aravis:127.0.0.78'",
                                     .absent_name = "aravis:127.0.0.78"};
  for (const drivers::Finding& finding : drivers::checkCompliance(candidate)) {
    EXPECT_NE(finding.outcome, drivers::Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
  }
}

TEST_F(GigeVisionCross, ADaemonWhoseSourceIsItsOwnFacadeEndsAtOnce) {
  startGige(kSmallSim, {}, "[[source]]\nname = 'again'\ndriver = 'aravis'\nuri = 'aravis:{}'\n");
  ASSERT_TRUE(log_->waitFor("again: opened", 1));
  {
    auto native = client();
    auto stream = native.subscribe("again", {});
    ASSERT_TRUE(stream.ok()) << stream.error().message;
    ASSERT_TRUE(stream->next(kSoon).ok());
  }
  const auto asked_at = std::chrono::steady_clock::now();
  stop();
  const auto took = std::chrono::steady_clock::now() - asked_at;
  EXPECT_LT(took, std::chrono::milliseconds{1000}) << "the library waits 12.5 s for a camera that is gone";
}

TEST_F(GigeVisionCross, IsFoundByOurDriverBySerialNumber) {
  startGige(kSmallSim);
  auto table = settings::Table::parse(fmt::format("uri = 'aravis:{}'", name_), "driver.toml");
  const auto driver = drivers::aravis::row().open(*table);
  ASSERT_TRUE(driver.ok()) << driver.error().message;
  EXPECT_EQ((*driver)->info().serial, name_);
}

TEST_F(GigeVisionCross, SaysThatTheSourceLostFrames) {
  startGige(kSmallSim + "[[source.fault]]\nkind = 'loss'\nfirst = 4\nframes = 2\nevery = 8\n");
  auto driver = openDriver("");
  ASSERT_TRUE(driver.ok()) << driver.error().message;
  ASSERT_TRUE((*driver)->start().ok());
  std::uint64_t lost = 0;
  for (int i = 0; i < 12; ++i) {
    const auto frame = nextFrame(**driver);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    lost += frame->dropped_by_device;
  }
  // Twelve frames are at least one and at most three gaps of two; a busy computer may lose some more.
  EXPECT_GE(lost, 2U);
  (*driver)->stop();
}

TEST_F(GigeVisionCross, GoesOnWhenItsSourceWasAway) {
  startGige(kSmallSim + "[[source.fault]]\nkind = 'disconnect'\nfirst = 4\noutage_s = 0.5\n");
  auto driver = openDriver("");
  ASSERT_TRUE(driver.ok()) << driver.error().message;
  ASSERT_TRUE((*driver)->start().ok());
  for (int i = 0; i < 10; ++i) {
    const auto frame = nextFrame(**driver);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
  }
  EXPECT_EQ(client().health()->sources.at(0).reconnects, 1U);
  (*driver)->stop();
}

TEST_F(GigeVisionCross, LosesNoFrameOnALineThatLosesTwoPercent) {
  // A simulator that a busy computer makes late loses frames of its own.
  startGige("driver = 'pattern'\nwidth = 176\nheight = 132\nframe_rate_hz = 20\n",
            "[facade.line]\nloss = 0.02\nseed = 11\nlog = 'line.csv'");
  auto driver = openDriver("frame_retention_ms = 2000");
  ASSERT_TRUE(driver.ok()) << driver.error().message;
  ASSERT_TRUE((*driver)->start().ok());
  std::uint64_t lost = 0;
  for (int i = 0; i < 20; ++i) {
    const auto frame = nextFrame(**driver);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    lost += frame->dropped_by_device;
  }
  EXPECT_LE(lost, client().health()->sources.at(0).dropped_by_device) << "the line lost some";
  (*driver)->stop();
  // Of 20 frames of 30 packets at least, some were lost, and came when they were asked for: which ones is a
  // function of the seed.
  std::ifstream log{folder_ / "line.csv"};
  const std::string text{std::istreambuf_iterator<char>{log}, {}};
  EXPECT_NE(text.find(",loss,block "), std::string::npos) << text;
}

}  // namespace
}  // namespace toftwin::daemon
