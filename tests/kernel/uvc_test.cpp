// SPDX-License-Identifier: Apache-2.0
// The v4l2 driver on the kernel's uvcvideo with USB depth cameras that are
// programs: plugged in, pulled out, damaged and hung.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "../drivers/recovery_rig.h"
#include "usbip_port.h"
#include "uvc_camera.h"
#include "v4l2_cameras.h"

namespace toftwin::kernel_test {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

// The controller's first port, and its first port of SuperSpeed.
constexpr const char *kUvcUri = "v4l2:usb-vhci_hcd.0-1", *kSuperUri = "v4l2:usb-vhci_hcd.0-9";

bool isThere(const std::string& uri) {
  return std::ranges::count(drivers::v4l2::row().list(), uri) > 0;
}
/// Until the kernel has, or has no longer, a node for the camera.
void waitUntil(const std::string& uri, bool there) {
  for (int i = 0; i < 500 && isThere(uri) != there; ++i) {
    std::this_thread::sleep_for(milliseconds{10});
  }
  ASSERT_EQ(isThere(uri), there) << uri;
}

/// A camera in its port.
struct Plugged {
  explicit Plugged(UvcCamera::Options options = {})
      : uri(options.speed == UsbSpeed::Super ? kSuperUri : kUvcUri),
        camera(std::make_shared<UvcCamera>(options)),
        port(std::make_unique<UsbIpPort>(0, camera)) {
    waitUntil(uri, true);
  }
  ~Plugged() {
    port.reset();
    waitUntil(uri, false);
  }
  Plugged(const Plugged&) = delete;
  Plugged& operator=(const Plugged&) = delete;
  std::string uri;
  std::shared_ptr<UvcCamera> camera;
  std::unique_ptr<UsbIpPort> port;
};

std::string keys(const std::string& more = {}, const std::string& uri = kUvcUri) {
  return fmt::format("uri = '{}'\n{}", uri, more);
}

/// Every pixel is what the camera sent in the picture whose number the first
/// pixel tells.
std::uint32_t expectExact(const Frame& frame) {
  const auto depth_m = frame.find(PlaneKind::Depth)->as<float>();
  const auto number =
      UvcCamera::frameOf(static_cast<std::uint16_t>(std::lround(depth_m[0] * 1000.0F)));
  std::size_t wrong = 0, i = 0;
  for (std::uint32_t y = 0; y < UvcCamera::kHeight; ++y) {
    for (std::uint32_t x = 0; x < UvcCamera::kWidth; ++x, ++i) {
      const std::uint16_t code = UvcCamera::codeAt(number, 0, x, y);
      const bool is_right =
          code == 0 ? std::isnan(depth_m[i]) : std::abs(depth_m[i] - code * 1e-3) < 1e-6;
      wrong += is_right ? 0 : 1;
    }
  }
  EXPECT_EQ(wrong, 0u) << "pixels of picture " << number;
  return number;
}

TEST(Uvc, IsCompliantWithItsUriAlone) {
  const Plugged plugged;
  EXPECT_EQ(drivers::v4l2::row().list(), std::vector<std::string>{kUvcUri});
  expectCompliant(kUvcUri);
}

TEST(Uvc, PicturesAreWhatTheCameraSentOneAfterTheOther) {
  using Endpoint = UvcCamera::Endpoint;
  for (const auto& [endpoint, speed] : {std::pair{Endpoint::Bulk, UsbSpeed::High},
                                        {Endpoint::Isochronous, UsbSpeed::High},
                                        {Endpoint::Bulk, UsbSpeed::Super},
                                        {Endpoint::Isochronous, UsbSpeed::Super}}) {
    const Plugged plugged{{.endpoint = endpoint, .speed = speed}};
    const auto source = started(keys("delay_ms = 1", plugged.uri));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().model, UvcCamera::kName);
    EXPECT_EQ(source->info().serial, UvcCamera::kSerial);
    std::optional<std::uint32_t> last;
    for (int i = 0; i < 15; ++i) {
      const auto frame = nextFrame(*source);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      const std::uint32_t number = expectExact(*frame);
      if (last) {
        EXPECT_EQ(number - *last, 1 + frame->dropped_by_device);
      }
      last = number;
      EXPECT_GE(frame->moment.clock.uncertainty_ns, 0) << "uvcvideo stamps with the host's clock";
      EXPECT_LT(frame->moment.clock.uncertainty_ns, 1'000'000);
    }
  }
}

TEST(Uvc, WhatTheBusCallsInvzIsDepthAsItIs) {
  const Plugged plugged{{.says_invz = true}};
  const auto formats = drivers::v4l2::row().formats(kUvcUri);
  ASSERT_FALSE(formats.empty());
  EXPECT_NE(formats[0].find("Z16, 160 x 120, 30"), std::string::npos) << formats[0];
  const auto source = started(keys());
  ASSERT_NE(source, nullptr);
  for (int i = 0; i < 3; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    expectExact(*frame);
  }
}

TEST(Uvc, TwoNodesAreDepthAndInfrared) {
  const Plugged plugged{{.has_infrared = true}};
  std::ofstream{"/tmp/two.toml"} << "[depth]\nformat = 'Z16'\n[infrared]\nformat = 'Y16'\n"
                                    "[lens]\nfx = 150\ncx = 79.5\ncy = 59.5\n";
  const auto source = started(keys("camera = '/tmp/two.toml'"));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().planes,
            (std::vector<PlaneKind>{PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude,
                                    PlaneKind::Flags}));
  for (int i = 0; i < 10; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    expectExact(*frame);
    const auto amplitude = frame->find(PlaneKind::Amplitude)->as<float>();
    EXPECT_EQ(amplitude[1], 256.0F);
    EXPECT_EQ(amplitude[UvcCamera::kWidth], 1.0F);
  }
}

TEST(Uvc, ControlsReachTheCamera) {
  const Plugged plugged;
  const auto opened = open(keys("set = ['gain = 12', 'exposure_us = 4000']"));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  EXPECT_EQ(plugged.camera->gain(), 12);
  EXPECT_EQ(plugged.camera->exposure_100us(), 40u);
  ASSERT_TRUE((*opened)->setParameter("gain", 3).ok());
  EXPECT_EQ(plugged.camera->gain(), 3);
  EXPECT_FALSE((*opened)->setParameter("gain", UvcCamera::kMostGain + 1).ok());
}

// uvcvideo throws damaged pictures away and leaves their number out. If it is told not to, it
// passes on short ones, without the error flag; what else the camera says of damage is then lost.
TEST(Uvc, DamagedPicturesAreCountedWhetherTheKernelPassesThemOnOrNot) {
  for (const bool passes_on : {false, true}) {
    run(fmt::format("echo {} > /sys/module/uvcvideo/parameters/nodrop", passes_on ? 1 : 0));
    const Plugged plugged;  // it looks at that when a camera comes
    const auto source = started(keys());
    ASSERT_NE(source, nullptr);
    ASSERT_TRUE(nextFrame(*source).ok());
    std::uint64_t lost = 0;
    plugged.camera->truncate(2);
    for (int i = 0; i < 10; ++i) {
      if (i == 5 && !passes_on) plugged.camera->damage(1);
      const auto frame = nextFrame(*source);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      expectExact(*frame);
      lost += frame->dropped_by_device;
    }
    EXPECT_EQ(lost, passes_on ? 2u : 3u) << "nodrop = " << passes_on;
  }
  run("echo 0 > /sys/module/uvcvideo/parameters/nodrop");
}

TEST(Uvc, ACameraThatHangsIsDisconnectedAndStreamsAgainWhenItIsOpenedAnew) {
  const Plugged plugged;
  auto source = started(keys());
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  plugged.camera->hang(true);
  const Error end = endOf(*source);
  EXPECT_EQ(end.code, Error::Code::Disconnected) << end.message;
  plugged.camera->hang(false);
  source.reset();
  source = started(keys());
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(nextFrame(*source).ok());
}

TEST(Uvc, AnotherProgramThatStreamsIsNamedAsTheReason) {
  const Plugged plugged;
  const auto first = started(keys());
  ASSERT_NE(first, nullptr);
  auto second = open(keys());
  const auto outcome = second ? (*second)->start() : Result<>{second.error()};
  ASSERT_FALSE(outcome.ok());
  EXPECT_EQ(outcome.error().code, Error::Code::Busy) << outcome.error().message;
}

TEST(Uvc, OpeningAndClosingLeaksNothing) {
  const Plugged plugged;
  const auto files = [] {
    return std::distance(std::filesystem::directory_iterator{"/proc/self/fd"}, {});
  };
  const auto before = files();
  for (int i = 0; i < 20; ++i) {
    const auto source = started(keys());
    ASSERT_NE(source, nullptr);
    if (i % 5 == 0) {
      EXPECT_TRUE(nextFrame(*source).ok());
    }
  }
  EXPECT_EQ(files(), before);
}

/// What came after the gap: within a second, exact, told as a gap, and with the
/// settings of before.
void expectRecovered(const std::optional<test::RecoveryRig::Outcome>& outcome, milliseconds boot,
                     const UvcCamera& camera) {
  ASSERT_TRUE(outcome.has_value()) << "the stream did not go on";
  EXPECT_LT(outcome->took, milliseconds{1000} + boot);
  expectExact(outcome->first);
  EXPECT_GT(outcome->first.dropped_by_device, 0u) << "the gap has no frames";
  EXPECT_GT(outcome->first.moment.exposures[0].start, outcome->last.moment.exposures[0].start);
  EXPECT_EQ(camera.gain(), 12) << "what a client had set";
}

const auto kSetGain = [](drivers::Source& source) { return source.setParameter("gain", 12); };

TEST(Uvc, AClientOfTheDaemonKeepsItsStreamWhenTheCameraIsPulledAndComesBack) {
  auto plugged = std::make_unique<Plugged>();
  test::RecoveryRig rig{[] { return open(keys()); }};
  ASSERT_TRUE(rig.isSubscribed());
  ASSERT_TRUE(rig.command(kSetGain).ok());
  milliseconds boot{};  // the kernel looks at the device, and makes the node
  const auto outcome = rig.loseAndFind(
      "pulled, with what the kernel takes to find it", milliseconds{700}, [&] { plugged.reset(); },
      [&] {
        const auto plugged_in = Clock::now();
        plugged = std::make_unique<Plugged>();
        boot = std::chrono::duration_cast<milliseconds>(Clock::now() - plugged_in);
        std::printf("the kernel took %lld ms of it\n", static_cast<long long>(boot.count()));
      });
  expectRecovered(outcome, boot, *plugged->camera);
}

TEST(Uvc, AClientOfTheDaemonKeepsItsStreamWhenTheCameraHangsForAWhile) {
  const Plugged plugged;
  test::RecoveryRig rig{[] { return open(keys()); }};
  ASSERT_TRUE(rig.isSubscribed());
  ASSERT_TRUE(rig.command(kSetGain).ok());
  const auto outcome = rig.loseAndFind(
      "hangs", milliseconds{700}, [&] { plugged.camera->hang(true); },
      [&] { plugged.camera->hang(false); });
  expectRecovered(outcome, milliseconds{0}, *plugged.camera);
}

}  // namespace
}  // namespace toftwin::kernel_test
