// SPDX-License-Identifier: Apache-2.0
// The driver with the real library: a device of ours inside it, the library's own Dummy device, and
// files that the library's recorder writes.
#include "drivers/openni2/openni2.h"

#include <gtest/gtest.h>
#include <malloc.h>
#include <openni2/OniCAPI.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

#include "drivers/compliance.h"
#include "openni2_device.h"
#include "start_stop.h"

namespace toftwin::drivers::openni2 {
namespace {

using test::emulatedDevice;
using Emulated = test::EmulatedOpenNI2;
using std::chrono::milliseconds;

constexpr const char* kEmulated = "uri = 'openni2:emulated/0'\n";

Result<std::unique_ptr<Source>> openWith(const std::string& keys) {
  auto table = settings::Table::parse(keys, "openni2.toml");
  EXPECT_TRUE(table.ok()) << table.error().message;
  return row().open(*table);
}
std::unique_ptr<Source> started(const std::string& keys) {
  auto opened = openWith(keys);
  EXPECT_TRUE(opened.ok()) << opened.error().message;
  if (!opened) return nullptr;
  const auto begun = (*opened)->start();
  EXPECT_TRUE(begun.ok()) << begun.error().message;
  return begun ? *std::move(opened) : nullptr;
}
Result<Frame> nextFrame(Source& source) {
  for (int i = 0; i < 20; ++i) {
    Result<Frame> frame = source.next({}, false);
    if (frame || frame.error().code != Error::Code::Malformed) return frame;
  }
  return Error{Error::Code::Timeout, "no frame for long"};
}
std::int64_t timeOf(const Frame& frame) { return frame.moment.exposures.at(0).start.ns; }

/// Which frame it is, by the last pixel of depth.
std::int64_t countIn(const Frame& frame, const Emulated&) {
  const auto depth_m = frame.find(PlaneKind::Depth)->as<float>();
  const auto code = std::lround(depth_m.back() * 1000.0F);
  return ((code - 1000) / 10 + 512 - (Emulated::kWidth + Emulated::kHeight - 2)) % 256;
}

class OpenNI2 : public testing::Test {
 protected:
  void TearDown() override {
    device_.rate_hz = Emulated::kRate_hz;
    EXPECT_EQ(device_.running_streams, 0) << "no thread outlives its source";
    EXPECT_EQ(device_.open_streams, 0);
  }
  Emulated& device_ = emulatedDevice();
};

TEST_F(OpenNI2, AFrameIsWhatTheDeviceSentInOurUnits) {
  const auto source = started(kEmulated);
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().model, "toftwin emulated");
  EXPECT_EQ(source->info().serial, "EMU-0001");
  const auto frame = nextFrame(*source);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  const std::int64_t n = countIn(*frame, device_);
  const auto range_m = frame->find(PlaneKind::Range)->as<float>();
  const auto depth_m = frame->find(PlaneKind::Depth)->as<float>();
  const auto amplitude = frame->find(PlaneKind::Amplitude)->as<float>();
  const auto flags = frame->find(PlaneKind::Flags)->as<std::uint8_t>();
  // tan of half the field of view is half the width in focal lengths; the property is a float.
  EXPECT_NEAR(frame->camera.fx, Emulated::kWidth / 2.0 / std::tan(Emulated::kFieldOfView_rad / 2),
              1e-4);
  std::size_t i = 0;
  for (int y = 0; y < Emulated::kHeight; ++y) {
    for (int x = 0; x < Emulated::kWidth; ++x, ++i) {
      const std::uint16_t sent = Emulated::depthAt(n, x, y);
      ASSERT_EQ(amplitude[i], static_cast<float>(Emulated::infraredAt(x, y)));
      ASSERT_EQ(flags[i], sent == 0 ? 1 : 0);
      if (sent == 0) {
        ASSERT_TRUE(std::isnan(range_m[i]) && std::isnan(depth_m[i]));
        continue;
      }
      ASSERT_EQ(depth_m[i], static_cast<float>(sent) * 1e-3F);
      ASSERT_NEAR(range_m[i] * rayThroughPixel(frame->camera, x, y).v.z, depth_m[i], 1e-5);
    }
  }
}

TEST_F(OpenNI2, ColorComesWithItsDepthImage) {
  const auto source = started(fmt::format("{}infrared = 'no'", kEmulated));
  ASSERT_NE(source, nullptr);
  for (int i = 0; i < 5; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    const auto color = frame->find(PlaneKind::Color)->as<std::uint8_t>();
    constexpr std::size_t kPixels = Emulated::kWidth * Emulated::kHeight;
    ASSERT_EQ(color.size(), 3 * kPixels);
    const std::size_t at = 17 * Emulated::kWidth + 33;
    EXPECT_EQ(color[at], 33);
    EXPECT_EQ(color[kPixels + at], 17);
    EXPECT_EQ(color[2 * kPixels + at], countIn(*frame, device_)) << "of the same moment";
  }
}

TEST_F(OpenNI2, MirroringIsOffUnlessAskedForAndCanBeSet) {
  const auto source = started(kEmulated);
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(source->setParameter("mirror", 1.0).ok());
  bool is_mirrored = false;
  for (int i = 0; i < 10 && !is_mirrored; ++i) {  // images under way are as they were
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    is_mirrored = frame->find(PlaneKind::Amplitude)->as<float>()[0] ==
                  static_cast<float>(Emulated::infraredAt(Emulated::kWidth - 1, 0));
  }
  EXPECT_TRUE(is_mirrored);
}

TEST_F(OpenNI2, ParametersAreTheDevicesProperties) {
  const auto source =
      started(fmt::format("{}infrared = 'no'\nregistration = 'depth_to_color'", kEmulated));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().parameters,
            (std::vector<std::string>{"auto_exposure", "exposure", "mirror", "registration"}));
  const auto value = [&](std::size_t i) { return source->state().parameters.at(i).value; };
  EXPECT_EQ(value(3), 1.0);
  EXPECT_EQ(value(1), std::nullopt) << "the device chooses it";
  ASSERT_TRUE(source->setParameter("auto_exposure", 0).ok());
  ASSERT_TRUE(source->setParameter("exposure", 12).ok());
  EXPECT_EQ(value(1), 12.0);
  EXPECT_EQ(device_.exposure, 12);
  for (const auto& [name, wrong, says] : {std::tuple{"exposure", 1000.0, "refuses"},
                                          {"exposure", 1.5, "whole"},
                                          {"mirror", 2.0, "0 or 1"},
                                          {"gain", 1.0, "it has: auto_exposure"}}) {
    const auto set = source->setParameter(name, wrong);
    ASSERT_FALSE(set.ok()) << name;
    EXPECT_NE(set.error().message.find(says), std::string::npos) << set.error().message;
  }
}

TEST_F(OpenNI2, FramesLostInTheDeviceAreCounted) {
  const auto source = started(kEmulated);
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  device_.skip = 3;
  std::uint64_t lost = 0;
  for (int i = 0; i < 20 && lost == 0; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    lost = frame->dropped_by_device;
    EXPECT_EQ(frame->dropped_because, lost == 0 ? "" : "the device counted it and did not give it (3)");
  }
  EXPECT_EQ(lost, 3u);
}

TEST_F(OpenNI2, DeviceTimeGoesOnWhenTheDevicesClockIsSet) {
  const auto source = started(kEmulated);
  ASSERT_NE(source, nullptr);
  auto before = nextFrame(*source);
  ASSERT_TRUE(before.ok());
  for (const std::int64_t jump_us : {-3'600'000'000LL, 7'200'000'000LL}) {
    device_.clock_us += jump_us;
    for (int i = 0; i < 10; ++i) {
      auto frame = nextFrame(*source);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      const std::int64_t step_ns = timeOf(*frame) - timeOf(*before);
      EXPECT_GT(step_ns, 0);
      EXPECT_LT(step_ns, 1'000'000'000) << "the jump is not in it";
      before = std::move(frame);
    }
  }
  device_.clock_us = 0;
}

TEST_F(OpenNI2, WithoutTimeStampsTheTimeOfArrivalServes) {
  device_.has_stamps = false;
  const auto source = started(kEmulated);
  ASSERT_NE(source, nullptr);
  std::int64_t last_ns = -1;
  for (int i = 0; i < 5; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_GT(timeOf(*frame), last_ns);
    last_ns = timeOf(*frame);
  }
  device_.has_stamps = true;
}

TEST_F(OpenNI2, ADamagedFrameIsCountedAndTenInARowAreALostDevice) {
  const auto source = started(kEmulated);
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  for (const bool is_cut : {true, false}) {
    (is_cut ? device_.cut_bytes : device_.wrong_width) = is_cut ? 2 : 1 << 20;
    Result<Frame> frame = source->next({}, false);
    while (frame) frame = source->next({}, false);
    EXPECT_EQ(frame.error().code, Error::Code::Malformed) << frame.error().message;
    frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_EQ(frame->dropped_by_device, 1u);
    EXPECT_EQ(frame->dropped_because.find("it could not be read: "), 0u) << frame->dropped_because;
  }
  Result<Frame> frame = Error{Error::Code::Malformed, ""};
  for (int i = 0; i < 100 && (frame || frame.error().code == Error::Code::Malformed); ++i) {
    device_.cut_bytes = 2;
    frame = source->next({}, false);
  }
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Disconnected);
  device_.cut_bytes = 0;
}

TEST_F(OpenNI2, ASilentColorStreamIsATimeoutAndNoOldImage) {
  const auto source = started(fmt::format("{}infrared = 'no'", kEmulated));
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  device_.is_color_silent = true;
  Result<Frame> frame = nextFrame(*source);
  for (int i = 0; i < 5 && frame; ++i) frame = nextFrame(*source);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Timeout);
  device_.is_color_silent = false;
  frame = nextFrame(*source);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_GT(frame->dropped_by_device, 40u) << "a second of depth images without company, at 50 Hz";
  EXPECT_EQ(frame->dropped_because.find("no image of another stream was taken with it ("), 0u)
      << frame->dropped_because;
}

TEST_F(OpenNI2, AnUnpluggedDeviceIsDisconnectedAndAbsentUntilItIsBack) {
  auto source = started(kEmulated);
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  device_.unplug();
  Result<Frame> frame = nextFrame(*source);
  for (int i = 0; i < 5 && frame; ++i) frame = nextFrame(*source);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Disconnected);
  source.reset();
  const auto absent = openWith(kEmulated);
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().code, Error::Code::NotFound) << absent.error().message;
  device_.plugIn();
  source = started(kEmulated);
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(nextFrame(*source).ok());
}

TEST_F(OpenNI2, WrongKeysSayWhatThereIs) {
  for (const auto& [keys, says] :
       {std::pair{"uri = 'openni2:emulated'\nwidth = 640", "160 x 120 at 50 Hz"},
        {"uri = 'openni2:Dummy'\ninfrared = 'yes'", "infrared"},
        {"uri = 'openni2:Dummy'\nregistration = 'depth_to_color'", "registration"},
        {"uri = 'openni2:/no/such/file.oni'", "there is no file /no/such/file.oni"},
        {"uri = 'usb:1'", "openni2.toml:1"},
        {"uri = 'openni2:emulated'\nspeed = -1", "speed"}}) {
    const auto opened = openWith(keys);
    ASSERT_FALSE(opened.ok()) << keys;
    EXPECT_NE(opened.error().message.find(says), std::string::npos) << opened.error().message;
  }
}

void expectCompliant(const std::string& keys) {
  const Driver driver = row();
  const Candidate candidate{.driver = &driver,
                            .keys = keys,
                            .absent_keys = "uri = 'openni2:no such device'",
                            .absent_name = "no such device"};
  for (const Finding& finding : checkCompliance(candidate)) {
    EXPECT_NE(finding.outcome, Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
  }
}

TEST_F(OpenNI2, IsCompliantWithInfrared) { expectCompliant(kEmulated); }
TEST_F(OpenNI2, IsCompliantWithColor) {
  expectCompliant(fmt::format("{}infrared = 'no'", kEmulated));
}
TEST_F(OpenNI2, IsCompliantWithTheLibrarysDummyDevice) { expectCompliant("uri = 'openni2:Dummy'"); }

TEST_F(OpenNI2, ListsTheDevicesThatAreThere) {
  const std::vector<std::string> all = row().list();
  EXPECT_EQ(std::ranges::count(all, fmt::format("openni2:{}", Emulated::kUri)), 1);
}

int threads() {
  const std::filesystem::directory_iterator all{"/proc/self/task"};
  return static_cast<int>(std::distance(begin(all), end(all)));
}

TEST_F(OpenNI2, OpeningAndClosingLeavesNothingBehind) {
  { ASSERT_NE(started(kEmulated), nullptr); }
  const int before = threads();
  for (int i = 0; i < 20; ++i) {
    const auto source = started(kEmulated);
    ASSERT_NE(source, nullptr);
    ASSERT_TRUE(nextFrame(*source).ok());
  }
  EXPECT_EQ(threads(), before);
}

// The library keeps images for the next start, some more or less as it falls. Four of them are less than a
// block of 16 bytes at each of ten thousand starts, or of 1 kB at each of 150.
constexpr std::int64_t kFewImages = 4 * (std::int64_t{2} * Emulated::kWidth * Emulated::kHeight + 32);

// At 20 kHz, for the driver waits two frames between a stop and a start; depth alone, for at that rate a busy
// machine reads no two images of the same time.
TEST_F(OpenNI2, StartsAndStopsKeepNothing) {
  device_.rate_hz = 20'000;
  const auto source = openWith(fmt::format("{}infrared = 'no'\ncolor = 'no'", kEmulated));
  ASSERT_TRUE(source.ok()) << source.error().message;
  toftwin::test::expectNothingKept("openni2", **source, 200, 10'000, kFewImages);
}

TEST_F(OpenNI2, StartsAndStopsOfTwoStreamsKeepNothing) {
  device_.rate_hz = 200;
  const auto source = openWith(kEmulated);
  ASSERT_TRUE(source.ok()) << source.error().message;
  toftwin::test::expectNothingKept("openni2", **source, 50, 150, kFewImages);
}

TEST(OpenNI2Library, LookingForACameraThatIsAwayKeepsNoMemory) {
  const auto look = [] { return openWith("uri = 'openni2:nowhere'").ok(); };
  ASSERT_FALSE(look());
  const std::size_t before = ::mallinfo2().uordblks;
  for (int i = 0; i < 50; ++i) ASSERT_FALSE(look());
  // Ended and started again, the library keeps 110 kB each time.
  EXPECT_LT(::mallinfo2().uordblks, before + 50 * 1000);
}

// ---- files -------------------------------------------------------------------------------------

/// A file of that many frames at least, by the library's own recorder. The frames of its streams
/// do not begin and end together, which costs one at each end.
class OpenNI2File : public OpenNI2 {
 protected:
  static constexpr int kFrames = 12;
  static constexpr std::uintmax_t kImageBytes = 2 * Emulated::kWidth * Emulated::kHeight;
  static void SetUpTestSuite() {
    emulatedDevice();
    ASSERT_EQ(oniInitialize(ONI_API_VERSION), ONI_STATUS_OK);
    OniDeviceHandle device = nullptr;
    ASSERT_EQ(oniDeviceOpen(Emulated::kUri, &device), ONI_STATUS_OK);
    OniStreamHandle depth = nullptr, infrared = nullptr;
    ASSERT_EQ(oniDeviceCreateStream(device, ONI_SENSOR_DEPTH, &depth), ONI_STATUS_OK);
    ASSERT_EQ(oniDeviceCreateStream(device, ONI_SENSOR_IR, &infrared), ONI_STATUS_OK);
    OniRecorderHandle recorder = nullptr;
    ASSERT_EQ(oniCreateRecorder(file().c_str(), &recorder), ONI_STATUS_OK);
    oniRecorderAttachStream(recorder, depth, FALSE);
    oniRecorderAttachStream(recorder, infrared, FALSE);
    emulatedDevice().is_in_step = true;
    oniStreamStart(depth);
    oniStreamStart(infrared);
    oniRecorderStart(recorder);
    // It begins when its thread comes to it; from then on it has all that the two streams send, however late.
    const auto soon = std::chrono::steady_clock::now() + std::chrono::seconds{20};
    const auto waitFor = [soon](auto isSo) {
      while (!isSo() && std::chrono::steady_clock::now() < soon) std::this_thread::sleep_for(milliseconds{5});
    };
    waitFor([] { return std::filesystem::file_size(file()) > kImageBytes; });
    const std::int64_t begun = std::max(emulatedDevice().last_depth, emulatedDevice().last_infrared);
    waitFor([begun] {
      return std::min(emulatedDevice().last_depth, emulatedDevice().last_infrared) > begun + kFrames + 2;
    });
    // The streams end first: a frame that is just being recorded waits for the recorder's list of streams and
    // holds that of its stream's recorders, while a recorder that ends takes the two the other way round, and
    // waits for ever.
    oniStreamStop(infrared);
    oniStreamStop(depth);
    emulatedDevice().is_in_step = false;
    oniRecorderStop(recorder);
    oniRecorderDestroy(&recorder);
    oniStreamDestroy(infrared);
    oniStreamDestroy(depth);
    oniDeviceClose(device);
    oniShutdown();
  }
  static void TearDownTestSuite() { std::filesystem::remove(file()); }
  static std::string file() {
    return testing::TempDir() + fmt::format("openni2_test_{}.oni", getpid());
  }
  static std::string keys(const std::string& more) {
    return fmt::format("uri = 'openni2:{}'\n{}", file(), more);
  }
};

TEST_F(OpenNI2File, EveryFrameIsPlayedInOrderAndThenTheStreamEnds) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "so slow, OpenNI2's recorder leaves frames out";
#endif
  const auto source = started(keys("speed = 0"));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().kind, FrameKind::Replayed);
  for (int round = 0; round < 2; ++round) {
    if (round > 0) {
      source->stop();
      ASSERT_TRUE(source->start().ok());
    }
    std::optional<std::int64_t> first, last;
    int frames = 0;
    Result<Frame> frame = nextFrame(*source);
    for (; frame; frame = nextFrame(*source), ++frames) {
      const std::int64_t n = countIn(*frame, device_);
      if (last) {
        EXPECT_EQ((n - *last + 256) % 256, static_cast<std::int64_t>(frame->dropped_by_device) + 1);
      }
      if (!first) first = n;
      last = n;
      const auto amplitude = frame->find(PlaneKind::Amplitude)->as<float>();
      ASSERT_EQ(amplitude[0], static_cast<float>(Emulated::infraredAt(Emulated::kWidth - 1, 0)))
          << "recorded mirrored, as the device begins";
    }
    EXPECT_EQ(frame.error().code, Error::Code::EndOfStream) << frame.error().message;
    EXPECT_GE(frames, kFrames);
  }
}

TEST_F(OpenNI2File, ALoopGoesOnInTime) {
  const auto source = started(keys("speed = 0\nloop = true"));
  ASSERT_NE(source, nullptr);
  std::int64_t last_ns = 0;
  for (int i = 0; i < 3 * kFrames; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_GT(timeOf(*frame), last_ns);
    EXPECT_LT(timeOf(*frame) - last_ns, 200'000'000);
    last_ns = timeOf(*frame);
  }
}

TEST_F(OpenNI2File, IsCompliant) { expectCompliant(keys("loop = true")); }

TEST_F(OpenNI2File, ADamagedFileIsAnErrorOrEnds) {
  const std::string damaged = file() + ".damaged.oni";
  const auto size = std::filesystem::file_size(file());
  for (const std::uintmax_t length :
       {std::uintmax_t{0}, std::uintmax_t{100}, size / 2, size - 10}) {
    std::filesystem::copy_file(file(), damaged, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(damaged, length);
    auto opened = openWith(fmt::format("uri = 'openni2:{}'\nspeed = 0", damaged));
    if (!opened || !(*opened)->start()) continue;
    Result<Frame> frame = nextFrame(**opened);
    for (int i = 0; i < 100 && frame; ++i) frame = nextFrame(**opened);
    EXPECT_FALSE(frame.ok()) << "a file of " << length << " bytes has no end";
  }
  std::filesystem::remove(damaged);
}

}  // namespace
}  // namespace toftwin::drivers::openni2
