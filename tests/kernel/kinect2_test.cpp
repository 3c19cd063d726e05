// SPDX-License-Identifier: Apache-2.0
// The kinect2 driver with the real libusb and the kernel's USB, and a camera that is a program: found, asked,
// streamed from, damaged, hung and pulled out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <thread>

#include "../drivers/recovery_rig.h"
#include "drivers/compliance.h"
#include "drivers/kinect2/kinect2.h"
#include "drivers/kinect2/samples.h"
#include "kinect2_device.h"
#include "plugged.h"

namespace toftwin::kernel_test {
namespace {

using namespace drivers::kinect2;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;
using test::EmulatedKinect2;

constexpr const char* kUri = "kinect2:003370163847";
/// The machine is slow, and what is made of the samples has nothing to do with USB.
constexpr const char* kQuick = "planes = ['samples']\n";

/// Any bytes are samples.
drivers::kinect2::Bytes someImages() {
  drivers::kinect2::Bytes bytes(kImages * kImageBytes);
  std::uint64_t state = 88172645463325252U;  // Marsaglia's xorshift64
  for (std::size_t at = 0; at < bytes.size(); at += sizeof state) {
    state ^= state << 13U;
    state ^= state >> 7U;
    state ^= state << 17U;
    std::memcpy(&bytes[at], &state, sizeof state);
  }
  return bytes;
}

std::shared_ptr<Kinect2Device> deviceOf(Kinect2Device::Options options) {
  static const drivers::kinect2::Bytes images = someImages();
  options.camera.images = images;
  return std::make_shared<Kinect2Device>(options);
}

/// A camera in its port.
struct Plugged : PluggedIn<Kinect2Device> {
  explicit Plugged(Kinect2Device::Options options = {})
      : PluggedIn<Kinect2Device>(deviceOf(options), [] { return !row().list().empty(); }) {}
};

Result<std::unique_ptr<drivers::Source>> open(const std::string& more = {}) {
  auto table = settings::Table::parse(fmt::format("uri = '{}'\n{}{}", kUri, kQuick, more), "kinect2.toml");
  return row().open(*table);
}

std::unique_ptr<drivers::Source> started(const std::string& more = {}) {
  auto opened = open(more);
  EXPECT_TRUE(opened.ok()) << opened.error().message;
  if (!opened) return nullptr;
  const auto begun = (*opened)->start();
  EXPECT_TRUE(begun.ok()) << begun.error().message;
  return begun ? *std::move(opened) : nullptr;
}

Result<Frame> nextFrame(drivers::Source& source) {
  for (int i = 0; i < 10; ++i) {
    Result<Frame> frame = source.next({}, false);
    if (frame || frame.error().code != Error::Code::Timeout) return frame;
  }
  return Error{Error::Code::Timeout, "no frame for long"};
}

/// The camera's number, modulo 1000, of a frame.
std::uint32_t numberIn(const Frame& frame) {
  return test::codeOf(frame.find(PlaneKind::Samples)->as<float>()[kWidth - 2]);
}

/// Every sample is as it was sent, with left and right exchanged; but for the number.
void expectExact(const Frame& frame, const Plugged& plugged) {
  const auto values = frame.find(PlaneKind::Samples)->as<float>();
  const auto& images = plugged.camera().options().images;
  const sim::Samples sent = samplesOf(std::span{images}.first(kUsedImages * kImageBytes));
  std::size_t wrong = 0, i = 0;
  for (const Image<float>& image : sent.electrons) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x, ++i)
        wrong += values[i] != image(kWidth - 1 - x, y) && i != kWidth - 2 ? 1 : 0;
    }
  }
  EXPECT_EQ(wrong, 0u);
}

TEST(Kinect2Usb, IsFoundAndSaysWhatItIs) {
  const Plugged plugged;
  EXPECT_EQ(row().list(), std::vector<std::string>{kUri});
  const auto opened = open();
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  EXPECT_EQ((*opened)->info().serial, "003370163847");
  EXPECT_EQ((*opened)->info().model, "Microsoft Kinect v2 (for Windows)");
  EXPECT_NEAR((*opened)->info().camera.fx, 365.8608, 1e-4);
}

TEST(Kinect2Usb, FramesAreWhatTheCameraSentAndWhatTheBusLosesIsCounted) {
  const Plugged plugged;
  const auto source = started();
  ASSERT_NE(source, nullptr);
  std::optional<std::uint32_t> last;
  std::uint64_t lost = 0, steps = 0;
  for (int i = 0; i < 6; ++i) {
    if (i == 2) plugged.camera().losePackets(3);
    if (i == 4) plugged.camera().shortenImages(1);
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    if (i % 5 == 0) expectExact(*frame, plugged);
    const std::uint32_t number = numberIn(*frame);
    // 65535 is followed by 0, the codes 535 by 0.
    if (last) steps += (number > *last ? number - *last : number + 536 - *last) - 1;
    if (last) lost += frame->dropped_by_device;
    last = number;
  }
  EXPECT_EQ(lost, steps);
  EXPECT_GE(lost, 2u);
}

TEST(Kinect2Usb, IsCompliant) {
  const Plugged plugged;
  drivers::Driver driver = row();
  driver.open = [](settings::Table& table) { return row().open(table); };
  drivers::Candidate candidate = drivers::listedCamera(driver, kUri);
  candidate.keys += fmt::format("\n{}", kQuick);
  int passed = 0;
  for (const drivers::Finding& finding : drivers::checkCompliance(candidate, {.frames = 2})) {
    EXPECT_NE(finding.outcome, drivers::Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
    passed += finding.outcome == drivers::Finding::Outcome::Passed ? 1 : 0;
  }
  EXPECT_GE(passed, 9) << "of twelve, of which three do not apply to a camera in free run";
}

TEST(Kinect2Usb, OnUsb2SaysThatItNeedsUsb3) {
  const Plugged plugged{{.speed = UsbSpeed::High}};
  const auto opened = open();
  ASSERT_FALSE(opened.ok());
  EXPECT_THAT(opened.error().message, testing::HasSubstr("it is not on USB 3"));
}

TEST(Kinect2Usb, ThatAnotherProgramHasIsBusy) {
  const Plugged plugged;
  const auto first = open();
  ASSERT_TRUE(first.ok()) << first.error().message;
  const auto second = open("reset = false");
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, Error::Code::Busy) << second.error().message;
}

TEST(Kinect2Usb, TransfersThatTheKernelHasNoMemoryForAreAnErrorThatSaysHowMany) {
  const Plugged plugged;
  const auto opened = open("transfers = 100");
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const auto begun = (*opened)->start();
  ASSERT_FALSE(begun.ok());
  EXPECT_THAT(begun.error().message, testing::HasSubstr("usbfs_memory_mb"));
}

TEST(Kinect2Usb, OpeningAndClosingLeaksNothing) {
  const Plugged plugged;
  const auto files = [] { return std::distance(std::filesystem::directory_iterator{"/proc/self/fd"}, {}); };
  ASSERT_NE(started(), nullptr);
  const auto before = files();
  for (int i = 0; i < 5; ++i) {
    const auto source = started();
    ASSERT_NE(source, nullptr);
  }
  EXPECT_EQ(files(), before);
}

/// Soon, told as a gap, and with the settings of before.
void expectRecovered(test::RecoveryRig& rig, const std::optional<test::RecoveryRig::Outcome>& outcome,
                     milliseconds boot) {
  ASSERT_TRUE(outcome.has_value()) << "the stream did not go on";
  EXPECT_LT(outcome->took, test::kBackWithin + boot);
  EXPECT_GT(outcome->first.dropped_by_device, 0u) << "the gap has no frames";
  EXPECT_GT(outcome->first.moment.exposures[0].start, outcome->last.moment.exposures[0].start);
  const auto set = rig.command([](drivers::Source& source) -> Result<> {
    EXPECT_EQ(source.state().parameters[1].value, 3.25) << "what a client had set";
    return {};
  });
  EXPECT_TRUE(set.ok());
}

const auto kSetFarthest = [](drivers::Source& source) { return source.setParameter("farthest_m", 3.25); };

TEST(Kinect2Usb, AClientOfTheDaemonKeepsItsStreamWhenTheCameraIsPulledAndComesBack) {
  auto plugged = std::make_unique<Plugged>();
  test::RecoveryRig rig{[] { return open(); }};
  ASSERT_TRUE(rig.isSubscribed());
  ASSERT_TRUE(rig.command(kSetFarthest).ok());
  milliseconds boot{};  // until the kernel lists it
  const auto outcome = rig.loseAndFind(
      "pulled, with what the kernel takes to find it", milliseconds{700}, [&] { plugged.reset(); },
      [&] {
        const auto plugged_in = Clock::now();
        plugged = std::make_unique<Plugged>();
        boot = std::chrono::duration_cast<milliseconds>(Clock::now() - plugged_in);
        std::printf("the kernel took %lld ms of it\n", static_cast<long long>(boot.count()));
      });
  expectRecovered(rig, outcome, boot);
}

TEST(Kinect2Usb, AClientOfTheDaemonKeepsItsStreamWhenTheCameraHangsForAWhile) {
  const Plugged plugged;
  test::RecoveryRig rig{[] { return open(); }};
  ASSERT_TRUE(rig.isSubscribed());
  ASSERT_TRUE(rig.command(kSetFarthest).ok());
  const auto outcome = rig.loseAndFind(
      "hangs", milliseconds{700}, [&] { plugged.camera().hang(true); },
      [&] { plugged.camera().hang(false); });
  // One question that it never answered may be under way, which takes a second.
  expectRecovered(rig, outcome, milliseconds{1000});
}

}  // namespace
}  // namespace toftwin::kernel_test
