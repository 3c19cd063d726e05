// SPDX-License-Identifier: Apache-2.0
// The driver against the emulated camera, over real sockets.
#include "drivers/o3d303/o3d303.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <future>
#include <thread>

#include "drivers/compliance.h"
#include "drivers/o3d303/wire/confidence.h"
#include "emulated_o3d303.h"
#include "start_stop.h"

namespace toftwin::drivers::o3d303 {
namespace {

using std::chrono::milliseconds;
using test::EmulatedO3d303;
using test::O3d303Device;

Result<std::unique_ptr<Source>> openWith(const EmulatedO3d303& camera,
                                         const std::string& keys = {}) {
  auto table =
      settings::Table::parse(fmt::format("uri = '{}'\n{}", camera.uri(), keys), "o3d303.toml");
  return row().open(*table);
}

/// The camera opened and started, or the test has failed.
std::unique_ptr<Source> started(const EmulatedO3d303& camera, const std::string& keys = {}) {
  auto opened = openWith(camera, keys);
  EXPECT_TRUE(opened.ok()) << opened.error().message;
  if (!opened) return nullptr;
  const auto begun = (*opened)->start();
  EXPECT_TRUE(begun.ok()) << begun.error().message;
  return begun ? *std::move(opened) : nullptr;
}

/// The next frame or error; a Timeout or an unreadable frame is asked again.
Result<Frame> nextFrame(Source& source) {
  for (int i = 0; i < 100; ++i) {
    Result<Frame> frame = source.next({}, false);
    const bool is_passing = !frame && (frame.error().code == Error::Code::Timeout ||
                                       frame.error().code == Error::Code::Malformed);
    if (!is_passing) return frame;
  }
  return Error{Error::Code::Timeout, "no frame for long"};
}

EmulatedO3d303::Options fast() { return {.schedule = test::FrameSchedule{milliseconds{5}}}; }

TEST(O3d303, AFrameIsWhatTheCameraSentInOurUnits) {
  EmulatedO3d303 camera{fast()};
  const auto source = started(camera);
  ASSERT_NE(source, nullptr);
  const auto frame = nextFrame(*source);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  const auto range_m = frame->find(PlaneKind::Range)->as<float>();
  const auto depth_m = frame->find(PlaneKind::Depth)->as<float>();
  const auto amplitude = frame->find(PlaneKind::Amplitude)->as<float>();
  const auto flags = frame->find(PlaneKind::Flags)->as<std::uint8_t>();
  // Which frame it is stands in any pixel with a value.
  const std::size_t far = EmulatedO3d303::kWidth * EmulatedO3d303::kHeight - 1;
  const auto last = static_cast<unsigned>(std::lround(range_m[far] * 1000.0F));
  const unsigned shift =
      ((last - 1000) / 10 + 512 - (EmulatedO3d303::kWidth + EmulatedO3d303::kHeight - 2)) % 256;
  std::size_t i = 0;
  for (std::uint32_t y = 0; y < EmulatedO3d303::kHeight; ++y) {
    for (std::uint32_t x = 0; x < EmulatedO3d303::kWidth; ++x, ++i) {
      const auto sent = EmulatedO3d303::pixelAt(shift, x, y);
      const bool has_value = sent.distance_mm > 0 && (sent.confidence & 1U) == 0;
      ASSERT_EQ(amplitude[i], static_cast<float>(sent.amplitude));
      ASSERT_EQ(flags[i], toftwin::o3d303::flagsOf(sent.confidence) | (has_value ? 0U : 1U));
      if (!has_value) {
        ASSERT_TRUE(std::isnan(range_m[i]) && std::isnan(depth_m[i]));
        continue;
      }
      ASSERT_EQ(range_m[i], static_cast<float>(sent.distance_mm) * 1e-3F);
      const Vec3d ray = rayThroughPixel(frame->camera, x, y).v;
      ASSERT_NEAR(depth_m[i], range_m[i] * ray.z, 1e-5);
    }
  }
  EXPECT_EQ(frame->moment.temperatures.at(0), (NamedTemperature{"illumination", 42.5_degC}));
  EXPECT_EQ(frame->moment.temperatures.at(1).where, "processor");
  EXPECT_EQ(frame->moment.temperatures.size(), 2u) << "3276.7 is no temperature";
  EXPECT_NEAR(frame->moment.since_power_on->in(second), 1800.0, 30.0);
  EXPECT_EQ(frame->moment.exposures.at(0).duration, 1000_us);
  EXPECT_EQ(frame->moment.exposures.at(0).modulation, 30_MHz);
}

// The rays come as floats: 6e-8 of at most 1, on 153 pixels, is 1e-5 pixels per ray.
TEST(O3d303, TheLensIsFoundFromTheUnitVectors) {
  EmulatedO3d303 camera{fast()};
  const auto opened = openWith(camera);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const CameraInfo& lens = (*opened)->info().camera;
  EXPECT_NEAR(lens.fx, EmulatedO3d303::kFocalLength_px, 1e-4);
  EXPECT_NEAR(lens.fy, EmulatedO3d303::kFocalLength_px, 1e-4);
  EXPECT_NEAR(lens.cx, (EmulatedO3d303::kWidth - 1) / 2.0, 1e-4);
  EXPECT_NEAR(lens.cy, (EmulatedO3d303::kHeight - 1) / 2.0, 1e-4);
  EXPECT_EQ(lens.calibration_id.size(), 32u);
}

/// Range and depth are the lens' own, wherever a client says that the camera stands.
TEST(O3d303, SoItIsOfACameraWhoseExtrinsicsTurnThem) {
  auto options = fast();
  options.extrinsics = {100.0F, -50.0F, 20.0F, 25.0F, -40.0F, 130.0F};
  EmulatedO3d303 camera{options};
  const auto opened = openWith(camera);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const CameraInfo& lens = (*opened)->info().camera;
  EXPECT_NEAR(lens.fx, EmulatedO3d303::kFocalLength_px, 1e-4);
  EXPECT_NEAR(lens.cx, (EmulatedO3d303::kWidth - 1) / 2.0, 1e-4);
  EXPECT_NEAR(lens.cy, (EmulatedO3d303::kHeight - 1) / 2.0, 1e-4);
}

void expectCompliant(const EmulatedO3d303& camera, const std::string& keys) {
  const Driver driver = row();
  const Candidate candidate{.driver = &driver,
                            .keys = fmt::format("uri = '{}'\n{}", camera.uri(), keys),
                            .absent_keys = "uri = 'o3d303:127.0.0.1:1'",
                            .absent_name = "127.0.0.1:1"};
  for (const Finding& finding : checkCompliance(candidate)) {
    EXPECT_NE(finding.outcome, Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
  }
}

TEST(O3d303, IsCompliantInFreeRun) {
  EmulatedO3d303 camera;
  expectCompliant(camera, "trigger = 'free_run'");
}

TEST(O3d303, IsCompliantWhenTriggered) {
  EmulatedO3d303 camera;
  expectCompliant(camera, "trigger = 'software'");
}

TEST(O3d303, KeysAreWrittenToTheCameraOnceAndReadBack) {
  EmulatedO3d303 camera{fast()};
  const std::string keys =
      "trigger = 'software'\nexposure_us = 1234\nmeasuring_range = 'up_to_30m'\n"
      "exposures = 'moderate'\nframe_rate_hz = 12.5\nchannel = 2";
  for (int round = 0; round < 2; ++round) {
    auto opened = openWith(camera, keys);
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    EXPECT_TRUE((*opened)->info().can_trigger);
    EXPECT_EQ((*opened)->state().parameters.at(0).value, 1234.0);
    camera.withDevice([](O3d303Device& device) {
      EXPECT_EQ(device.imager("ExposureTime"), 1234.0);
      EXPECT_EQ(device.imager("FrameRate"), 12.5);
      EXPECT_EQ(device.imager("Channel"), 2.0);
      EXPECT_FALSE(device.isFreeRunning());
      EXPECT_FALSE(device.isEditing());
      EXPECT_EQ(device.saves(), 1) << "the second time all is as wanted";
    });
  }
}

TEST(O3d303, AParameterIsSetWhileItStreams) {
  EmulatedO3d303 camera{fast()};
  const auto source = started(camera);
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  ASSERT_TRUE(source->setParameter("exposure_us", 321).ok());
  Result<Frame> frame = nextFrame(*source);
  for (int i = 0; i < 50 && frame && frame->moment.exposures[0].duration != 321_us; ++i) {
    frame = nextFrame(*source);
  }
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_EQ(frame->moment.exposures[0].duration, 321_us);
  EXPECT_FALSE(source->setParameter("exposure_us", 0).ok());
  EXPECT_FALSE(source->setParameter("exposure_us", 1.5).ok());
}

TEST(O3d303, WhoeverConfiguresTheCameraIsNamedAsTheReason) {
  EmulatedO3d303 camera{fast()};
  camera.withDevice([](O3d303Device& device) {
    device.answer("/api/rpc/v1/com.ifm.efector/", {"requestSession", {"", "somebody"}});
  });
  const auto opened = openWith(camera);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, Error::Code::Busy);
  EXPECT_NE(opened.error().message.find("another program"), std::string::npos);
}

TEST(O3d303, LostFramesAreCountedByTheCamerasCount) {
  EmulatedO3d303 camera;
  const auto source = started(camera);
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  camera.loseFrames(3);
  std::uint64_t lost = 0;
  std::string because;
  for (int i = 0; i < 8; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    lost += frame->dropped_by_device;
    because += frame->dropped_because;
  }
  EXPECT_EQ(lost, 3u);
  EXPECT_EQ(because, "the camera counted it and did not send it (3)");
}

TEST(O3d303, FramesThatCannotBeReadAreCountedAndTheStreamGoesOn) {
  EmulatedO3d303 camera;
  const auto source = started(camera);
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  camera.corrupt(3);
  std::uint64_t lost = 0;
  std::string because;
  for (int i = 0; i < 8; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    lost += frame->dropped_by_device;
    because += frame->dropped_because;
  }
  EXPECT_EQ(lost, 3u);
  EXPECT_EQ(because.find("it could not be read: "), 0u) << because;
}

TEST(O3d303, AStreamThatLostItsFramingIsDisconnected) {
  EmulatedO3d303 camera{fast()};
  const auto source = started(camera);
  ASSERT_NE(source, nullptr);
  camera.corrupt(1, true);
  Result<Frame> frame = nextFrame(*source);
  for (int i = 0; i < 100 && frame; ++i) frame = nextFrame(*source);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Disconnected);
}

TEST(O3d303, ACameraThatHangsIsDisconnected) {
  for (const char* trigger : {"free_run", "software"}) {
    EmulatedO3d303 camera;
    const auto source = started(camera, fmt::format("trigger = '{}'", trigger));
    ASSERT_NE(source, nullptr);
    camera.hang();
    Result<Frame> frame = nextFrame(*source);
    for (int i = 0; i < 100 && frame; ++i) frame = nextFrame(*source);
    ASSERT_FALSE(frame.ok());
    EXPECT_EQ(frame.error().code, Error::Code::Disconnected) << frame.error().message;
  }
}

TEST(O3d303, ACableThatIsPulledIsDisconnected) {
  EmulatedO3d303 camera;
  const auto source = started(camera);
  ASSERT_NE(source, nullptr);
  camera.unplug();
  Result<Frame> frame = nextFrame(*source);
  for (int i = 0; i < 100 && frame; ++i) frame = nextFrame(*source);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().code, Error::Code::Disconnected);
  EXPECT_EQ(openWith(camera).error().code, Error::Code::Disconnected);
  camera.plugIn();
  EXPECT_TRUE(openWith(camera).ok());
}

TEST(O3d303, ATriggeredFrameComesToEveryTrigger) {
  EmulatedO3d303 camera;
  const auto source = started(camera, "trigger = 'software'");
  ASSERT_NE(source, nullptr);
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(source->trigger().ok());
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_EQ(frame->dropped_by_device, 0u);
  }
}

TEST(O3d303, AnAddressThatIsNoneIsComplainedAboutBeforeAnythingIsOpened) {
  for (const char* uri :
       {"o3d303:", "o3d303:camera", "192.168.0.69", "o3d303:1.2.3.4:x", "o3d303:1.2.3.4:0"}) {
    auto table = settings::Table::parse(fmt::format("uri = '{}'", uri), "o3d303.toml");
    const auto opened = row().open(*table);
    ASSERT_FALSE(opened.ok()) << uri;
    EXPECT_NE(opened.error().message.find(uri), std::string::npos);
  }
}

TEST(O3d303, WhatTheCameraRefusesAtOpeningIsNoMistakeOfTheFile) {
  EmulatedO3d303 camera{fast()};
  camera.withDevice([](O3d303Device& device) { device.device.erase("DeviceType"); });
  const auto opened = openWith(camera);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, Error::Code::Incompatible) << opened.error().message;
  EXPECT_NE(opened.error().message.find("unknown parameter (101000)"), std::string::npos)
      << opened.error().message;
}

// ---- clocks ------------------------------------------------------------------------------------

TEST(O3d303, ItsClocksOffsetIsFoundAndASetClockDoesNotShow) {
  EmulatedO3d303 camera{{.schedule = test::FrameSchedule{milliseconds{10}}, .clock_skew = 50e-6}};
  // Triggered, for else a machine that is busier than the camera would take its frames from an ever longer
  // queue.
  const auto source = started(camera, "delay_ms = 0.001\ntrigger = 'software'");
  ASSERT_NE(source, nullptr);
  const auto next = [&]() -> Result<Frame> {
    if (auto triggered = source->trigger(); !triggered) return triggered.error();
    return nextFrame(*source);
  };
  const auto hostMinusStamp = [&](const Frame& frame) {
    // Frames leave the emulator when they are stamped: host time of the stamp is now, or a bit
    // before.
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count() -
           frame.moment.exposures[0].start.ns;
  };
  std::optional<std::int64_t> least;
  Result<Frame> frame = next();
  std::int64_t last = 0;
  for (int i = 0; i < 60 && frame; ++i, frame = next()) {
    if (i == 40) camera.setClock(std::chrono::hours{-1});
    EXPECT_GT(frame->moment.exposures[0].start.ns, last);
    last = frame->moment.exposures[0].start.ns;
    least = std::min(least.value_or(hostMinusStamp(*frame)), hostMinusStamp(*frame));
    if (i < 7) {
      EXPECT_EQ(frame->moment.clock.uncertainty_ns, -1) << i;
    } else {
      EXPECT_GT(frame->moment.clock.uncertainty_ns, 0);
    }
  }
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  // The least difference seen is the true offset plus the shortest way here, which is some
  // milliseconds on a busy machine; how much others took longer, the driver knows itself (6 sigma). An error
  // of the arithmetic would be hours.
  EXPECT_NEAR(static_cast<double>(frame->moment.clock.host_minus_device_ns - *least), 0.0,
              100e6 + 6.0 * static_cast<double>(frame->moment.clock.uncertainty_ns));
}

// ---- leaks -------------------------------------------------------------------------------------

/// The emulator closes its ends when it gets to it.
void waitForConnections(EmulatedO3d303& camera, int wanted) {
  const auto soon = std::chrono::steady_clock::now() + std::chrono::seconds{30};
  while (camera.connections() > wanted && std::chrono::steady_clock::now() < soon)
    std::this_thread::sleep_for(milliseconds{1});
  EXPECT_LE(camera.connections(), wanted) << "the camera does not see that they were closed";
}

TEST(O3d303, TenThousandStartsAndStopsLeakNeitherFilesNorThreadsNorMemory) {
  EmulatedO3d303 camera;
  const auto opened = openWith(camera);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  Source& source = **opened;
  test::Held before;
  for (int i = -100; i < 10'000; ++i) {
    const auto begun = source.start();
    ASSERT_TRUE(begun.ok()) << "start " << i << ": " << begun.error().message;
    if (i == 9'999) {
      EXPECT_TRUE(nextFrame(source).ok());
    }
    source.stop();
    if (i != -1) continue;  // caches are warm
    waitForConnections(camera, 0);
    before = {};
  }
  waitForConnections(camera, 0);
  const test::Held after;
  EXPECT_EQ(after.files, before.files);
  EXPECT_EQ(after.threads, before.threads);
  // A block of 16 bytes at each start would be 160 kB; a frame is 500 kB, and is gone again.
  EXPECT_LT(after.heap_bytes - before.heap_bytes, 80'000);
  RecordProperty("heap_bytes", std::to_string(after.heap_bytes - before.heap_bytes));
}

TEST(O3d303, OpeningAndClosingLeaksNeitherFilesNorThreads) {
  EmulatedO3d303 camera{fast()};
  ASSERT_NE(started(camera), nullptr);  // what the process opens once
  waitForConnections(camera, 0);
  const auto files = test::entriesOf("/proc/self/fd"), threads = test::entriesOf("/proc/self/task");
  for (int i = 0; i < 50; ++i) ASSERT_NE(started(camera), nullptr);
  waitForConnections(camera, 0);
  EXPECT_TRUE(test::comesTo("/proc/self/fd", files));
  EXPECT_TRUE(test::comesTo("/proc/self/task", threads));
}

// ---- the emulator ------------------------------------------------------------------------------

/// What whoever prepared the data says of it: mean and standard deviation, to a tenth of a
/// millisecond.
struct Measured {
  const char* file;
  double mean_ms, sd_ms;
};
void PrintTo(const Measured& measured, std::ostream* out) { *out << measured.file; }

std::optional<test::FrameSchedule> measuredSchedule(const std::string& file) {
  std::vector<std::filesystem::path> folders;
  if (const char* data = std::getenv("TOFTWIN_DATA")) folders.emplace_back(data);
  for (const char* up : {"/../shared/data", "/../../shared/data"}) {
    folders.emplace_back(std::string{TOFTWIN_SOURCE_DIR} + up);
  }
  for (const auto& folder : folders) {
    if (auto schedule = test::FrameSchedule::fromFile(folder / "ifm-frame-timing" / file)) {
      return schedule;
    }
  }
  return std::nullopt;
}
constexpr const char* kNoTiming = "no ifm-frame-timing in $TOFTWIN_DATA or ../shared/data";

class MeasuredTiming : public testing::TestWithParam<Measured> {};
INSTANTIATE_TEST_SUITE_P(Real, MeasuredTiming,
                         testing::Values(Measured{"libo3d3xx_jitter-2000-30-8.txt", 37.9, 7.4},
                                         Measured{"libo3d3xx_jitter-3000-30-8.txt", 41.3, 8.2},
                                         Measured{"libo3d3xx_jitter-4000-25-8.txt", 40.0, 3.0},
                                         Measured{"libo3d3xx_jitter-5000-20-8.txt", 50.0, 0.5},
                                         Measured{"libo3d3xx_jitter-5000-5-8.txt", 200.0, 0.4}));

TEST_P(MeasuredTiming, IsRepeatedByTheScheduleWhoseStampsAreEven) {
  const auto schedule = measuredSchedule(GetParam().file);
  if (!schedule) GTEST_SKIP() << kNoTiming;
  double sum_ms = 0.0, squares = 0.0;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const std::chrono::duration<double, std::milli> interval =
        schedule->leaves(i + 1) - schedule->leaves(i);
    sum_ms += interval.count();
    squares += interval.count() * interval.count();
    EXPECT_LE(schedule->stamped(i), schedule->leaves(i));
  }
  const double mean_ms = sum_ms / 1000.0;
  const std::chrono::duration<double, std::milli> even =
      schedule->stamped(1) - schedule->stamped(0);
  EXPECT_NEAR(even.count(), mean_ms, 1e-3);
  EXPECT_NEAR(mean_ms, GetParam().mean_ms, 0.05);
  EXPECT_NEAR(std::sqrt(squares / 1000.0 - mean_ms * mean_ms), GetParam().sd_ms, 0.05);
}

/// Of two series of equal length.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sa += a[i], sb += b[i], saa += a[i] * a[i], sbb += b[i] * b[i], sab += a[i] * b[i];
  }
  return (n * sab - sa * sb) / std::sqrt((n * saa - sa * sa) * (n * sbb - sb * sb));
}

// A busy machine adds noise to the arrivals, which is why eight windows may be tried. Of 75
// intervals that have nothing to do with those of the file, 0.7 is 6 standard errors (1/sqrt(75)),
// for each of the 30 places where the stream may have begun.
TEST(O3d303, FramesArriveAtTheIntervalsThatWereMeasuredOnARealCamera) {
  const auto schedule = measuredSchedule("libo3d3xx_jitter-2000-30-8.txt");
  if (!schedule) GTEST_SKIP() << kNoTiming;
  constexpr std::size_t kIntervals = 75, kPlaces = 30;
  double best = 0.0;
  for (int window = 0; window < 8 && best < 0.7; ++window) {
    EmulatedO3d303 camera{{.schedule = *schedule}};
    const auto source = started(camera);
    ASSERT_NE(source, nullptr);
    std::vector<double> arrived_ms;
    while (arrived_ms.size() <= kIntervals) {
      const auto frame = nextFrame(*source);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      const auto now = std::chrono::steady_clock::now().time_since_epoch();
      arrived_ms.push_back(std::chrono::duration<double, std::milli>{now}.count());
    }
    std::vector<double> intervals;
    for (std::size_t i = 0; i < kIntervals; ++i) {
      intervals.push_back(arrived_ms[i + 1] - arrived_ms[i]);
    }
    for (std::size_t place = 0; place < kPlaces; ++place) {
      std::vector<double> expected;
      for (std::size_t i = place; i < place + kIntervals; ++i) {
        expected.push_back(
            std::chrono::duration<double, std::milli>{schedule->leaves(i + 1) - schedule->leaves(i)}
                .count());
      }
      best = std::max(best, correlation(intervals, expected));
    }
  }
  fmt::print("correlation with the measured intervals: {:.3f}\n", best);
  EXPECT_GT(best, 0.7);
}

}  // namespace
}  // namespace toftwin::drivers::o3d303
