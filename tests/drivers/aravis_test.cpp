// SPDX-License-Identifier: Apache-2.0
// The driver with the real library: what it makes of an emulated camera's frames and features.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "../kept_log.h"
#include "aravis_testing.h"
#include "drivers/compliance.h"

namespace toftwin::drivers::aravis {
namespace {

using Emulated = toftwin::test::EmulatedGige;
using std::chrono::milliseconds;
using test::openWith;

class AravisDriver : public test::Aravis {
 protected:
  /// Which frame it is, by its first pixel with a value: (1, 0).
  static std::uint64_t countIn(const Frame& frame) {
    const float depth_mm = 1000.0F * frame.find(PlaneKind::Depth)->as<float>()[1];
    const auto code =
        std::lround((static_cast<double>(depth_mm) - Emulated::kOffset_mm) / Emulated::kScale_mm);
    return static_cast<std::uint64_t>(code - Emulated::rangeCode(0, 1, 0));
  }
  static void expectWhatWasSent(const Frame& frame) {
    const std::uint64_t n = countIn(frame);
    const auto range_m = frame.find(PlaneKind::Range)->as<float>();
    const auto depth_m = frame.find(PlaneKind::Depth)->as<float>();
    const auto amplitude = frame.find(PlaneKind::Amplitude)->as<float>();
    const auto flags = frame.find(PlaneKind::Flags)->as<std::uint8_t>();
    std::size_t i = 0;
    for (int y = 0; y < Emulated::kHeight; ++y) {
      for (int x = 0; x < Emulated::kWidth; ++x, ++i) {
        const std::uint16_t code = Emulated::rangeCode(n, x, y);
        const bool is_confident = Emulated::confidence(x, y) != 0;
        ASSERT_EQ(amplitude[i], static_cast<float>(Emulated::intensity(x, y)));
        ASSERT_EQ(flags[i], (code != 0 && is_confident ? 0 : 1) | (is_confident ? 0 : 8));
        if (flags[i] != 0) {
          ASSERT_TRUE(std::isnan(range_m[i]) && std::isnan(depth_m[i]));
          continue;
        }
        const double expected_m = 1e-3 * (Emulated::kScale_mm * code + Emulated::kOffset_mm);
        const double a = (x - Emulated::kU_px) / Emulated::kFocal_px,
                     b = (y - Emulated::kV_px) / Emulated::kFocal_px;
        ASSERT_NEAR(depth_m[i], expected_m, 1e-6);  // a float's rounding at 1.3 m
        ASSERT_NEAR(range_m[i], expected_m * std::sqrt(1.0 + a * a + b * b), 1e-6);
      }
    }
  }
};

// ---- frames ------------------------------------------------------------------------------------

TEST_F(AravisDriver, AFrameIsWhatTheCameraSentInOurUnits) {
  const auto source = started();
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().model, "toftwin Emulated ToF");
  EXPECT_EQ(source->info().serial, "EMU-1");
  EXPECT_EQ(source->info().planes, (std::vector{PlaneKind::Range, PlaneKind::Depth,
                                                PlaneKind::Amplitude, PlaneKind::Flags}));
  EXPECT_NEAR(source->info().frame_interval->in(millisecond), 20.0, 1e-9);
  EXPECT_EQ(source->info().camera.fx, Emulated::kFocal_px);
  EXPECT_EQ(source->info().camera.calibration_id.size(), 32u);
  for (int i = 0; i < 5; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    expectWhatWasSent(*frame);
    EXPECT_EQ(frame->provenance.calibration_id, source->info().camera.calibration_id);
    EXPECT_NEAR(frame->moment.exposures.at(0).duration.in(microsecond), 1000.0, 1e-9);
    EXPECT_EQ(frame->moment.temperatures.at(0).value.in(celsius), 41.5);
  }
}

TEST_F(AravisDriver, ASingleImageWithIdsThatWrapAroundLosesNothing) {
  const auto source = started("components = ['Range']");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().planes,
            (std::vector{PlaneKind::Range, PlaneKind::Depth, PlaneKind::Flags}));
  std::uint64_t last = 0;
  for (int i = 0; i < 12; ++i) {  // ids begin six before 65536, and 0 is none
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    if (i > 0) {
      EXPECT_EQ(frame->dropped_by_device + 1, (countIn(*frame) + 64 - last) % 64) << i;
    }
    last = countIn(*frame);
  }
}

TEST_F(AravisDriver, TheUnitIsTheCamerasOrTheUsers) {
  camera_.setReg(Emulated::kDistanceUnit, 1);
  auto inches = started("components = ['Range']");
  ASSERT_NE(inches, nullptr);
  const auto frame = nextFrame(*inches);
  ASSERT_TRUE(frame.ok());
  const double depth_in =
      static_cast<double>(frame->find(PlaneKind::Depth)->as<float>()[1]) / 0.0254;
  EXPECT_NEAR(depth_in, Emulated::kScale_mm * (4007 + 32) + Emulated::kOffset_mm, 8.01);
  inches.reset();
  camera_.setReg(Emulated::kDistanceUnit, 2);
  expectRefused("", "units of \"Pixel\"");
  EXPECT_TRUE(open("unit_mm = 0.5").ok());
}

TEST_F(AravisDriver, WithoutAnythingOfItsLensDepthAloneIsThere) {
  camera_.setFloatReg(Emulated::kFocal, 0.0);
  auto source = started("components = ['Range']");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().planes, (std::vector{PlaneKind::Depth, PlaneKind::Flags}));
  EXPECT_TRUE(source->info().camera.calibration_id.empty());
  source.reset();
  const auto told = started("components = ['Range']\nlens.field_of_view_deg = 60");
  ASSERT_NE(told, nullptr);
  EXPECT_EQ(told->info().planes.front(), PlaneKind::Range);
}

TEST_F(AravisDriver, ChunkDataSayTheExposureOfEachFrame) {
  const auto source = started("components = ['Range']\nchunks = true");
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(nextFrame(*source).ok());
  camera_.setFloatReg(Emulated::kExposure, 777.0);  // automatically, behind our back
  double exposure_us = 0.0;
  for (int i = 0; i < 10 && std::abs(exposure_us - 777.0) > 1e-9; ++i) {
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    exposure_us = frame->moment.exposures.at(0).duration.in(microsecond);
  }
  EXPECT_NEAR(exposure_us, 777.0, 1e-9);
}

// ---- time --------------------------------------------------------------------------------------

TEST_F(AravisDriver, DeviceTimeGoesOnWhenTheCamerasClockIsSet) {
  const auto source = started();
  ASSERT_NE(source, nullptr);
  auto before = nextFrame(*source);
  ASSERT_TRUE(before.ok());
  for (const std::int64_t jump_ns : {-3'600'000'000'000LL, 7'200'000'000'000LL}) {
    camera_.clock_ns += jump_ns;
    for (int i = 0; i < 10; ++i) {
      auto frame = nextFrame(*source);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      const std::int64_t step_ns =
          frame->moment.exposures.at(0).start.ns - before->moment.exposures.at(0).start.ns;
      EXPECT_GT(step_ns, 0);
      EXPECT_LT(step_ns, 1'000'000'000) << "the jump is not in it";
      before = std::move(frame);
    }
  }
}

TEST_F(AravisDriver, TheCamerasClockIsRelatedToTheHosts) {
  const auto source = started("delay_ms = 1");
  ASSERT_NE(source, nullptr);
  Result<Frame> frame = nextFrame(*source);
  for (int i = 0; i < 20 && frame; ++i) frame = nextFrame(*source);
  ASSERT_TRUE(frame.ok());
  const Moment& moment = frame->moment;
  ASSERT_GE(moment.clock.uncertainty_ns, 0);
  const std::int64_t host_ns =
      moment.exposures.at(0).start.ns + moment.clock.host_minus_device_ns + 1'000'000;
  const std::int64_t now_ns = std::chrono::system_clock::now().time_since_epoch().count();
  EXPECT_NEAR(static_cast<double>(now_ns - host_ns), 0.0, 5e8) << "within the last half second";
}

TEST_F(AravisDriver, PtpIsSwitchedOnAsAsked) {
  EXPECT_EQ(camera_.reg(Emulated::kPtp), 0u);
  EXPECT_TRUE(open("ptp = true").ok());
  EXPECT_EQ(camera_.reg(Emulated::kPtp), 1u);
}

constexpr std::uint32_t kListening = 1, kSlave = 2, kMaster = 3;

TEST_F(AravisDriver, WhatItsClockFollowsIsSaidOnceForEachStatus) {
  const auto log = std::make_shared<toftwin::test::KeptLog>();  // shared with spdlog
  const toftwin::test::LoggingTo kept{log};
  camera_.setReg(Emulated::kPtpStatus, kListening);
  const auto source = started("ptp = true");
  ASSERT_NE(source, nullptr);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(nextFrame(*source).ok());
  EXPECT_EQ(camera_.reg(Emulated::kPtpLatch), 1u) << "the status is that of the last latch";
  EXPECT_EQ(log->count("PtpStatus is Listening; device time is of its own clock"), 1);
  const auto goOnUntil = [&](const std::string& text) {
    for (int i = 0; i < 1000 && log->count(text) == 0; ++i) ASSERT_TRUE(nextFrame(*source).ok());
    EXPECT_EQ(log->count(text), 1) << text;
  };
  camera_.setReg(Emulated::kPtpStatus, kMaster);
  goOnUntil("it is itself the master: PtpStatus is Master");
  camera_.setReg(Emulated::kPtpStatus, kSlave);
  goOnUntil("its clock is the network's: PtpStatus is Slave");
}

// ---- triggers ----------------------------------------------------------------------------------

TEST_F(AravisDriver, ASoftwareTriggerMakesOneFrame) {
  const auto source = started("trigger = 'software'");
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(source->info().can_trigger);
  EXPECT_FALSE(source->info().frame_interval.has_value());
  for (int i = 0; i < 3; ++i) {
    const auto triggered = source->trigger();
    ASSERT_TRUE(triggered.ok()) << triggered.error().message;
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    expectWhatWasSent(*frame);
  }
  const auto none = source->next({}, false);
  ASSERT_FALSE(none.ok()) << "nobody triggered it";
  EXPECT_EQ(none.error().code, Error::Code::Timeout) << none.error().message;
}

TEST_F(AravisDriver, AHardwareTriggerIsTheInputsAndNobodyElses) {
  const auto source =
      started("trigger = 'hardware'\nset = ['TriggerActivation = FallingEdge', 'Gain = 3']");
  ASSERT_NE(source, nullptr);
  EXPECT_FALSE(source->info().can_trigger);
  EXPECT_FALSE(source->trigger().ok());
  EXPECT_EQ(camera_.reg(Emulated::kActivation), 1u);
  camera_.edge();
  EXPECT_TRUE(nextFrame(*source).ok());
  const auto none = source->next({}, false);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, Error::Code::Timeout);
}

TEST_F(AravisDriver, FreeRunUndoesATrigger) {
  ASSERT_TRUE(open("trigger = 'software'").ok());
  auto as_set = started();
  ASSERT_NE(as_set, nullptr);
  EXPECT_TRUE(as_set->info().can_trigger) << "as the camera is set";
  as_set.reset();
  const auto source = started("trigger = 'free_run'\nframe_rate_hz = 25");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(camera_.floatReg(Emulated::kRate), 25.0);
  EXPECT_TRUE(nextFrame(*source).ok());
}

// ---- features ----------------------------------------------------------------------------------

TEST_F(AravisDriver, ParametersAreTheCamerasFeatures) {
  const auto source = started(
      "parameters = ['ExposureTime', 'Gain', 'FlyingPixelFilter', 'Scan3dCoordinateSystem']");
  ASSERT_NE(source, nullptr);
  const auto parameters = source->state().parameters;
  ASSERT_EQ(parameters.size(), 4u);
  EXPECT_EQ(parameters[0].name, "ExposureTime");
  EXPECT_EQ(parameters[0].value, 1000.0);
  EXPECT_EQ(parameters[0].bounds.max, 20000.0);
  EXPECT_EQ(parameters[1].bounds.max, 24.0);
  EXPECT_EQ(parameters[2].bounds.max, 1.0);
  EXPECT_EQ(parameters[3].value, 0.0) << "an enumeration's entry by its number";
  ASSERT_TRUE(source->setParameter("ExposureTime", 512.5).ok());
  ASSERT_TRUE(source->setParameter("Gain", 12).ok());
  ASSERT_TRUE(source->setParameter("FlyingPixelFilter", 1).ok());
  EXPECT_EQ(camera_.floatReg(Emulated::kExposure), 512.5);
  EXPECT_EQ(camera_.reg(Emulated::kGain), 12u);
  EXPECT_EQ(camera_.reg(Emulated::kFilter), 1u);
  EXPECT_EQ(source->state().parameters[0].value, 512.5);
  for (const auto& [name, wrong, says] : {std::tuple{"ExposureTime", 5.0, "from 10 to 20000"},
                                          {"Gain", 1.5, "a whole number from 0 to 24"},
                                          {"FlyingPixelFilter", 2.0, "from 0 to 1"},
                                          {"Gain", std::nan(""), "a whole number"},
                                          {"Width", 1.0, "it has: ExposureTime, Gain"}}) {
    const auto set = source->setParameter(name, wrong);
    ASSERT_FALSE(set.ok()) << name;
    EXPECT_NE(set.error().message.find(says), std::string::npos) << set.error().message;
  }
}

TEST_F(AravisDriver, ChoicesSwitchesAndTextsAreReadAndSetByName) {
  const auto source = started("parameters = ['TriggerActivation', 'FlyingPixelFilter', 'UserText', 'Gain']");
  ASSERT_NE(source, nullptr);
  const auto before = source->state().parameters;
  EXPECT_EQ(before.at(0).text, "RisingEdge");
  EXPECT_EQ(before[0].choices, (std::vector<std::string>{"RisingEdge", "FallingEdge"}));
  EXPECT_EQ(before[1].text, "false");
  EXPECT_EQ(before[1].choices, (std::vector<std::string>{"false", "true"}));
  EXPECT_TRUE(before[2].text && !before[2].value && before[2].choices.empty()) << "a text is no number";
  EXPECT_FALSE(before[3].text) << "a number is no text";
  ASSERT_TRUE(source->setParameterText("TriggerActivation", "FallingEdge").ok());
  ASSERT_TRUE(source->setParameterText("FlyingPixelFilter", "true").ok());
  ASSERT_TRUE(source->setParameterText("UserText", "dock 3").ok());
  ASSERT_TRUE(source->setParameterText("Gain", "7").ok()) << "a number may come as a text";
  EXPECT_EQ(camera_.reg(Emulated::kTriggerActivation), 1u);
  EXPECT_EQ(camera_.reg(Emulated::kFilter), 1u);
  EXPECT_EQ(camera_.reg(Emulated::kUserText), 0x646F636BU) << "dock";
  EXPECT_EQ(camera_.reg(Emulated::kGain), 7u);
  const auto after = source->state().parameters;
  EXPECT_EQ(after[0].text, "FallingEdge");
  EXPECT_EQ(after[0].value, 1.0);
  EXPECT_EQ(after[1].text, "true");
  EXPECT_EQ(after[2].text, "dock 3");
  for (const auto& [name, wrong, says] :
       {std::tuple{"TriggerActivation", "AnyEdge", "one of: RisingEdge, FallingEdge"},
        {"FlyingPixelFilter", "maybe", "a number"},
        {"UserText", "a name of more than 16 bytes", "at most 16 bytes"},
        {"Gain", "loud", "a number"},
        {"PixelFormat", "Mono16", "it has: TriggerActivation"}}) {
    const auto set = source->setParameterText(name, wrong);
    ASSERT_FALSE(set.ok()) << name;
    EXPECT_NE(set.error().message.find(says), std::string::npos) << set.error().message;
  }
  EXPECT_EQ(source->state().parameters[2].text, "dock 3") << "nothing of it was written";
  EXPECT_TRUE(nextFrame(*source).ok());
}

TEST_F(AravisDriver, TheRateThatAClientSetsIsTheIntervalThatItTells) {
  const auto source = started("parameters = ['AcquisitionFrameRate']");
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(source->setParameter("AcquisitionFrameRate", 100.0).ok());
  EXPECT_NEAR(source->info().frame_interval->in(millisecond), 10.0, 1e-9);
  ASSERT_TRUE(nextFrame(*source).ok());
}

TEST_F(AravisDriver, ACameraThatAClientSetsToWaitForTriggersHasNoIntervalUntilItRunsFree) {
  const auto source = started("parameters = ['TriggerMode']");
  ASSERT_NE(source, nullptr);
  ASSERT_TRUE(source->info().frame_interval.has_value());
  ASSERT_TRUE(source->setParameterText("TriggerMode", "On").ok());
  EXPECT_FALSE(source->info().frame_interval.has_value());
  ASSERT_TRUE(source->setParameterText("TriggerMode", "Off").ok());
  EXPECT_TRUE(source->info().frame_interval.has_value());
}

TEST_F(AravisDriver, ByDefaultExposureAndGainAreParameters) {
  const auto source = open();
  ASSERT_TRUE(source.ok());
  EXPECT_EQ((*source)->info().parameters, (std::vector<std::string>{"ExposureTime", "Gain"}));
}

TEST_F(AravisDriver, FeaturesOfEveryTypeAreSetWhenItIsOpened) {
  const auto source = open(
      "set = ['ExposureTime = 250', 'Gain=7', 'FlyingPixelFilter = true', 'UserText = dock 3', "
      "'AcquisitionMode = Continuous']");
  ASSERT_TRUE(source.ok()) << source.error().message;
  EXPECT_EQ(camera_.floatReg(Emulated::kExposure), 250.0);
  EXPECT_EQ(camera_.reg(Emulated::kGain), 7u);
  EXPECT_EQ(camera_.reg(Emulated::kFilter), 1u);
  EXPECT_EQ(camera_.reg(Emulated::kUserText), 0x646F636BU) << "dock";
  EXPECT_EQ(camera_.reg(Emulated::kHeartbeat), 1500u);
}

TEST_F(AravisDriver, WrongKeysSayWhatThereIs) {
  for (const auto& [keys, says] :
       {std::pair{"set = ['Gain']", "write \"ExposureTime = 1000\""},
        {"set = ['Gian = 3']", "no feature \"Gian\""},
        {"set = ['Gain = loud']", "Gain = loud cannot be set: it must be a number"},
        {"set = ['Gain = 99']", "from 0 to 24"},
        {"set = ['TriggerActivation = AnyEdge']", "one of: RisingEdge, FallingEdge"},
        {"components = ['Depth']", "it has: Range, Intensity, Confidence"},
        {"pixel_format = 'RGB8'", "one of: Coord3D_C8"},
        {"pixel_format = 'BayerRG8'", "cannot be read"},
        {"trigger = 'hardware'\ntrigger_source = 'Line9'", "it has: Software, Line1"},
        {"parameters = ['TriggerSoftware']", "is a number, a switch, a choice or a text"},
        {"lens.fx = 1\nlens.field_of_view_deg = 2", "leave one out"},
        {"buffers = 1", "buffers"}}) {
    expectRefused(keys, says);
  }
  // The file is as it must be, and another camera may take it.
  for (const char* refused : {"set = ['Gain = 99']", "set = ['Gain = loud']"}) {
    EXPECT_EQ(open(refused).error().code, Error::Code::Incompatible) << refused;
  }
  for (const auto& [uri, says] :
       {std::pair{"nobody", "aravis:nobody"}, {"127.0.0.77", "aravis:127.0.0.77"}}) {
    const auto opened = openWith(uri);
    ASSERT_FALSE(opened.ok());
    EXPECT_NE(opened.error().message.find(says), std::string::npos) << opened.error().message;
  }
  auto table = settings::Table::parse("uri = 'usb:1'", "aravis.toml");
  EXPECT_FALSE(row().open(*table).ok());
}

TEST_F(AravisDriver, ACameraThatSendsWhatCannotBeReadSaysSo) {
  camera_.setReg(Emulated::kFormat + 4, Emulated::kBayer8);
  expectRefused("", "pixel format BayerRG8 cannot be read");
  camera_.setReg(Emulated::kFormat + 4, Emulated::kMono8);
  camera_.setReg(Emulated::kMultipartAble, 0);
  expectRefused("", "multipart");
  EXPECT_TRUE(open("components = ['Range']").ok());
  camera_.setReg(Emulated::kWidthReg, 0);
  expectRefused("components = ['Range']", "its image is 0 x 32");
}

// Names that no other test's camera has: who finds that one takes it from its test.
TEST(AravisNames, FindTheirCamera) {
  const std::string serial = fmt::format("EMU-{}", ::getpid()), name = fmt::format("dock-{}", ::getpid());
  const Emulated camera{toftwin::test::ownLoopbackAddress(), serial, name};
  for (const std::string& called : {name, serial, "toftwin-Emulated ToF-" + serial}) {
    const auto opened = openWith(called);
    ASSERT_TRUE(opened.ok()) << called << ": " << opened.error().message;
    EXPECT_EQ((*opened)->info().serial, serial);
  }
}

TEST_F(AravisDriver, ACameraThatAnotherProgramControlsIsBusy) {
  camera_.is_other_controller = true;
  const auto opened = open();
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, Error::Code::Busy) << opened.error().message;
}

// ---- compliance --------------------------------------------------------------------------------

void expectCompliant(const Emulated& camera, const std::string& keys) {
  const Driver driver = row();
  const Candidate candidate{.driver = &driver,
                            .keys = fmt::format("uri = 'aravis:{}'\n{}", camera.address(), keys),
                            .absent_keys = "uri = 'aravis:127.0.0.77'",
                            .absent_name = "aravis:127.0.0.77"};
  for (const Finding& finding : checkCompliance(candidate)) {
    EXPECT_NE(finding.outcome, Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
  }
}

TEST_F(AravisDriver, IsCompliantWithSeveralImages) { expectCompliant(camera_, ""); }
TEST_F(AravisDriver, IsCompliantWithOneImage) {
  expectCompliant(camera_,
                  "components = ['Range']\nparameters = ['ExposureTime', 'Gain', "
                  "'FlyingPixelFilter', 'TriggerActivation', 'UserText']");
}
TEST_F(AravisDriver, IsCompliantWithPoints) {
  expectCompliant(camera_, "components = ['Range']\npixel_format = 'Coord3D_ABC32f'");
}
TEST_F(AravisDriver, IsCompliantWithASoftwareTrigger) {
  expectCompliant(camera_, "trigger = 'software'");
}

}  // namespace
}  // namespace toftwin::drivers::aravis
