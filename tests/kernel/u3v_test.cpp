// SPDX-License-Identifier: Apache-2.0
// The aravis driver with the real libaravis, libusb and the kernel's USB, and a USB3 Vision camera that is a
// program: found, set, streamed from, damaged, hung and pulled out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "../drivers/recovery_rig.h"
#include "../drivers/start_stop.h"
#include "drivers/aravis/aravis.h"
#include "drivers/compliance.h"
#include "drivers/usb/cameras.h"
#include "drivers/usb/watch.h"
#include "plugged.h"
#include "u3v_device.h"

namespace toftwin::kernel_test::u3v {
namespace {

using drivers::aravis::row;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;
using Damage = U3vCamera::Damage;

constexpr const char* kSerial = "U3V-1";
/// The machine is slow: 48 × 32 pixels, 20 times a second.
constexpr double kInterval_ms = 50.0;

/// A camera in its port.
struct Plugged : PluggedIn<U3vDevice> {
  explicit Plugged(UsbSpeed speed = UsbSpeed::Super)
      : PluggedIn<U3vDevice>(std::make_shared<U3vDevice>(kSerial, speed),
                             [] { return !usb::list().empty(); }) {
    camera().setFloatReg(U3vCamera::kRate, 1e3 / kInterval_ms);
  }
};

Result<std::unique_ptr<drivers::Source>> open(const std::string& more = {}) {
  auto table = settings::Table::parse(fmt::format("uri = 'aravis:{}'\n{}", kSerial, more), "aravis.toml");
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
    const bool goes_on = !frame && (frame.error().code == Error::Code::Malformed ||
                                    frame.error().code == Error::Code::Timeout);
    if (!goes_on) return frame;
  }
  return Error{Error::Code::Timeout, "no frame for long"};
}

/// Which frame it is, modulo 64, by its first pixel with a value: (1, 0).
std::uint64_t countIn(const Frame& frame) {
  const double depth_mm = 1e3 * static_cast<double>(frame.find(PlaneKind::Depth)->as<float>()[1]);
  const auto code = std::lround((depth_mm - U3vCamera::kOffset_mm) / U3vCamera::kScale_mm);
  return static_cast<std::uint64_t>(code - U3vCamera::rangeCode(0, 1, 0));
}

void expectWhatWasSent(const Frame& frame) {
  const std::uint64_t n = countIn(frame);
  const auto range_m = frame.find(PlaneKind::Range)->as<float>(),
             depth_m = frame.find(PlaneKind::Depth)->as<float>();
  const auto flags = frame.find(PlaneKind::Flags)->as<std::uint8_t>();
  std::size_t i = 0;
  for (int y = 0; y < U3vCamera::kHeight; ++y) {
    for (int x = 0; x < U3vCamera::kWidth; ++x, ++i) {
      const std::uint16_t code = U3vCamera::rangeCode(n, x, y);
      ASSERT_EQ(flags[i], code == 0 ? 1 : 0);
      ASSERT_EQ(std::isnan(depth_m[i]) && std::isnan(range_m[i]), code == 0) << x << " " << y;
      if (code == 0) continue;
      const double expected_m = 1e-3 * (U3vCamera::kScale_mm * code + U3vCamera::kOffset_mm);
      const double a = (x - U3vCamera::kU_px) / U3vCamera::kFocal_px,
                   b = (y - U3vCamera::kV_px) / U3vCamera::kFocal_px;
      ASSERT_NEAR(depth_m[i], expected_m, 1e-6);  // a float's rounding at 1.3 m
      ASSERT_NEAR(range_m[i], expected_m * std::sqrt(1.0 + a * a + b * b), 1e-6);
    }
  }
}

TEST(Usb3Vision, IsFoundByItsNamesAndSaysWhatItIs) {
  const Plugged plugged;
  EXPECT_EQ(row().list(), std::vector<std::string>{"aravis:toftwin-Emulated ToF-U3V-1"});
  ASSERT_EQ(usb::list().size(), 1u);
  EXPECT_EQ(usb::describe(usb::list()[0]).find("USB3 Vision camera (Emulated ToF) at"), 0u);
  for (const char* uri : {"aravis:U3V-1", "aravis:toftwin-Emulated ToF-U3V-1", "aravis:any",
                          "aravis:toftwin-120900000001-U3V-1"}) {
    auto table = settings::Table::parse(fmt::format("uri = '{}'", uri), "aravis.toml");
    const auto opened = row().open(*table);
    ASSERT_TRUE(opened.ok()) << uri << ": " << opened.error().message;
    EXPECT_EQ((*opened)->info().model, "toftwin Emulated ToF");
    EXPECT_EQ((*opened)->info().serial, kSerial);
    EXPECT_EQ((*opened)->info().camera.fx, U3vCamera::kFocal_px);
    EXPECT_NEAR((*opened)->info().frame_interval->in(millisecond), kInterval_ms, 1e-9);
  }
}

TEST(Usb3Vision, AFrameIsWhatTheCameraSentInOurUnits) {
  const Plugged plugged;
  const auto source = started("chunks = true");
  ASSERT_NE(source, nullptr);
  plugged.camera().setFloatReg(U3vCamera::kExposure,
                               750.0);  // behind the driver's back: a frame's own says it
  std::uint64_t last = 0;
  DeviceTime last_time{};
  for (int i = 0; i < 6; ++i) {  // block ids begin three before 65536, and do not wrap around
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    expectWhatWasSent(*frame);
    EXPECT_NEAR(frame->moment.exposures.at(0).duration.in(microsecond), 750.0, 1e-9);
    EXPECT_EQ(frame->moment.temperatures.at(0).value.in(celsius), 41.5);
    if (i > 0) {
      EXPECT_EQ(frame->dropped_by_device + 1, (countIn(*frame) + 64 - last) % 64);
      EXPECT_GT(frame->moment.exposures[0].start, last_time);
    }
    last = countIn(*frame);
    last_time = frame->moment.exposures[0].start;
  }
}

TEST(Usb3Vision, OneComponentOfAFrameIsRead) {
  const Plugged plugged;
  {
    const auto source = started("components = ['Intensity']");
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().planes, std::vector{PlaneKind::Amplitude});
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    const auto amplitude = frame->find(PlaneKind::Amplitude)->as<float>();
    for (std::size_t i = 0; i < amplitude.size(); ++i) {
      const int x = static_cast<int>(i) % U3vCamera::kWidth, y = static_cast<int>(i) / U3vCamera::kWidth;
      ASSERT_EQ(amplitude[i], static_cast<float>(U3vCamera::intensity(x, y)));
    }
  }
  const auto both = open("components = ['Range', 'Intensity']");
  ASSERT_FALSE(both.ok());
  EXPECT_EQ(both.error().code, Error::Code::Incompatible);
  EXPECT_THAT(both.error().message, testing::HasSubstr("reads only one of a USB camera's frame"));
}

TEST(Usb3Vision, FeaturesAreReadAndSetByNameAlsoWhereTheCameraTakesLong) {
  const Plugged plugged;
  const auto source = started("parameters = ['Gain', 'TriggerActivation', 'UserText']");
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(source->setParameter("Gain", 7.0).ok());
  EXPECT_EQ(plugged.camera().reg(U3vCamera::kGain), 7u);
  EXPECT_FALSE(source->setParameter("Gain", 25.0).ok()) << "it goes to 24";
  ASSERT_TRUE(source->setParameterText("TriggerActivation", "FallingEdge").ok());
  EXPECT_EQ(plugged.camera().reg(U3vCamera::kTriggerActivation), 1u);
  plugged.camera().write_time = 3 * U3vCamera::kResponseTime;
  const auto set = source->setParameterText("UserText", "dock 3");
  EXPECT_TRUE(set.ok()) << set.error().message;
  EXPECT_GE(plugged.camera().pending_answers, 1);
  const auto now = source->state().parameters;
  EXPECT_EQ(now.at(0).value, 7.0);
  EXPECT_EQ(now.at(1).text, "FallingEdge");
  EXPECT_EQ(now.at(2).text, "dock 3");
}

TEST(Usb3Vision, FramesAreTakenWhenTheyAreTriggered) {
  const Plugged plugged;
  const auto source = started("trigger = 'software'");
  ASSERT_NE(source, nullptr);
  for (std::uint64_t n = 0; n < 3; ++n) {
    ASSERT_TRUE(source->trigger().ok());
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_EQ(countIn(*frame), n);
  }
}

// ---- losses ------------------------------------------------------------------------------------

TEST(Usb3Vision, WhatIsDamagedIsLostCountedAndSaid) {
  const Plugged plugged;
  const auto source = started();
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  struct Case {
    Damage damage;
    const char* because;
  };
  for (const auto& [damage, because] : {
           Case{Damage::BadLeader, "nothing of it came (1)"},
           Case{Damage::ShortImage, "it was larger or smaller than the camera had said (1)"},
           Case{Damage::NoTrailer, "nothing of it came (1)"},  // that of the next frame ends it
           Case{Damage::Discarded, "it was larger or smaller than the camera had said (1)"},
       }) {
    plugged.camera().damage_next = damage;
    std::uint64_t lost = 0;
    for (int i = 0; i < 10 && lost == 0; ++i) {
      const auto frame = nextFrame(*source);
      ASSERT_TRUE(frame.ok()) << because << ": " << frame.error().message;
      expectWhatWasSent(*frame);
      lost = frame->dropped_by_device;
      EXPECT_EQ(frame->dropped_because, lost == 0 ? "" : because) << static_cast<int>(damage);
    }
    EXPECT_EQ(lost, 1u) << static_cast<int>(damage);
  }
}

TEST(Usb3Vision, WhatTheCameraLeavesOutIsCountedAndWhatItSendsTooMuchIsLeftOut) {
  const Plugged plugged;
  const auto source = started();
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  plugged.camera().damage_next = Damage::LongImage;
  plugged.camera().skip_frames = 3;
  std::uint64_t lost = 0;
  for (int i = 0; i < 5; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    expectWhatWasSent(*frame);
    lost += frame->dropped_by_device;
  }
  EXPECT_EQ(lost, 3u);
}

TEST(Usb3Vision, DamagedTransfersDoNoHarm) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random{kSeed};
  const auto damage = [&random](std::vector<std::byte>& transfer) {
    if (random() % 4 != 0) return;
    if (random() % 8 == 0) transfer.resize(random() % (transfer.size() + 1));
    // Mostly what stands at the beginning: kinds, numbers, sizes.
    const std::size_t most = std::min<std::size_t>(transfer.size(), random() % 2 == 0 ? 60 : 4000);
    for (int i = 0; i < 3 && most > 0; ++i) transfer[random() % most] = static_cast<std::byte>(random());
  };
  const Plugged plugged;
  for (const char* keys : {"", "chunks = true"}) {
    const auto source = started(keys);
    ASSERT_NE(source, nullptr) << keys;
    plugged.camera().setDamage(damage);
    int good = 0;
    for (int i = 0; i < 40; ++i) {
      const auto frame = source->next({}, false);
      good += frame.ok() ? 1 : 0;
      if (!frame && frame.error().code == Error::Code::Disconnected) {
        source->stop();
        ASSERT_TRUE(source->start().ok());
      }
    }
    EXPECT_GT(good, 0) << keys << ", seed " << kSeed;
    plugged.camera().setDamage(nullptr);
    ASSERT_TRUE(nextFrame(*source).ok()) << "one that was on its way";
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    expectWhatWasSent(*frame);
  }
}

TEST(Usb3Vision, IsResetAtItsPort) {
  const Plugged plugged;
  const int before = plugged.device->introductions();
  const auto reset = usb::reset(usb::list().at(0).port);
  ASSERT_TRUE(reset.ok()) << reset.error().message;
  EXPECT_GT(plugged.device->introductions(), before);
  const auto source = started();
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(nextFrame(*source).ok());
}

TEST(Usb3Vision, ThatAnotherProgramHasIsBusy) {
  const Plugged plugged;
  const auto first = open();
  ASSERT_TRUE(first.ok()) << first.error().message;
  const auto second = open();
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, Error::Code::Busy) << second.error().message;
}

TEST(Usb3Vision, IsCompliant) {
  const Plugged plugged;
  drivers::Driver driver = row();
  int passed = 0;
  for (const drivers::Finding& finding :
       drivers::checkCompliance(drivers::listedCamera(driver, row().list().at(0)), {.frames = 2})) {
    EXPECT_NE(finding.outcome, drivers::Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
    passed += finding.outcome == drivers::Finding::Outcome::Passed ? 1 : 0;
  }
  EXPECT_GE(passed, 9) << "of twelve, of which three do not apply to a camera in free run";
}

TEST(Usb3Vision, OpeningAndClosingLeavesNothingBehind) {
  using test::entriesOf;
  const Plugged plugged;
  ASSERT_NE(started(), nullptr);
  const auto files = entriesOf("/proc/self/fd"), threads = entriesOf("/proc/self/task");
  for (int i = 0; i < 3; ++i) {
    const auto source = started();
    ASSERT_NE(source, nullptr);
    ASSERT_TRUE(nextFrame(*source).ok());
  }
  EXPECT_EQ(entriesOf("/proc/self/fd"), files);
  EXPECT_EQ(entriesOf("/proc/self/task"), threads);
}

// As many as this machine does in six seconds of its own. The driver's and the library's part of ten thousand
// is AravisLosses.TenThousandStartsAndStopsKeepNothing.
TEST(Usb3Vision, StartsAndStopsKeepNothing) {
  const Plugged plugged;
  const auto source = open();
  ASSERT_TRUE(source.ok()) << source.error().message;
  test::expectNothingKept("aravis on USB", **source, 100, 250,
                          6'000);  // 8,000 bytes: malloc's smallest block each
}

// ---- losing it ---------------------------------------------------------------------------------

/// Loses it and finds it: the subscription goes on, the gap is counted, what a client had set is set.
void losesAndFinds(std::string_view what, milliseconds may_take,
                   const std::function<void(std::unique_ptr<Plugged>&)>& lose,
                   const std::function<void(std::unique_ptr<Plugged>&)>& give_back) {
  auto plugged = std::make_unique<Plugged>();
  test::RecoveryRig rig{[] { return open("parameters = ['Gain']"); }};
  ASSERT_TRUE(rig.isSubscribed());
  ASSERT_TRUE(rig.command([](drivers::Source& source) { return source.setParameter("Gain", 7.0); }).ok());
  const auto outcome = rig.loseAndFind(
      what, milliseconds{700}, [&] { lose(plugged); }, [&] { give_back(plugged); });
  ASSERT_TRUE(outcome.has_value()) << "the stream did not go on";
  const auto& [last, first, took] = *outcome;
  EXPECT_LT(took, may_take);
  EXPECT_EQ(first.sequence, last.sequence + 1);
  const double gap_ms = static_cast<double>(first.moment.received.ns - last.moment.received.ns) * 1e-6;
  // An interval of rounding, and one because a frame may have come up to an interval late.
  EXPECT_NEAR(static_cast<double>(first.dropped_by_device + 1), gap_ms / kInterval_ms, 2.0);
  EXPECT_GT(first.moment.exposures[0].start, last.moment.exposures[0].start);
  EXPECT_EQ(plugged->camera().reg(U3vCamera::kGain), 7u) << "what a client had set is set again";
}

TEST(Usb3Vision, PulledAndPluggedInAgainItIsBackWithinASecond) {
  losesAndFinds(
      "pulled, with what the kernel takes to find it", test::kBackWithin,
      [](auto& plugged) { plugged.reset(); },
      [](auto& plugged) {
        const auto plugged_in = Clock::now();
        plugged = std::make_unique<Plugged>();
        const auto boot = std::chrono::duration_cast<milliseconds>(Clock::now() - plugged_in);
        std::printf("the kernel took %lld ms of it\n", static_cast<long long>(boot.count()));
      });
}

TEST(Usb3Vision, ThatHangsItIsBackWithinASecond) {
  losesAndFinds(
      "sends nothing", test::kBackWithin, [](auto& plugged) { plugged->camera().is_hung = true; },
      [](auto& plugged) { plugged->camera().is_hung = false; });
}

TEST(Usb3Vision, ThatAnswersNothingItIsBackSoonAfterItDoes) {
  losesAndFinds(
      "answers nothing", test::kBackWithin, [](auto& plugged) { plugged->camera().is_mute = true; },
      [](auto& plugged) { plugged->camera().is_mute = false; });
}

}  // namespace
}  // namespace toftwin::kernel_test::u3v
