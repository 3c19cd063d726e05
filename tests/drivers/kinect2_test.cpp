// SPDX-License-Identifier: Apache-2.0
// The driver on an emulated bus: opening, frames, what is lost, parameters. That it speaks libusb's language
// is for tests/kernel to show.
#include "drivers/kinect2/kinect2.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "calib/file/calibration_file.h"
#include "drivers/compliance.h"
#include "drivers/kinect2/samples.h"
#include "emulated_kinect2_bus.h"
#include "start_stop.h"

namespace toftwin::test {
namespace {

using namespace drivers::kinect2;
using testing::HasSubstr;

constexpr const char* kUri = "kinect2:003370163847";

Result<std::unique_ptr<drivers::Source>> openWith(Bus& bus, const std::string& keys = {},
                                                  const std::string& uri = kUri) {
  auto table = settings::Table::parse(fmt::format("uri = '{}'\n{}", uri, keys), "kinect2.toml");
  return openOn(bus, *table);
}

std::unique_ptr<drivers::Source> started(Bus& bus, const std::string& keys = {}) {
  auto opened = openWith(bus, keys);
  EXPECT_TRUE(opened.ok()) << opened.error().message;
  if (!opened) return nullptr;
  const auto begun = (*opened)->start();
  EXPECT_TRUE(begun.ok()) << begun.error().message;
  return begun ? *std::move(opened) : nullptr;
}

Result<Frame> nextFrame(drivers::Source& source) {
  for (int i = 0; i < 5; ++i) {
    Result<Frame> frame = source.next({}, false);
    if (frame || frame.error().code != Error::Code::Timeout) return frame;
  }
  return Error{Error::Code::Timeout, "no frame for long"};
}

/// The camera's number of a frame with the plane samples: in the first image at (1, 0), mirrored.
std::uint32_t numberOf(const Frame& frame, bool is_mirrored = true) {
  const auto samples = frame.find(PlaneKind::Samples)->as<float>();
  return codeOf(samples[is_mirrored ? kWidth - 2 : 1]);
}

TEST(Kinect2, IsFoundByItsSerialItsPortOrAny) {
  EmulatedKinect2Bus bus;
  EXPECT_EQ(listOn(bus), std::vector<std::string>{kUri});
  for (const char* uri : {kUri, "kinect2:2-1.4", "kinect2:any"}) {
    const auto opened = openWith(bus, {}, uri);
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    EXPECT_EQ((*opened)->info().serial, "003370163847");
  }
  EXPECT_THAT(openWith(bus, {}, "kinect2:42").error().message,
              HasSubstr("no camera kinect2:42; there are: kinect2:0033"));
  bus.unplug();
  EXPECT_THAT(openWith(bus).error().message, HasSubstr("power supply"));
  EXPECT_TRUE(listOn(bus).empty());
}

TEST(Kinect2, IsCompliant) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "so slow an emulated camera does not keep up with its own clock";
#endif
  static EmulatedKinect2Bus bus;
  drivers::Driver driver = row();
  driver.open = [](settings::Table& table) { return openOn(bus, table); };
  int passed = 0;
  for (const drivers::Finding& finding : drivers::checkCompliance(drivers::listedCamera(driver, kUri))) {
    EXPECT_NE(finding.outcome, drivers::Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
    passed += finding.outcome == drivers::Finding::Outcome::Passed ? 1 : 0;
  }
  EXPECT_GE(passed, 9);
}

TEST(Kinect2, FramesAreOfTheWallThatItSeesAndOneAfterTheOther) {
  EmulatedKinect2Bus bus;
  const auto source =
      started(bus, "planes = ['range', 'depth', 'amplitude', 'flags', 'samples', 'phasors']\ndelay_ms = 20");
  ASSERT_NE(source, nullptr);
  std::optional<std::uint32_t> last;
  for (int i = 0; i < 10; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    const std::uint32_t number = numberOf(*frame);
    if (last && number > *last) {
      EXPECT_EQ(number - *last, 1 + frame->dropped_by_device);
    }
    last = number;
    ASSERT_EQ(frame->planes.size(), 6u);
    EXPECT_EQ(frame->find(PlaneKind::Samples)->channels, 9);
    EXPECT_EQ(frame->find(PlaneKind::Phasors)->channels, 6);
    const auto depth_m = frame->find(PlaneKind::Depth)->as<float>();
    // The wall of imagesOfWall, 600 counts: steps of 4, so three times worse than 2000 with steps of 8 ÷ 2 …
    // each sample off by 2, a phasor by 2/3 · 2 · 2, three frequencies, times 110.5 mm: 1.5 mm.
    EXPECT_NEAR(depth_m[200 * kWidth + 300], 2.0F, 1.5e-3F);
    ASSERT_EQ(frame->moment.exposures.size(), 3u);
    EXPECT_EQ(frame->moment.exposures[2].modulation, 120_MHz);
  }
}

TEST(Kinect2, LeftIsLeftUnlessAskedFor) {
  EmulatedKinect2::Options options;
  options.images = imagesOfWall(options.lens, 2.0);
  // A dark stripe at the side that the camera sends as its left.
  sim::Samples samples = samplesOf(std::span{options.images}.first(kUsedImages * kImageBytes));
  for (auto& image : samples.electrons) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < 50; ++x) image(x, y) = 0.0F;
    }
  }
  options.images = imagesOf(samples);
  EmulatedKinect2Bus bus{options};
  for (const bool mirror : {false, true}) {
    const auto source = started(bus, fmt::format("mirror = {}\nplanes = ['range', 'samples']", mirror));
    ASSERT_NE(source, nullptr);
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    const auto range_m = frame->find(PlaneKind::Range)->as<float>();
    EXPECT_EQ(std::isnan(range_m[100 * kWidth + 20]), mirror);
    EXPECT_EQ(std::isnan(range_m[100 * kWidth + 491]), !mirror);
    EXPECT_EQ(numberOf(*frame, !mirror), 65'530u % EmulatedKinect2::kNumberCodes);
    // Wherever a pixel is, its ray and its range give the wall.
    const CameraInfo& camera = source->info().camera;
    EXPECT_NEAR(camera.cx, mirror ? 254.0022 : 511 - 254.0022, 1e-4);
    for (const int x : {100, 256, 400}) {
      const double z = rayThroughPixel(camera, x, 50).v.z;
      EXPECT_NEAR(static_cast<double>(range_m[50 * kWidth + static_cast<std::size_t>(x)]) * z, 2.0, 1.5e-3);
    }
  }
}

TEST(Kinect2, ACalibrationOfOnesOwnTakesThePlaceOfTheFactorys) {
  calibration::CalibrationFile file;
  file.lens = {.width = kWidth,
               .height = kHeight,
               .fx = 361,
               .fy = 362,
               .cx = 240,
               .cy = 205,
               .distortion = {0.09, -0.2, 0.01, 0.02, 0}};
  const auto path =
      std::filesystem::path{testing::TempDir()} / fmt::format("kinect2-lens-{}.toml", ::getpid());
  std::ofstream{path} << calibration::toText(file);
  EmulatedKinect2Bus bus;
  for (const bool mirror : {false, true}) {
    const auto source =
        started(bus, fmt::format("calibration = '{}'\nmirror = {}", path.string(), mirror));
    ASSERT_NE(source, nullptr);
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    const CameraInfo expected = calibration::cameraOf(file.lens);
    EXPECT_EQ(frame->camera.cx, 240.0);
    EXPECT_EQ(frame->camera.distortion, expected.distortion);
    EXPECT_EQ(frame->provenance.calibration_id, expected.calibration_id);
    // What is decoded with it agrees: depth is the part of the range along the axis.
    const auto range_m = frame->find(PlaneKind::Range)->as<float>();
    const auto depth_m = frame->find(PlaneKind::Depth)->as<float>();
    for (const int x : {60, 256, 450}) {
      const auto at = 80 * kWidth + static_cast<std::size_t>(x);
      EXPECT_NEAR(static_cast<double>(depth_m[at] / range_m[at]),
                  rayThroughPixel(expected, x, 80).v.z, 1e-6);
    }
  }
  std::filesystem::remove(path);
  EXPECT_THAT(openWith(bus, "calibration = 'nowhere.toml'").error().message,
              HasSubstr("nowhere.toml"));
}

TEST(Kinect2, WhatIsLostIsCountedInTheNextFrame) {
  EmulatedKinect2Bus bus;
  const auto source = started(bus, "planes = ['samples']");
  ASSERT_NE(source, nullptr);
  auto frame = nextFrame(*source);
  ASSERT_TRUE(frame.ok());
  std::uint32_t last = numberOf(*frame);
  std::uint64_t lost = 0, steps = 0;
  std::string because;
  bus.device().losePackets(2);
  for (int i = 0; i < 12; ++i) {
    if (i == 3) bus.device().shortenImages(1);
    if (i == 6) bus.device().skipFrames(4);
    frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    const std::uint32_t number = numberOf(*frame);
    lost += frame->dropped_by_device;
    because += frame->dropped_because + ";";
    EXPECT_EQ(frame->dropped_because.empty(), frame->dropped_by_device == 0) << frame->dropped_because;
    // 65535 is followed by 0, the codes 535 by 0.
    steps += number > last ? number - last - 1 : number + 536 - last - 1;
    last = number;
  }
  EXPECT_EQ(lost, steps);
  for (const char* why : {"2 packets that the bus did not deliver", "1 image of another length", "frames that never came"})
    EXPECT_NE(because.find(why), std::string::npos) << why << " is not in " << because;
  EXPECT_GE(lost, 6u) << "one for the packets, one for the short image, four that never came";
}

TEST(Kinect2, IsTakenThroughTheStepsThatAreKnownToWork) {
  EmulatedKinect2Bus bus;
  bus.device().notReadyFor(2);
  {
    const auto source = started(bus);
    ASSERT_NE(source, nullptr);
    EXPECT_TRUE(bus.device().isStreaming());
    EXPECT_TRUE(nextFrame(*source).ok());
    source->stop();
    EXPECT_FALSE(bus.device().isStreaming());
    EXPECT_TRUE(bus.isOpen());
  }
  EXPECT_FALSE(bus.isOpen());
  using enum Code;
  EXPECT_THAT(bus.device().seen(),
              testing::ElementsAre(FirmwareVersions, HardwareInfo, DataPage, DataPage,  // open
                                   DataPage, SetMode, SetMode, Status, Status, Status, InitStreams, Status,
                                   SetStreaming, SetMode, SetMode, Stop, SetStreaming, SetMode, SetMode,
                                   SetMode, SetMode,  // stop
                                   SetMode, SetMode, Shutdown));
}

TEST(Kinect2, ThatIsNeverReadySaysSo) {
  EmulatedKinect2Bus bus;
  bus.device().notReadyFor(1'000'000);
  const auto opened = openWith(bus);
  ASSERT_TRUE(opened.ok());
  EXPECT_THAT((*opened)->start().error().message, HasSubstr("not ready to stream (status 0x2200)"));
}

TEST(Kinect2, ThatDoesNotAnswerIsAnErrorAndIsLeftAlone) {
  EmulatedKinect2Bus bus;
  bus.device().hang(true);
  const auto opened = openWith(bus);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, Error::Code::Timeout);
  EXPECT_FALSE(bus.isOpen());
  bus.device().hang(false);
  EXPECT_TRUE(openWith(bus).ok());
}

TEST(Kinect2, ThatIsUnpluggedIsDisconnectedAtOnce) {
  EmulatedKinect2Bus bus;
  const auto source = started(bus);
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  bus.unplug();
  for (int i = 0; i < 10; ++i) {  // what is in the queue still comes, and what was under way
    const auto frame = source->next({}, false);
    if (frame) continue;
    EXPECT_EQ(frame.error().code, Error::Code::Disconnected);
    return;
  }
  FAIL() << "frames still come";
}

TEST(Kinect2, ParametersChangeWhatIsDecoded) {
  EmulatedKinect2Bus bus;
  const auto source = started(bus);
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(source->setParameter("nearest_m", 2.5).ok());
  auto frame = nextFrame(*source);
  ASSERT_TRUE(frame.ok());
  const std::size_t middle = std::size_t{200} * kWidth + 256;
  EXPECT_EQ(frame->find(PlaneKind::Flags)->as<std::uint8_t>()[middle],
            static_cast<unsigned>(PixelFlag::Invalid) | static_cast<unsigned>(PixelFlag::OutOfRange));
  EXPECT_EQ(source->state().parameters[0].value, 2.5);
  EXPECT_THAT(source->setParameter("nearest_m", 1e3).error().message, HasSubstr("out of bounds"));
  EXPECT_THAT(source->setParameter("edge_filter", 0.5).error().message, HasSubstr("0 or 1"));
  EXPECT_THAT(source->setParameter("gain", 1).error().message, HasSubstr("it has: nearest_m, farthest_m"));
}

TEST(Kinect2, KeysThatMakeNoSenseAreNamed) {
  EmulatedKinect2Bus bus;
  EXPECT_THAT(
      openWith(bus, "planes = ['colour', 'range', 'range']").error().message,
      testing::AllOf(HasSubstr("\"colour\", which a Kinect v2 does not have"), HasSubstr("\"range\" twice")));
  EXPECT_THAT(openWith(bus, "nearest_m = 5\nfarthest_m = 4").error().message,
              HasSubstr("less than farthest_m"));
}

TEST(Kinect2, DeviceTimeIsItsOwnClockOverAWrapOfItsStamps) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "so slow an emulated camera does not keep up with its own clock";
#endif
  EmulatedKinect2::Options options;
  options.first_stamp = 0xFFFF'FFFFU - 5 * 267;
  EmulatedKinect2Bus bus{options};
  const auto source = started(bus, "planes = ['samples']\ndelay_ms = 20");
  ASSERT_NE(source, nullptr);
  std::optional<std::int64_t> last_ns;
  std::uint32_t last_number = 0;
  std::int64_t uncertainty_ns = -1;
  for (int i = 0; i < 15; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok());
    const std::int64_t now_ns = frame->moment.exposures[0].start.ns;
    const std::uint32_t number = numberOf(*frame);
    if (last_ns) {
      const std::uint32_t frames = (number + 536 - last_number) % 536;
      EXPECT_EQ(now_ns - *last_ns, std::int64_t{frames} * 267 * 125'000);
    }
    last_ns = now_ns;
    last_number = number;
    uncertainty_ns = frame->moment.clock.uncertainty_ns;
  }
  EXPECT_GE(uncertainty_ns, 0);
}

TEST(Kinect2, OpensAndClosesAHundredTimesAndKeepsNothing) {
  EmulatedKinect2Bus bus;
  bus.interval_us() = 1000;
  for (int i = 0; i < 100; ++i) {
    const auto source = started(bus);
    ASSERT_NE(source, nullptr) << i;
  }
  EXPECT_FALSE(bus.isOpen());
}

TEST(Kinect2, StartsAndStopsKeepNothing) {
  EmulatedKinect2Bus bus;
  bus.interval_us() = bus.first_us() = 2000;  // no frame where none is fetched
  const auto source = openWith(bus, "planes = ['samples']");
  ASSERT_TRUE(source.ok()) << source.error().message;
  expectNothingKept("kinect2", **source, 500);
}

// Fewer, for it decodes: a block of 16 bytes at each would be 8 kB.
TEST(Kinect2, StartsAndStopsOfWhatIsDecodedKeepNothing) {
  EmulatedKinect2Bus bus;
  bus.interval_us() = bus.first_us() = 2000;
  const auto source = openWith(bus);
  ASSERT_TRUE(source.ok()) << source.error().message;
  expectNothingKept("kinect2", **source, 100, 500);
}

}  // namespace
}  // namespace toftwin::test
