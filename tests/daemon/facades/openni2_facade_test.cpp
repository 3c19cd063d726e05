// SPDX-License-Identifier: Apache-2.0
// The plug-in in the real libOpenNI2: devices that come and go, properties that set the camera, recorder and player.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <set>
#include <thread>

#include "drivers/compliance.h"
#include "drivers/openni2/openni2.h"
#include "openni2_testing.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using Policy = SubscribeOptions::Policy;
using Uris = std::vector<std::string>;

const std::string kSmallXtion =
    "driver = 'sim'\nuri = 'sim:xtion_2'\nsamples_per_pixel = 1\nmax_surfaces = 1\nplanes = ['depth', 'color']\n";

/// Counts what OpenNI2 tells a program of its devices.
class Listener {
 public:
  Listener() {
    OniDeviceCallbacks callbacks{connected, disconnected, changed};
    oniRegisterDeviceCallbacks(&callbacks, this, &handle_);
  }
  ~Listener() { oniUnregisterDeviceCallbacks(handle_); }
  std::atomic<int> came{0}, went{0}, failed{0}, is_well{0}, ended{0};

 private:
  static void connected(const OniDeviceInfo*, void* self) { ++static_cast<Listener*>(self)->came; }
  static void disconnected(const OniDeviceInfo*, void* self) { ++static_cast<Listener*>(self)->went; }
  static void changed(const OniDeviceInfo*, OniDeviceState state, void* self) {
    auto& it = *static_cast<Listener*>(self);
    if (state == ONI_DEVICE_STATE_ERROR) ++it.failed;
    if (state == ONI_DEVICE_STATE_OK) ++it.is_well;
    if (state == ONI_DEVICE_STATE_EOF) ++it.ended;
  }
  OniCallbackHandle handle_ = nullptr;
};

class OpenNI2Plugin : public OpenNI2Program {
 protected:
  static OniStatus tryOpen(const std::string& uri) {
    OniDeviceHandle device = nullptr;
    const OniStatus status = oniDeviceOpen(uri.c_str(), &device);
    if (status == ONI_STATUS_OK) oniDeviceClose(device);
    return status;
  }
};

// ---- which devices there are -------------------------------------------------------------------

TEST_F(OpenNI2Plugin, EverySourceIsADeviceWithoutAnyConfiguration) {
  start("[[source]]\nname = 'left'\n" + kPattern + "[[source]]\nname = 'right'\n" + kSmallSim);
  const std::string before = std::getenv("RUNTIME_DIRECTORY") != nullptr ? std::getenv("RUNTIME_DIRECTORY") : "";
  std::filesystem::create_symlink(daemon_->socketPath(), folder_ / "toftwin.sock");
  ::setenv("RUNTIME_DIRECTORY", folder_.c_str(), 1);
  initialize("");
  EXPECT_EQ(deviceUris(), (Uris{"toftwin:left", "toftwin:right"}));
  const auto device = openDevice(nullptr);  // any
  ASSERT_NE(device, nullptr);
  OniDeviceInfo info{};
  ASSERT_EQ(oniDeviceGetInfo(device.get(), &info), ONI_STATUS_OK);
  EXPECT_STREQ(info.uri, "toftwin:left");
  EXPECT_STREQ(info.vendor, "toftwin");
  before.empty() ? ::unsetenv("RUNTIME_DIRECTORY") : ::setenv("RUNTIME_DIRECTORY", before.c_str(), 1);
}

TEST_F(OpenNI2Plugin, ADaemonElsewhereIsNamedInTheUri) {
  start("[[source]]\nname = 'cam'\n" + kPattern);
  initialize("tcp:127.0.0.1:1");  // where nobody listens
  EXPECT_EQ(deviceUris(), Uris{});
  const std::string tcp = fmt::format("toftwin://127.0.0.1:{}/cam", daemon_->port());
  const std::string local = fmt::format("toftwin://{}/cam", daemon_->socketPath());
  for (const std::string& uri : {tcp, local}) {
    const auto device = openDevice(uri.c_str());
    ASSERT_NE(device, nullptr) << uri;
    const auto stream = createStream(device, ONI_SENSOR_DEPTH);
    ASSERT_EQ(oniStreamStart(stream.get()), ONI_STATUS_OK);
    EXPECT_NE(readFrame(stream), nullptr) << uri;
  }
  EXPECT_EQ(deviceUris().size(), 2u) << "both stay in the list";
}

TEST_F(OpenNI2Plugin, WhatIsWrongWithAUriIsTold) {
  startWith(kPattern);
  for (const auto& [uri, says] : {std::pair{"toftwin:nobody", "has no source \"nobody\""},
                                  {"toftwin:not a name", "letters, digits"},
                                  {"toftwin://127.0.0.1:99999/cam", "names no daemon"},
                                  {"toftwin://127.0.0.1:1/cam", "cannot reach toftwind at tcp:127.0.0.1:1"},
                                  {"toftwin:///no/such/socket/cam", "cannot reach toftwind at unix:/no/such"}}) {
    EXPECT_EQ(tryOpen(uri), ONI_STATUS_NO_DEVICE) << uri;
    EXPECT_NE(std::string{oniGetExtendedError()}.find(says), std::string::npos) << oniGetExtendedError();
  }
  EXPECT_EQ(deviceUris(), Uris{"toftwin:cam"});
}

TEST_F(OpenNI2Plugin, AWrongConfigurationIsToldToWhoOpensADeviceOfOurs) {
  startWith(kPattern, "max_depth_m = 100\n");
  EXPECT_EQ(deviceUris(), Uris{});
  EXPECT_EQ(tryOpen("toftwin:cam"), ONI_STATUS_NO_DEVICE);
  const std::string said = oniGetExtendedError();
  EXPECT_NE(said.find("openni2.toml:1"), std::string::npos) << said;
  EXPECT_NE(said.find("max_depth_m"), std::string::npos) << said;
}

TEST_F(OpenNI2Plugin, SwitchedOffItShowsNothing) {
  start("[[source]]\nname = 'cam'\n" + kPattern);
  initialize("off");
  EXPECT_EQ(deviceUris(), Uris{});
  EXPECT_EQ(tryOpen(fmt::format("toftwin://127.0.0.1:{}/cam", daemon_->port())), ONI_STATUS_NO_DEVICE);
}

TEST_F(OpenNI2Plugin, ADeviceGoesAndComesWithItsDaemonAndAnOpenOneGoesOn) {
  startWith(kPattern);
  const Listener listener;
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_DEPTH);
  ASSERT_EQ(oniStreamStart(stream.get()), ONI_STATUS_OK);
  ASSERT_NE(readFrame(stream), nullptr);
  stop();
  EXPECT_TRUE(eventually([&] { return listener.went == 1; }));
  EXPECT_EQ(deviceUris(), Uris{});
  EXPECT_EQ(tryOpen("toftwin:cam"), ONI_STATUS_NO_DEVICE);
  start(options());
  EXPECT_TRUE(eventually([&] { return listener.came == 1; }));
  EXPECT_EQ(deviceUris(), Uris{"toftwin:cam"});
  for (int i = 0; i < 5; ++i) ASSERT_NE(readFrame(stream), nullptr) << "the device that was left open goes on";
  EXPECT_EQ(tryOpen("toftwin:cam"), ONI_STATUS_OK);
}

TEST_F(OpenNI2Plugin, AStreamThatEndsIsTold) {
  startWith(kPattern + "frames = 3\n");
  const Listener listener;
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_DEPTH);
  ASSERT_EQ(oniStreamStart(stream.get()), ONI_STATUS_OK);
  EXPECT_TRUE(eventually([&] { return listener.ended == 1; }));
  EXPECT_EQ(deviceUris(), Uris{"toftwin:cam"}) << "it is not gone";
}

// ---- properties --------------------------------------------------------------------------------

/// The longest exposure of the next native frames, until it is as wanted.
bool isExposedFor(Subscription& frames, double wanted_us) {
  for (int i = 0; i < 50; ++i) {
    const auto frame = frames.next(kSoon);
    if (!frame) return false;
    double longest_us = 0.0;
    for (const Exposure& one : frame->moment.exposures)
      longest_us = std::max(longest_us, one.duration.in(microsecond));
    if (std::abs(longest_us - wanted_us) < 0.5) return true;
  }
  return false;
}

TEST_F(OpenNI2Plugin, TheExposureIsThatOfTheSimulatedCamera) {
  startWith(kSmallSim);
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_DEPTH);
  auto native = client();
  auto frames = native.subscribe("cam");
  ASSERT_TRUE(frames.ok()) << frames.error().message;
  // The library's C++ interface gives an exposure only to who can ask for auto exposure.
  EXPECT_EQ(streamProperty<OniBool>(stream, ONI_STREAM_PROPERTY_AUTO_EXPOSURE), FALSE);
  ASSERT_EQ(setStream(stream, ONI_STREAM_PROPERTY_EXPOSURE, 321), ONI_STATUS_OK) << oniGetExtendedError();
  EXPECT_EQ(streamProperty<int>(stream, ONI_STREAM_PROPERTY_EXPOSURE), 321);
  EXPECT_TRUE(isExposedFor(*frames, 321.0));
  EXPECT_EQ(setStream(stream, ONI_STREAM_PROPERTY_AUTO_EXPOSURE, OniBool{FALSE}), ONI_STATUS_OK);
  EXPECT_NE(setStream(stream, ONI_STREAM_PROPERTY_AUTO_EXPOSURE, OniBool{TRUE}), ONI_STATUS_OK);
  EXPECT_EQ(setStream(stream, ONI_STREAM_PROPERTY_EXPOSURE, -5), ONI_STATUS_BAD_PARAMETER);
  EXPECT_NE(std::string{oniGetExtendedError()}.find("exposure_us"), std::string::npos) << oniGetExtendedError();
  EXPECT_EQ(oniStreamIsPropertySupported(stream.get(), ONI_STREAM_PROPERTY_GAIN), FALSE);
}

TEST_F(OpenNI2Plugin, AnotherFrameRateIsTheCameras) {
  startWith(kSmallSim);
  const auto device = openDevice("toftwin:cam");
  const auto depth = createStream(device, ONI_SENSOR_DEPTH), infrared = createStream(device, ONI_SENSOR_IR);
  auto mode = streamProperty<OniVideoMode>(depth, ONI_STREAM_PROPERTY_VIDEO_MODE);
  ASSERT_TRUE(mode);
  EXPECT_EQ(mode->fps, 20);  // frame_interval_ms = 50
  mode->fps = 10;
  ASSERT_EQ(setStream(depth, ONI_STREAM_PROPERTY_VIDEO_MODE, *mode), ONI_STATUS_OK) << oniGetExtendedError();
  EXPECT_EQ(streamProperty<OniVideoMode>(infrared, ONI_STREAM_PROPERTY_VIDEO_MODE)->fps, 10);
  const auto details = client().describe("cam");
  ASSERT_TRUE(details.ok());
  EXPECT_NEAR(details->frame_interval->in(millisecond), 100.0, 1e-9);
  mode->fps = 100'000;
  EXPECT_NE(setStream(depth, ONI_STREAM_PROPERTY_VIDEO_MODE, *mode), ONI_STATUS_OK);
  mode->fps = 10;
  mode->resolutionX = 640;
  EXPECT_EQ(setStream(depth, ONI_STREAM_PROPERTY_VIDEO_MODE, *mode), ONI_STATUS_BAD_PARAMETER);
}

TEST_F(OpenNI2Plugin, WindowsThatAreNotInTheImageAreRefused) {
  startWith(kPattern);  // 64 x 48
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_DEPTH);
  constexpr int kMost = 2'147'483'647;
  for (const OniCropping& window :
       {OniCropping{TRUE, -1, 0, 8, 8}, {TRUE, 60, 0, 5, 8}, {TRUE, 0, 0, 65, 1}, {TRUE, 0, 0, 0, 1},
        {TRUE, kMost, 0, 8, 8}, {TRUE, 8, kMost, 8, 8}, {TRUE, 0, 0, kMost, kMost}, {TRUE, 1, 1, -2, 3}}) {
    EXPECT_EQ(setStream(stream, ONI_STREAM_PROPERTY_CROPPING, window), ONI_STATUS_BAD_PARAMETER);
  }
  ASSERT_EQ(setStream(stream, ONI_STREAM_PROPERTY_CROPPING, OniCropping{TRUE, 60, 40, 4, 8}), ONI_STATUS_OK);
  ASSERT_EQ(setStream(stream, ONI_STREAM_PROPERTY_CROPPING, OniCropping{FALSE, 7, 7, 7, 7}), ONI_STATUS_OK);
  const auto cropping = streamProperty<OniCropping>(stream, ONI_STREAM_PROPERTY_CROPPING);
  ASSERT_TRUE(cropping);
  EXPECT_EQ(cropping->width, 64);
}

TEST_F(OpenNI2Plugin, DepthStaysBelowTheMaximumThatIsStated) {
  startWith(kSmallSim, "max_depth_m = 2.5\n");
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_DEPTH);
  EXPECT_EQ(streamProperty<int>(stream, ONI_STREAM_PROPERTY_MAX_VALUE), 2500);
  ASSERT_EQ(oniStreamStart(stream.get()), ONI_STATUS_OK);
  const auto frame = readFrame(stream);
  ASSERT_NE(frame, nullptr);
  int farthest = 0, none = 0;
  for (int y = 0; y < frame->height; ++y) {
    for (int x = 0; x < frame->width; ++x) {
      farthest = std::max<int>(farthest, wordAt(*frame, x, y));
      none += wordAt(*frame, x, y) == 0 ? 1 : 0;
    }
  }
  EXPECT_GT(farthest, 1000);
  EXPECT_LT(farthest, 2500);
  EXPECT_GT(none, 100) << "the wall behind the box";
}

TEST_F(OpenNI2Plugin, ColorLiesOverDepth) {
  startWith(kSmallXtion);
  const auto device = openDevice("toftwin:cam");
  EXPECT_EQ(oniDeviceIsImageRegistrationModeSupported(device.get(), ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR), TRUE);
  const auto depth = createStream(device, ONI_SENSOR_DEPTH), color = createStream(device, ONI_SENSOR_COLOR);
  int x = -1, y = -1;
  ASSERT_EQ(oniCoordinateConverterDepthToColor(depth.get(), color.get(), 100, 50, 1000, &x, &y), ONI_STATUS_OK);
  EXPECT_EQ(x, 100);
  EXPECT_EQ(y, 50);
  ASSERT_EQ(setStream(color, ONI_STREAM_PROPERTY_MIRRORING, OniBool{TRUE}), ONI_STATUS_OK);
  ASSERT_EQ(oniCoordinateConverterDepthToColor(depth.get(), color.get(), 100, 50, 1000, &x, &y), ONI_STATUS_OK);
  EXPECT_EQ(x, 640 - 1 - 100);
  EXPECT_NE(oniCoordinateConverterDepthToColor(depth.get(), color.get(), 640, 50, 1000, &x, &y), ONI_STATUS_OK);
}

/// Median and worst distance of the library's points from the true lens's, in millimetres at 1 m depth.
std::pair<double, double> pointErrors(const OniStreamPtr& stream, const CameraInfo& camera) {
  std::vector<double> errors_mm;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      float x = 0, y = 0, z = 0;
      oniCoordinateConverterDepthToWorld(stream.get(), static_cast<float>(u), static_cast<float>(v), 1000.0F, &x, &y, &z);
      const Vec3d ray = rayThroughPixel(camera, u, v).v;
      // The library's y is up.
      errors_mm.push_back(std::hypot(x - 1000.0 * ray.x / ray.z, -y - 1000.0 * ray.y / ray.z));
    }
  }
  std::ranges::sort(errors_mm);
  return {errors_mm[errors_mm.size() / 2], errors_mm.back()};
}

TEST_F(OpenNI2Plugin, ItsPointsAreAsFarFromTheTrueLensAsTheDocumentsSay) {
  std::string sources;
  for (const char* camera : {"o3d303", "kinect_v2", "xtion_2"})
    sources += fmt::format("[[source]]\nname = '{0}'\ndriver = 'sim'\nuri = 'sim:{0}'\n", camera);
  start(sources);
  initialize("unix:" + daemon_->socketPath());
  std::ifstream file{std::string{TOFTWIN_SOURCE_DIR} + "/docs/facades/openni2.md"};
  const std::string page{std::istreambuf_iterator<char>{file}, {}};
  for (const char* camera : {"o3d303", "kinect_v2", "xtion_2"}) {
    const auto device = openDevice(fmt::format("toftwin:{}", camera).c_str());
    const auto stream = createStream(device, ONI_SENSOR_DEPTH);
    const auto details = client().describe(camera);
    ASSERT_TRUE(details.ok());
    const auto [median, worst] = pointErrors(stream, details->camera);
    const auto text = [](double mm) { return mm < 10.0 ? fmt::format("{:.1f}", mm) : fmt::format("{:.0f}", mm); };
    const std::string line = fmt::format("| `{}` | {} mm | {} mm |", camera, text(median), text(worst));
    EXPECT_NE(page.find(line), std::string::npos) << line;
  }
}

// ---- frames ------------------------------------------------------------------------------------

TEST_F(OpenNI2Plugin, DepthAndColorInSyncAreOfTheSameFrame) {
  startWith(kSmallXtion);
  const auto device = openDevice("toftwin:cam");
  const auto depth = createStream(device, ONI_SENSOR_DEPTH), color = createStream(device, ONI_SENSOR_COLOR);
  ASSERT_EQ(oniStreamStart(depth.get()), ONI_STATUS_OK);
  ASSERT_EQ(oniStreamStart(color.get()), ONI_STATUS_OK);
  ASSERT_EQ(oniDeviceEnableDepthColorSync(device.get()), ONI_STATUS_OK);
  int last = 0;
  for (int i = 0; i < 3; ++i) {
    const auto one = readFrame(depth), other = readFrame(color);
    ASSERT_TRUE(one != nullptr && other != nullptr);
    EXPECT_EQ(one->frameIndex, other->frameIndex);
    EXPECT_EQ(one->timestamp, other->timestamp);
    EXPECT_GT(one->frameIndex, last);
    last = one->frameIndex;
  }
  oniDeviceDisableDepthColorSync(device.get());
}

TEST_F(OpenNI2Plugin, ASourceThatWaitsForTriggersGivesAFrameToEachThatIsWaitedFor) {
  startWith(kSmallSim + "pace = 'trigger'\n");
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_DEPTH);
  ASSERT_EQ(oniStreamStart(stream.get()), ONI_STATUS_OK);
  for (int i = 1; i <= 5; ++i) {
    const auto frame = readFrame(stream);
    ASSERT_NE(frame, nullptr);
    EXPECT_EQ(frame->frameIndex, i);
  }
  const auto health = client().health();
  ASSERT_TRUE(health.ok());
  EXPECT_LE(health->sources.at(0).frames, 6u) << "no more than were waited for, and one at the start";
}

TEST_F(OpenNI2Plugin, WithALatencyFramesComeThatMuchLater) {
  constexpr double kLatency_ms = 150.0;
  startWith(kPattern, fmt::format("latency_ms = {}\n", kLatency_ms));
  auto native = client();
  auto subscribed = native.subscribe("cam", {.policy = SubscribeOptions::Policy::Queue, .queue = 1000});
  ASSERT_TRUE(subscribed.ok()) << subscribed.error().message;
  Natives natives{*std::move(subscribed), microsecondsOf};
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_DEPTH);
  ASSERT_EQ(oniStreamStart(stream.get()), ONI_STATUS_OK);
  for (int i = 0; i < 20; ++i) {
    const auto frame = readFrame(stream);
    const auto came = std::chrono::nanoseconds{std::chrono::system_clock::now().time_since_epoch()};
    ASSERT_NE(frame, nullptr);
    const auto same = natives.at(static_cast<std::int64_t>(frame->timestamp));
    ASSERT_TRUE(same.ok() && *same != nullptr);
    EXPECT_GE(static_cast<double>(came.count() - (*same)->moment.received.ns) * 1e-6, kLatency_ms - 0.01)
        << "frame " << frame->frameIndex;  // the two clocks tick differently
  }
}

TEST_F(OpenNI2Plugin, ATriggeredFrameThatIsLostIsTriggeredAgain) {
  startWith(kSmallSim + "pace = 'trigger'\n[[source.fault]]\nkind = 'loss'\nfirst = 2\nframes = 2\n");
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_DEPTH);
  ASSERT_EQ(oniStreamStart(stream.get()), ONI_STATUS_OK);
  for (int last = 0; last < 6;) {
    const auto frame = readFrame(stream);
    ASSERT_NE(frame, nullptr) << "after " << last;
    EXPECT_GT(frame->frameIndex, last);
    last = frame->frameIndex;
    EXPECT_TRUE(last < 3 || last > 4) << "the third and fourth frame were lost";
  }
}

TEST_F(OpenNI2Plugin, LostFramesAreMissingInTheFrameIndex) {
  startWith(kPattern + "[[source.fault]]\nkind = 'loss'\nfirst = 3\nframes = 2\n");
  const auto device = openDevice("toftwin:cam");
  const auto stream = createStream(device, ONI_SENSOR_DEPTH);
  struct Reading {
    std::mutex mutex;
    std::vector<std::pair<int, std::int64_t>> seen;
  } reading;
  OniCallbackHandle handle = nullptr;
  const auto take = [](OniStreamHandle s, void* to) {
    OniFrame* frame = nullptr;
    if (oniStreamReadFrame(s, &frame) != ONI_STATUS_OK) return;
    auto& all = *static_cast<Reading*>(to);
    const std::scoped_lock lock{all.mutex};
    all.seen.emplace_back(frame->frameIndex, static_cast<std::int64_t>(frame->timestamp));
    oniFrameRelease(frame);
  };
  ASSERT_EQ(oniStreamRegisterNewFrameCallback(stream.get(), take, &reading, &handle), ONI_STATUS_OK);
  ASSERT_EQ(oniStreamStart(stream.get()), ONI_STATUS_OK);
  EXPECT_TRUE(eventually([&] {
    const std::scoped_lock lock{reading.mutex};
    return reading.seen.size() >= 10;
  }));
  oniStreamStop(stream.get());
  oniStreamUnregisterNewFrameCallback(stream.get(), handle);
  // At 50 Hz a number stands for 20 ms: so it is where frames were lost, by the fault or by a slow test.
  for (std::size_t i = 1; i < reading.seen.size(); ++i) {
    const auto [index, stamp] = reading.seen[i];
    const auto [index_before, stamp_before] = reading.seen[i - 1];
    EXPECT_NEAR(static_cast<double>(stamp - stamp_before) / 20'000.0, index - index_before, 0.01);
  }
  std::set<int> indices;
  for (const auto& [index, stamp] : reading.seen) indices.insert(index);
  EXPECT_FALSE(indices.contains(4) && indices.contains(5)) << "the fourth and fifth frame were lost";
}

void expectCompliant(const std::string& keys) {
  const drivers::Driver driver = drivers::openni2::row();
  const drivers::Candidate candidate{.driver = &driver,
                                     .keys = keys,
                                     .absent_keys = "uri = 'openni2:toftwin:nobody'",
                                     .absent_name = "toftwin:nobody"};
  for (const drivers::Finding& finding : drivers::checkCompliance(candidate)) {
    EXPECT_NE(finding.outcome, drivers::Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
  }
}

TEST_F(OpenNI2Plugin, OurOwnDriverForOpenNI2IsCompliantOnIt) {
  startWith(kSmallSim);
  expectCompliant("uri = 'openni2:toftwin:cam'\n");
  oniShutdown();  // the driver keeps the library started as long as its process lives
}

// ---- the library's recorder and player ----------------------------------------------------------

/// The image of a frame that the player gives.
struct Played {
  std::int64_t stamp_us;
  std::vector<std::uint16_t> codes;
};

std::vector<Played> play(const std::string& file, OniSensorType sensor, int frames) {
  const auto device = openDevice(file.c_str());
  const float as_asked = -1.0F;
  oniDeviceSetProperty(device.get(), ONI_DEVICE_PROPERTY_PLAYBACK_SPEED, &as_asked, sizeof as_asked);
  const auto stream = createStream(device, sensor);
  EXPECT_EQ(oniStreamStart(stream.get()), ONI_STATUS_OK);
  std::vector<Played> played;
  for (int i = 0; i < frames; ++i) {
    const auto frame = readFrame(stream);
    if (frame == nullptr) break;
    Played one{static_cast<std::int64_t>(frame->timestamp), {}};
    for (int y = 0; y < frame->height; ++y) {
      for (int x = 0; x < frame->width; ++x) one.codes.push_back(wordAt(*frame, x, y));
    }
    played.push_back(std::move(one));
  }
  oniStreamStop(stream.get());
  return played;
}

TEST_F(OpenNI2Plugin, AllFramesOfARecordingArePlayedBitForBit) {
  startWith(kSmallSim);
  const std::string file = folder_ / "recorded.oni";
  auto native_client = client();
  auto natives = native_client.subscribe("cam", {.policy = Policy::Queue, .queue = 64});
  ASSERT_TRUE(natives.ok());
  int recorded = 0;
  {
    const auto device = openDevice("toftwin:cam");
    const auto depth = createStream(device, ONI_SENSOR_DEPTH);
    OniRecorderHandle recorder = nullptr;
    ASSERT_EQ(oniCreateRecorder(file.c_str(), &recorder), ONI_STATUS_OK);
    ASSERT_EQ(oniRecorderAttachStream(recorder, depth.get(), FALSE), ONI_STATUS_OK);
    ASSERT_EQ(oniRecorderStart(recorder), ONI_STATUS_OK);
    ASSERT_EQ(oniStreamStart(depth.get()), ONI_STATUS_OK);
    for (; recorded < 12; ++recorded) ASSERT_NE(readFrame(depth), nullptr);
    oniStreamStop(depth.get());
    oniRecorderStop(recorder);
    oniRecorderDestroy(&recorder);
  }
  std::vector<Frame> all;  // until after the last that can be in the file
  while (static_cast<int>(all.size()) < recorded + 4) {
    auto frame = natives->next(kSoon);
    ASSERT_TRUE(frame.ok());
    all.push_back(*std::move(frame));
  }
  const auto isSame = [](const Played& one, const Frame& frame) {
    const auto depth_m = frame.find(PlaneKind::Depth)->as<float>();
    for (std::size_t i = 0; i < depth_m.size(); ++i) {
      const double mm = std::round(1000.0 * static_cast<double>(depth_m[i]));
      if (one.codes[i] != (mm >= 1.0 && mm < 10'000.0 ? static_cast<std::uint16_t>(mm) : 0)) return false;
    }
    return true;
  };
  // The library's recorder writes in a thread of its own: the last that was read may have come after it
  // stopped.
  const auto played = play(file, ONI_SENSOR_DEPTH, recorded - 1);
  ASSERT_EQ(static_cast<int>(played.size()), recorded - 1);
  const auto first = std::ranges::find_if(all, [&](const Frame& frame) { return isSame(played.front(), frame); });
  ASSERT_NE(first, all.end());
  for (std::size_t i = 0; i < played.size(); ++i) {
    ASSERT_LT(first + static_cast<std::ptrdiff_t>(i), all.end());
    const Frame& native = *(first + static_cast<std::ptrdiff_t>(i));
    EXPECT_TRUE(isSame(played[i], native)) << i;
    EXPECT_EQ(played[i].stamp_us, microsecondsOf(native) - microsecondsOf(*first)) << i;
  }
}

// ---- as a guest in the process -----------------------------------------------------------------

int entriesOf(const char* folder) {
  const std::filesystem::directory_iterator all{folder};
  return static_cast<int>(std::distance(begin(all), end(all)));
}

TEST(OpenNI2PluginModule, ExportsWhatOpenNI2LooksUpAndNothingElse) {
  void* plugin = ::dlopen(TOFTWIN_ONI_PLUGIN, RTLD_NOW | RTLD_LOCAL);
  ASSERT_NE(plugin, nullptr) << ::dlerror();
  EXPECT_NE(::dlsym(plugin, "oniDriverCreate"), nullptr);
  EXPECT_EQ(::dlsym(plugin, "g_pDriver"), nullptr) << "of OpenNI2's header, which does not hide it";
  EXPECT_EQ(::dlsym(plugin, "_ZN7toftwin17defaultSocketPathB5cxx11Ev"), nullptr) << "of the client";
  ::dlclose(plugin);
}

TEST_F(OpenNI2Plugin, NothingIsLeftWhenTheLibraryEnds) {
  startWith(kPattern);
  shutdown();
  const int threads = entriesOf("/proc/self/task"), files = entriesOf("/proc/self/fd");
  for (int round = 0; round < 10; ++round) {
    initialize("unix:" + daemon_->socketPath());
    {
      const auto device = openDevice("toftwin:cam");
      const auto stream = createStream(device, ONI_SENSOR_DEPTH);
      ASSERT_EQ(oniStreamStart(stream.get()), ONI_STATUS_OK);
      ASSERT_NE(readFrame(stream), nullptr);
      oniStreamStop(stream.get());
    }
    shutdown();
    EXPECT_EQ(::dlopen(TOFTWIN_ONI_PLUGIN, RTLD_NOW | RTLD_NOLOAD), nullptr) << "it is still in memory";
  }
  EXPECT_TRUE(eventually([&] { return entriesOf("/proc/self/task") <= threads; })) << "the daemon's session ends late";
  EXPECT_TRUE(eventually([&] { return entriesOf("/proc/self/fd") <= files; }));
}

/// The plug-in without OpenNI2: what it is told in whatever order, and destroyed where a program may do so.
struct Host {
  void (*destroy)() = nullptr;
  std::atomic<int> told{0};
  std::atomic<bool> is_over{false};

  static void ONI_CALLBACK_TYPE connected(const OniDeviceInfo*, void* self) {
    auto& it = *static_cast<Host*>(self);
    if (it.told++ == 0) it.destroy();
    it.is_over = true;
  }
  static void ONI_CALLBACK_TYPE disconnected(const OniDeviceInfo*, void*) {}
  static void ONI_CALLBACK_TYPE changed(const OniDeviceInfo*, OniDeviceState, void*) {}
};

// Last: the plug-in stays in memory, as its thread may still be in it.
TEST_F(OpenNI2Plugin, EndedByWhatItTellsItTellsNothingMore) {
  start("[[source]]\nname = 'left'\n" + kPattern + "[[source]]\nname = 'right'\n" + kPattern);
  ::setenv("TOFTWIN_OPENNI2_CONFIG", "/dev/null", 1);
  ::setenv("TOFTWIN_OPENNI2", ("unix:" + daemon_->socketPath()).c_str(), 1);
  stop();
  void* plugin = ::dlopen(TOFTWIN_ONI_PLUGIN, RTLD_NOW | RTLD_LOCAL);
  ASSERT_NE(plugin, nullptr) << ::dlerror();
  const auto create = reinterpret_cast<void (*)(OniDriverServices*)>(::dlsym(plugin, "oniDriverCreate"));
  const auto begin = reinterpret_cast<OniStatus (*)(decltype(&Host::connected), decltype(&Host::disconnected),
                                                    decltype(&Host::changed), void*)>(
      ::dlsym(plugin, "oniDriverInitialize"));
  Host host{.destroy = reinterpret_cast<void (*)()>(::dlsym(plugin, "oniDriverDestroy"))};
  ASSERT_TRUE(create != nullptr && begin != nullptr && host.destroy != nullptr);
  const int threads = entriesOf("/proc/self/task");
  OniDriverServices services{};
  create(&services);
  ASSERT_EQ(begin(Host::connected, Host::disconnected, Host::changed, &host), ONI_STATUS_OK);
  ASSERT_EQ(host.told, 0) << "nobody is there yet";
  start(options());  // both sources come at once, and the plug-in's thread tells of one and is ended
  EXPECT_TRUE(eventually([&] { return host.is_over.load(); }));
  stop();
  EXPECT_TRUE(eventually([&] { return entriesOf("/proc/self/task") <= threads; })) << "its thread has not ended";
  EXPECT_EQ(host.told, 1);
  ::dlclose(plugin);
}

}  // namespace
}  // namespace toftwin::daemon
