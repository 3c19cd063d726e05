// SPDX-License-Identifier: Apache-2.0
// The driver against an emulated kernel: formats, descriptions, which camera, parameters. That it
// speaks the real kernel's language is for tests/kernel to show.
#include "drivers/v4l2/v4l2.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <chrono>

#include "drivers/compliance.h"
#include "drivers/v4l2/description.h"
#include "drivers/v4l2/formats.h"
#include "drivers/v4l2/pixel_format.h"
#include "v4l2_testing.h"

namespace toftwin::drivers::v4l2 {
namespace {

using test::DescriptionFile;
using test::EmulatedV4l2;
using test::kLens;
using test::kUri;
using test::openWith;
using test::someControls;
using test::started;

// ---- formats -----------------------------------------------------------------------------------

std::vector<std::byte> bytes(std::initializer_list<int> values) {
  std::vector<std::byte> all;
  for (const int value : values) all.push_back(static_cast<std::byte>(value));
  return all;
}

// The bytes are worked out by hand from the kernel's documentation of each format, for codes that
// have a bit of their own in every place: 0x2A5, 0x15A, 0x3C3, 0x03C (10 bits), 0xA95 0x56A (12
// bits).
TEST(V4l2Formats, PackedCodesAreReadAsTheKernelDocumentsThem) {
  struct Case {
    const char* format;
    std::vector<std::byte> bytes;
    std::vector<int> codes;
  };
  const std::vector<Case> cases{
      {"Z16", bytes({0x34, 0x12, 0xFF, 0xFF}), {0x1234, 0xFFFF}},
      {"Y16_BE", bytes({0x12, 0x34, 0xFF, 0x00}), {0x1234, 0xFF00}},
      {"Y12", bytes({0x34, 0xF2, 0xFF, 0x0F}), {0x234, 0xFFF}},
      {"Y10", bytes({0x34, 0xFE, 0xFF, 0x03}), {0x234, 0x3FF}},
      {"Y8", bytes({0, 255, 7}), {0, 255, 7}},
      {"Y12P", bytes({0xA9, 0x56, 0xA5}), {0xA95, 0x56A}},
      {"Y10P", bytes({0xA9, 0x56, 0xF0, 0x0F, 0b00111001}), {0x2A5, 0x15A, 0x3C3, 0x03C}},
      {"Y10B",
       bytes({0b10101001, 0b01010101, 0b10101111, 0b00001100, 0b00111100}),
       {0x2A5, 0x15A, 0x3C3, 0x03C}},
  };
  for (const Case& one : cases) {
    const PixelFormat* format = pixelFormatNamed(one.format);
    ASSERT_NE(format, nullptr) << one.format;
    const auto image = unpack(*format, one.bytes, static_cast<int>(one.codes.size()), 1, 0);
    ASSERT_TRUE(image.has_value()) << one.format;
    for (std::size_t i = 0; i < one.codes.size(); ++i) {
      EXPECT_EQ((*image)[i], one.codes[i]) << one.format << " pixel " << i;
    }
    const std::span<const std::byte> all{one.bytes};
    EXPECT_FALSE(
        unpack(*format, all.first(all.size() - 1), static_cast<int>(one.codes.size()), 1, 0))
        << one.format << " with a byte missing";
  }
}

// Sanitizers see any read past the end: every format, at widths that leave groups incomplete.
TEST(V4l2Formats, NoFormatReadsPastItsLeastSize) {
  for (const PixelFormat& format : allPixelFormats()) {
    for (int width = 1; width <= 13; ++width) {
      for (const std::size_t padding : {std::size_t{0}, std::size_t{3}}) {
        const std::size_t stride = tightStride(format, width) + padding;
        const std::vector<std::byte> least(leastSize(format, width, 3, stride), std::byte{0xFF});
        const auto image = unpack(format, least, width, 3, stride);
        ASSERT_TRUE(image.has_value()) << format.name << " " << width;
        EXPECT_EQ(image->pixels().back(), (1U << static_cast<unsigned>(format.bits)) - 1)
            << format.name;
      }
    }
  }
}

TEST(V4l2, AFrameIsWhatTheCameraSentInOurUnits) {
  EmulatedV4l2 system{{{.row_padding = 6}}};
  const DescriptionFile description{
      fmt::format("name = 'Emulated'\n[depth]\nunit_mm = 0.5\noffset_mm = 100\nsaturated = [1400]\n"
                  "farthest_m = 0.8\n{}",
                  kLens)};
  const auto source = started(system, description.key());
  ASSERT_NE(source, nullptr);
  const auto frame = source->next({}, false);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  ASSERT_EQ(source->info().planes,
            (std::vector<PlaneKind>{PlaneKind::Range, PlaneKind::Depth, PlaneKind::Flags}));
  const auto depth_m = frame->find(PlaneKind::Depth)->as<float>();
  const auto range_m = frame->find(PlaneKind::Range)->as<float>();
  const auto flags = frame->find(PlaneKind::Flags)->as<std::uint8_t>();
  std::size_t i = 0;
  int valid = 0;
  for (std::uint32_t y = 0; y < 8; ++y) {
    for (std::uint32_t x = 0; x < 16; ++x, ++i) {
      const int code = EmulatedV4l2::codeAt(0, x, y);
      const double expected_m = 0.1 + 0.5e-3 * code;
      const unsigned flag = code == 0 ? 1U : code == 1400 ? 3U : expected_m > 0.8 ? 65U : 0U;
      ASSERT_EQ(flags[i], flag) << code;
      if (flag != 0) {
        ASSERT_TRUE(std::isnan(depth_m[i]) && std::isnan(range_m[i]));
        continue;
      }
      ++valid;
      ASSERT_NEAR(depth_m[i], expected_m, 1e-7);
      const double a = (x - 7.5) / 20, b = (y - 3.5) / 20;
      ASSERT_NEAR(range_m[i], expected_m * std::sqrt(1 + a * a + b * b), 1e-6);
    }
  }
  EXPECT_GT(valid, 50);
  EXPECT_EQ(source->info().camera.calibration_id.size(), 32u);
  EXPECT_EQ(frame->provenance.calibration_id, source->info().camera.calibration_id);
}

TEST(V4l2, WithoutALensNoRangeIsMadeUp) {
  EmulatedV4l2 system{{{}}};
  const auto source = started(system);
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().planes, (std::vector<PlaneKind>{PlaneKind::Depth, PlaneKind::Flags}));
  EXPECT_TRUE(source->info().camera.calibration_id.empty());
}

TEST(V4l2, ALensForAnotherSizeIsScaledAroundPixelEdges) {
  const LensKeys keys{.width = 32, .height = 16, .fx = 40, .cx = 15.5, .cy = 7.5};
  const auto lens = lensFor(keys, 16, 8, "v4l2");
  ASSERT_TRUE(lens.ok());
  EXPECT_EQ(lens->camera.fx, 20.0);
  EXPECT_EQ(lens->camera.cx, 7.5) << "the centre stays the centre";
  EXPECT_EQ(lens->camera.cy, 3.5);
  EXPECT_FALSE(lensFor(keys, 16, 9, "v4l2").ok()) << "another shape is another lens";
}

// ---- compliance --------------------------------------------------------------------------------

EmulatedV4l2* g_system = nullptr;  // a Driver's functions have no state of their own

void expectCompliant(EmulatedV4l2& system, const std::string& keys) {
  g_system = &system;
  Driver driver = row();
  driver.list = [] { return listOn(*g_system); };
  driver.open = [](settings::Table& table) { return openOn(*g_system, table); };
  Candidate candidate = listedCamera(driver, driver.list().at(0));
  candidate.keys += "\n" + keys;
  for (const Finding& finding : checkCompliance(candidate)) {
    EXPECT_NE(finding.outcome, Finding::Outcome::Failed)
        << finding.check << ", because " << finding.because << "\n  " << finding.detail;
  }
  g_system = nullptr;
}

TEST(V4l2, IsCompliantWithItsUriAlone) {
  EmulatedV4l2 system{{{.controls = someControls()}}};
  expectCompliant(system, "");
}

TEST(V4l2, IsCompliantWithTwoNodesThroughDmabuf) {
  EmulatedV4l2 system{{{.path = "/dev/video3", .formats = {V4L2_PIX_FMT_YUYV}},
                       {.path = "/dev/video4"},
                       {.path = "/dev/video5", .formats = {V4L2_PIX_FMT_Y16}}}};
  const DescriptionFile description{
      fmt::format("[depth]\nnode = 1\nformat = 'Z16'\n[infrared]\nformat = 'Y16'\n{}", kLens)};
  expectCompliant(system, description.key() + "memory = 'dmabuf'\n");
}

// ---- which camera ------------------------------------------------------------------------------

TEST(V4l2, ListsCamerasWithDepthByTheirPortAndNoWebcams) {
  EmulatedV4l2 system{{{.path = "/dev/video0", .bus_info = "usb-a", .formats = {V4L2_PIX_FMT_YUYV}},
                       {.path = "/dev/video1", .bus_info = "usb-b"},
                       {.path = "/dev/video2", .bus_info = "usb-b"},
                       {.path = "/dev/video3",
                        .bus_info = "usb-c",
                        .caps = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING}}};
  EXPECT_EQ(listOn(system), std::vector<std::string>{"v4l2:usb-b"});
}

TEST(V4l2, SaysForAPersonWhatACameraCanBeSetTo) {
  EmulatedV4l2 system{
      {{.path = "/dev/video0", .bus_info = "usb-a", .formats = {V4L2_PIX_FMT_Z16, V4L2_PIX_FMT_YUYV}},
       {.path = "/dev/video1", .bus_info = "usb-b"},
       {.path = "/dev/video2",
        .bus_info = "usb-a",
        .formats = {V4L2_PIX_FMT_Y16},
        .width = 640,
        .height = 480,
        .interval = std::chrono::microseconds{33'333}}}};
  const std::vector<std::string> expected{"/dev/video0: Z16, 16 x 8, 200 Hz",
                                          "/dev/video0: YUYV (not read by this driver), 16 x 8, 200 Hz",
                                          "/dev/video2: Y16, 640 x 480, 30.0003 Hz"};
  EXPECT_EQ(formatLines(system, "v4l2:usb-a"), expected);
  EXPECT_TRUE(formatLines(system, "v4l2:usb-z").empty());
}

TEST(V4l2, ACameraIsFoundByNodePortNameSerialAndIds) {
  EmulatedV4l2 system{{{.path = "/dev/video7",
                        .card = "Depth Camera",
                        .usb = {{"idVendor", "1d27"}, {"idProduct", "0601"}, {"serial", "A17"}}},
                       {.path = "/dev/video8", .card = "Other", .bus_info = "usb-2"}}};
  for (const char* name :
       {"/dev/video7", "usb-emulated-1", "Depth Camera", "A17", "usb:1d27:0601"}) {
    const auto opened = openWith(system, {}, std::string{"v4l2:"} + name);
    ASSERT_TRUE(opened.ok()) << name << ": " << opened.error().message;
    EXPECT_EQ((*opened)->info().serial, "A17");
    EXPECT_EQ((*opened)->info().model, "Depth Camera");
  }
}

TEST(V4l2, AnAbsentCameraIsNamedWithThoseThatAreThere) {
  EmulatedV4l2 system{{{.card = "The one"}}};
  for (const char* uri : {"v4l2:", "v4l2:/dev/video9", "/dev/video0", "v4l2:nobody"}) {
    const auto opened = openWith(system, {}, uri);
    ASSERT_FALSE(opened.ok()) << uri;
    EXPECT_EQ(opened.error().code, Error::Code::NotFound) << opened.error().message;
    EXPECT_NE(opened.error().message.find(uri), std::string::npos);
    EXPECT_NE(opened.error().message.find("The one"), std::string::npos);
  }
}

TEST(V4l2, TwoCamerasOfOneNameAreToldApart) {
  EmulatedV4l2 system{{{.path = "/dev/video0"}, {.path = "/dev/video1", .bus_info = "usb-2"}}};
  const auto opened = openWith(system, {}, "v4l2:Emulated");
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().message.find("usb-2"), std::string::npos);
  EXPECT_TRUE(openWith(system, {}, "v4l2:usb-2").ok());
}

TEST(V4l2, ErrorsSayWhatToDo) {
  struct Case {
    unsigned long request;
    int error;
    Error::Code code;
    const char* says;
  };
  for (const Case& one :
       {Case{0, EACCES, Error::Code::PermissionDenied, "group \"video\""},
        Case{VIDIOC_S_FMT, EBUSY, Error::Code::Busy, "another program"},
        Case{VIDIOC_S_FMT, ENODEV, Error::Code::Disconnected, "/dev/video0"},
        Case{VIDIOC_S_FMT, EINVAL, Error::Code::Incompatible, "cannot be set to Z16"},
        Case{VIDIOC_STREAMON, ENOSPC, Error::Code::Busy, "bandwidth"},
        Case{VIDIOC_EXPBUF, ENOTTY, Error::Code::Unsupported, "memory = \"mmap\""}}) {
    EmulatedV4l2 system{{{}}};
    system.failWith(one.request, one.error);
    auto opened = openWith(system, "memory = 'dmabuf'");
    const Result<> outcome = opened ? (*opened)->start() : Result<>{opened.error()};
    ASSERT_FALSE(outcome.ok());
    EXPECT_EQ(outcome.error().code, one.code) << outcome.error().message;
    EXPECT_NE(outcome.error().message.find(one.says), std::string::npos) << outcome.error().message;
    if (opened) opened->reset();
    EXPECT_EQ(system.heldByUser(), 0u);
  }
}

TEST(V4l2, WhatTheCameraLacksIsSaidTogetherWithWhatItHas) {
  EmulatedV4l2 system{{{.formats = {V4L2_PIX_FMT_Y16, V4L2_PIX_FMT_GREY}}}};
  const DescriptionFile z16{"[depth]\nformat = 'Z16'\n"},
      z16_there{"[depth]\nnode = 0\nformat = 'Z16'\n"}, y16{"[depth]\nformat = 'Y16'\n"};
  struct Case {
    std::string keys;
    const char* says;
    Error::Code code = Error::Code::Incompatible;  // with the keys: on another port it may have them
  };
  for (const Case& one :
       {Case{"", "description"}, Case{z16.key(), "Y16"}, Case{z16_there.key(), "has no format Z16"},
        Case{y16.key() + "width = 640\nheight = 480", "16 x 8"},
        Case{y16.key() + "frame_rate_hz = 17", "200"},
        Case{y16.key() + "set = ['shine = 1']", "no parameter", Error::Code::NotFound}}) {
    const auto opened = openWith(system, one.keys);
    ASSERT_FALSE(opened.ok()) << one.keys;
    EXPECT_EQ(opened.error().code, one.code) << opened.error().message;
    EXPECT_NE(opened.error().message.find(one.says), std::string::npos) << opened.error().message;
  }
  EXPECT_TRUE(openWith(system, y16.key()).ok());
}

// Whatever camera is there, and if none is.
TEST(V4l2, ADescriptionThatIsMissingOrWrongIsAMistakeOfTheFile) {
  EmulatedV4l2 system{{}};
  const DescriptionFile wrong{"[depth]\nformat = 'Z17'\n"};
  for (const auto& [keys, says] : {std::pair<std::string, const char*>{"camera = 'nobody'", "xtion_2"},
                                   std::pair<std::string, const char*>{wrong.key(), "Z17"}}) {
    const auto opened = openWith(system, keys);
    ASSERT_FALSE(opened.ok()) << keys;
    EXPECT_EQ(opened.error().code, Error::Code::InvalidArgument);
    EXPECT_NE(opened.error().message.find("v4l2.toml:2: camera = "), std::string::npos) << opened.error().message;
    EXPECT_NE(opened.error().message.find(says), std::string::npos) << opened.error().message;
  }
}

TEST(V4l2, EveryMistakeInADescriptionIsToldWithItsPlace) {
  const auto read = parseDescription(
      "match = ['1d27']\n[depth]\nformat = 'Z17'\ninvalid = [0.5]\nunit_m = 1\n[lens]\nfx = 1\n"
      "field_of_view_deg = 60\nwidth = 3\n",
      "mine.toml");
  ASSERT_FALSE(read.ok());
  for (const char* what :
       {"mine.toml:1", "Z17", "invalid = 0.5", "unit_m", "same twice", "only one"}) {
    EXPECT_NE(read.error().message.find(what), std::string::npos) << what << "\n"
                                                                  << read.error().message;
  }
}

TEST(V4l2, EveryDescriptionThatComesAlongIsGood) {
  EXPECT_FALSE(presets().empty());
  for (const Preset& preset : presets()) {
    const auto read = parseDescription(preset.text, std::string{preset.name});
    EXPECT_TRUE(read.ok()) << read.error().message;
  }
}

TEST(V4l2, TheXtion2sSecondNodeIsItsDepth) {
  EmulatedV4l2 system{
      {{.path = "/dev/video0", .formats = {V4L2_PIX_FMT_YUYV}, .width = 640, .height = 480},
       {.path = "/dev/video1", .width = 640, .height = 480}}};
  const auto source = started(system, "camera = 'xtion_2'");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().model, "ASUS Xtion 2");
  EXPECT_TRUE(source->next({}, false).ok());
  EXPECT_EQ(system.given(0), 0u);
  EXPECT_GT(system.given(1), 0u);
}

// ---- parameters --------------------------------------------------------------------------------

TEST(V4l2, ControlsAreParametersWithTheirUnits) {
  EmulatedV4l2 system{{{.controls = someControls()}}};
  const auto opened = openWith(system, "set = ['gain = 8', 'exposure_us=3000']");
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  Source& source = **opened;
  EXPECT_EQ(source.info().parameters,
            (std::vector<std::string>{"gain", "auto_exposure", "exposure_us", "focus_absolute"}));
  const auto state = source.state().parameters;
  EXPECT_EQ(state[0].value, 8.0);
  EXPECT_EQ(state[2].value, 3000.0);
  EXPECT_EQ(state[2].bounds.max, 5000.0);
  EXPECT_EQ(state[3].value, std::nullopt) << "the camera sets it by itself";
  EXPECT_FALSE(source.setParameter("gain", 5).ok()) << "not a step";
  EXPECT_FALSE(source.setParameter("gain", 12).ok()) << "out of bounds";
  EXPECT_FALSE(source.setParameter("auto_exposure", 2).ok()) << "no choice of the menu";
  EXPECT_TRUE(source.setParameter("auto_exposure", 3).ok());
  EXPECT_FALSE(source.setParameter("exposure_us", 150).ok()) << "half a step of 100 us";
  EXPECT_EQ(source.setParameter("focus_absolute", 5).error().code, Error::Code::Unsupported);
  ASSERT_TRUE(source.start().ok());
  const auto frame = source.next({}, false);
  ASSERT_TRUE(frame.ok());
  EXPECT_EQ(frame->moment.exposures[0].duration, 3000_us);
}

}  // namespace
}  // namespace toftwin::drivers::v4l2
