// SPDX-License-Identifier: Apache-2.0
// The v4l2 driver on vivid, the kernel's own virtual camera: every format, and errors that the
// kernel makes on purpose.
#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "drivers/compliance.h"
#include "v4l2_cameras.h"

namespace toftwin::kernel_test {
namespace {

constexpr const char* kUri = "v4l2:platform:vivid-000";
// vivid's own controls, by their names.
constexpr const char *kTextMode = "OSD Text Mode",
                     *kPercentDropped = "Percentage of Dropped Buffers",
                     *kWrapSequence = "Wrap Sequence Number", *kDisconnect = "Disconnect",
                     *kFlagError = "Inject V4L2_BUF_FLAG_ERROR",
                     *kBuffersError = "Inject VIDIOC_REQBUFS Error",
                     *kQueueError = "Inject VIDIOC_QBUF Error",
                     *kStartError = "Inject VIDIOC_STREAMON Error",
                     *kFatalError = "Inject Fatal Streaming Error";

/// A description of vivid with that format, as a file.
std::string keysFor(const std::string& format, const std::string& more = {}) {
  const std::string file = "/tmp/vivid_" + format + ".toml";
  std::ofstream{file} << fmt::format(
      "[depth]\nformat = '{}'\nwidth = 320\nheight = 180\n[lens]\nfield_of_view_deg = 60\n",
      format);
  return fmt::format("uri = '{}'\ncamera = '{}'\n{}", kUri, file, more);
}

class Vivid : public testing::Test {
 protected:
  void SetUp() override {
    // One capture node with a webcam's input.
    run("modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0");
    set(kTextMode, 2);  // no text, so that pictures do not change
  }
  void TearDown() override {
    device_.reset();
    run("rmmod vivid");
  }
  void set(const std::string& name, int value) {
    if (!device_) {
      auto opened = drivers::v4l2::Device::open(drivers::v4l2::kernel(), "/dev/video0");
      ASSERT_TRUE(opened.ok()) << opened.error().message;
      device_ = std::make_unique<drivers::v4l2::Device>(*std::move(opened));
    }
    std::string known;
    v4l2_queryctrl control{};
    control.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    while (device_->control(VIDIOC_QUERYCTRL, &control) == 0) {
      const std::string here = reinterpret_cast<const char*>(control.name);
      known += "\n" + here;
      v4l2_control wish{control.id, value};
      if (here == name.substr(0, sizeof control.name - 1)) {
        ASSERT_EQ(device_->control(VIDIOC_S_CTRL, &wish), 0) << name;
        return;
      }
      control.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    }
    FAIL() << "vivid has no control " << name << ", but:" << known;
  }

 private:
  std::unique_ptr<drivers::v4l2::Device> device_;
};

TEST_F(Vivid, IsCompliant) {
  expectCompliant(kUri, keysFor("Y16").substr(keysFor("Y16").find('\n')));
}

// vivid makes grey of 8 bits and moves it up to the bits of each format.
TEST_F(Vivid, EveryFormatShowsTheSamePicture) {
  std::vector<float> grey;
  for (const auto& [format, unit] :
       {std::pair{"Y8", 1.0}, {"Y10", 4.0}, {"Y12", 16.0}, {"Y16", 256.0}}) {
    for (const char* memory : {"mmap", "dmabuf"}) {
      const auto source = started(keysFor(format, fmt::format("memory = '{}'", memory)));
      ASSERT_NE(source, nullptr) << format;
      const auto frame = nextFrame(*source);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      const auto depth_m = frame->find(PlaneKind::Depth)->as<float>();
      ASSERT_EQ(depth_m.size(), 320u * 180u);
      std::vector<float> here;
      for (const float value_m : depth_m) {
        const double code = std::isnan(value_m) ? 0.0 : std::round(value_m * 1000.0);
        here.push_back(static_cast<float>(std::floor(code / unit)));
      }
      if (grey.empty()) grey = here;
      EXPECT_EQ(here, grey) << format << " " << memory;
    }
  }
  EXPECT_GT(*std::ranges::max_element(grey), 100.0F) << "a picture of bars, not black";
}

// The kernel sets another format than it was asked for, and calls it success.
TEST_F(Vivid, AFormatThatItLacksIsNotTakenForAnother) {
  std::ofstream{"/tmp/z16.toml"} << "[depth]\nnode = 0\nformat = 'Z16'\n";
  const auto opened = open(fmt::format("uri = '{}'\ncamera = '/tmp/z16.toml'", kUri));
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().message.find("has no format Z16"), std::string::npos)
      << opened.error().message;
}

TEST_F(Vivid, WhatTheKernelDropsIsCountedAlsoWhereItsCountWrapsAround) {
  auto opened = open(keysFor("Y16", "frame_rate_hz = 60"));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  set(kWrapSequence, 1);  // it begins 128 before
  set(kPercentDropped, 30);
  ASSERT_TRUE((*opened)->start().ok());
  constexpr int kFrames = 120;
  std::vector<DeviceTime> times;
  std::uint64_t lost = 0;
  for (int i = 0; i < kFrames; ++i) {
    const auto frame = nextFrame(**opened);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    if (i > 0) lost += frame->dropped_by_device;
    times.push_back(frame->moment.exposures.at(0).start);
  }
  // Frames that came and those that were lost fill the time that passed: 60 a second, within one at
  // each end.
  const double passed_s = static_cast<double>(times.back().ns - times.front().ns) * 1e-9;
  EXPECT_NEAR(static_cast<double>(lost) + kFrames - 1, 60.0 * passed_s, 2.0);
  // Each is dropped with a chance of 0.3: 119 · 0.3/0.7 = 51 are, ± √(119 · 0.3)/0.7 = 8.5. The
  // count wraps if there are 9, which chance misses (5 standard deviations) less than once in 10⁶
  // runs.
  EXPECT_GE(lost + kFrames, 129u) << "the count did not wrap";
}

TEST_F(Vivid, APictureWithTheErrorFlagIsCountedAndNotShown) {
  const auto source = started(keysFor("Y16"));
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  set(kFlagError, 1);
  std::uint64_t lost = 0;
  for (int i = 0; i < 10; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    lost += frame->dropped_by_device;
  }
  EXPECT_EQ(lost, 1u);
}

TEST_F(Vivid, AStreamThatDiesIsDisconnectedAndCanBeOpenedAnew) {
  auto source = started(keysFor("Y16"));
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  set(kFatalError, 1);
  const Error end = endOf(*source);
  EXPECT_EQ(end.code, Error::Code::Disconnected) << end.message;
  source.reset();
  source = started(keysFor("Y16"));
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(nextFrame(*source).ok());
}

TEST_F(Vivid, AStartThatFailsSaysSoAndTheNextOneWorks) {
  for (const char* error : {kBuffersError, kQueueError, kStartError}) {
    auto opened = open(keysFor("Y16"));
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    set(error, 1);
    const auto failed = (*opened)->start();
    ASSERT_FALSE(failed.ok());
    EXPECT_NE(failed.error().message.find("/dev/video0"), std::string::npos);
    const auto begun = (*opened)->start();
    ASSERT_TRUE(begun.ok()) << begun.error().message;
    EXPECT_TRUE(nextFrame(**opened).ok());
  }
}

TEST_F(Vivid, ADriverThatGoesAwayIsDisconnected) {
  auto source = started(keysFor("Y16"));
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  set(kDisconnect, 1);
  const Error end = endOf(*source);
  EXPECT_EQ(end.code, Error::Code::Disconnected) << end.message;
  source.reset();
  EXPECT_FALSE(open(keysFor("Y16")).ok());
}

}  // namespace

// NOLINTNEXTLINE(misc-use-internal-linkage): declared in v4l2_cameras.h
void expectCompliant(const std::string& uri, const std::string& more_keys) {
  const drivers::Driver driver = drivers::v4l2::row();
  drivers::Candidate candidate = drivers::listedCamera(driver, uri);
  candidate.keys += "\n" + more_keys;
  int passed = 0;
  for (const drivers::Finding& finding : drivers::checkCompliance(candidate)) {
    EXPECT_NE(finding.outcome, drivers::Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
    passed += finding.outcome == drivers::Finding::Outcome::Passed ? 1 : 0;
  }
  EXPECT_GE(passed, 9) << "of twelve, of which three do not apply to a camera in free run";
}

}  // namespace toftwin::kernel_test
