// SPDX-License-Identifier: Apache-2.0
// The facade usb_camera's device and its transfers, without sockets: what a host's commands make of a source.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/usb/video.h>

#include <cstring>
#include <map>
#include <string>
#include <utility>

#include "../fakes.h"
#include "daemon/facades/usb_camera/big_endian.h"
#include "daemon/facades/usb_camera/live_camera.h"
#include "daemon/facades/usb_camera/transfers.h"

namespace toftwin::daemon::usb_camera {
namespace {

using test::FakeClock;

constexpr int kWidth = 8, kHeight = 4;

/// A source of depth whose parameters are as described, and what was set of it.
struct Plugged {
  explicit Plugged(std::vector<Parameter> parameters, const Keys& keys = {}) {
    wire::SourceDescription description;
    description.camera.width = kWidth;
    description.camera.height = kHeight;
    description.planes = {PlaneKind::Depth, PlaneKind::Amplitude};
    description.parameters = std::move(parameters);
    const auto layout = layoutOf(keys, "cam", description);
    EXPECT_TRUE(layout.ok());
    for (const Parameter& one : description.parameters) values[one.name] = one.value.value_or(0.0);
    camera.emplace(*layout, description, ShortImages::Scale{}, clock,
                   LiveCamera::Hooks{
                       [this](const std::string& name) -> std::optional<double> { return values.at(name); },
                       [this](const std::string& name, double value, const LiveCamera::Done& done) {
                         values[name] = value;
                         done({});
                       }});
    camera->onAttach();
  }
  /// Proposes that interval for the depth stream, and begins with what came of it.
  void commit(std::uint32_t interval_100ns) {
    const auto control = [&](std::uint8_t request, unsigned selector, std::span<const std::byte> out) {
      const bool is_in = (request & 0x80U) != 0;
      return camera->control({static_cast<std::uint8_t>(is_in ? 0xA1 : 0x21), request,
                              static_cast<std::uint16_t>(selector << 8U), 1, 34},
                             out);
    };
    Bytes probe = control(UVC_GET_CUR, UVC_VS_PROBE_CONTROL, {}).data;
    ASSERT_EQ(probe.size(), 34u);
    std::memcpy(probe.data() + 4, &interval_100ns, sizeof interval_100ns);
    EXPECT_EQ(control(UVC_SET_CUR, UVC_VS_PROBE_CONTROL, probe).status, 0);
    EXPECT_EQ(control(UVC_SET_CUR, UVC_VS_COMMIT_CONTROL, probe).status, 0);
  }
  FakeClock clock;
  std::map<std::string, double> values;
  std::optional<LiveCamera> camera;
};

TEST(UsbCameraDevice, ARateThatAnIntervalRoundsBeyondTheSourcesBoundsIsTheBound) {
  Plugged plugged{{{"frame_rate_hz", 5.0, {1.5, 30.0}}}};
  plugged.commit(333'333);
  EXPECT_EQ(plugged.values["frame_rate_hz"], 30.0) << "not 30.00003";
  plugged.commit(500'000);
  EXPECT_EQ(plugged.values["frame_rate_hz"], 20.0);
  plugged.commit(0xFFFF'FFFF);  // the most are 6,666,667 units, which are 1.4999999 Hz
  EXPECT_EQ(plugged.values["frame_rate_hz"], 1.5);
}

// ---- pictures ----------------------------------------------------------------------------------

Frame depthFrame() {
  Frame frame;
  frame.camera.width = kWidth;
  frame.camera.height = kHeight;
  frame.planes = {{PlaneKind::Depth, ElementType::F32, kWidth, kHeight, 1,
                   Buffer::adopt(std::vector<float>(kWidth * kHeight, 1.5F))}};
  return frame;
}

Transfer depthTransfer(std::uint32_t length) {
  Transfer transfer;
  transfer.endpoint = 0x81;
  transfer.length = length;
  return transfer;
}

/// The times in a payload's header, in microseconds of their clocks.
struct Times {
  std::uint32_t stamp = 0, source_clock = 0;
  bool operator==(const Times&) const = default;
};
Times timesOf(const Bytes& payload) {
  Times times;
  EXPECT_GE(payload.size(), 12u);
  std::memcpy(&times.stamp, payload.data() + 2, 4);
  std::memcpy(&times.source_clock, payload.data() + 6, 4);
  return times;
}

TEST(UsbCameraDevice, StampAndSourceClockAreOfTheSameClock) {
  using namespace std::chrono_literals;
  Plugged plugged{{}};
  const auto timesAfter3ms = [&](const Frame& frame) {
    Transfer ask = depthTransfer(16'384);
    EXPECT_FALSE(plugged.camera->serve(ask, plugged.clock.steady()));
    EXPECT_TRUE(plugged.camera->take(frame, {}).ok());
    plugged.clock.advance(3ms);
    EXPECT_TRUE(plugged.camera->serve(ask, plugged.clock.steady()));
    return timesOf(ask.data);
  };
  Frame frame = depthFrame();
  frame.moment.received = plugged.clock.wall();
  frame.moment.clock = {.host_minus_device_ns = 1'600'000'000'000'000'000, .uncertainty_ns = 1000};
  const auto host_us = static_cast<std::uint32_t>(frame.moment.received.ns / 1000);
  EXPECT_EQ(timesAfter3ms(frame), (Times{host_us, host_us + 3000U})) << "without exposures: the host's";
  frame.moment.exposures.resize(1);
  frame.moment.exposures[0].start = {plugged.clock.wall().ns - frame.moment.clock.host_minus_device_ns};
  const auto device_us = static_cast<std::uint32_t>(frame.moment.exposures[0].start.ns / 1000);
  EXPECT_EQ(timesAfter3ms(frame), (Times{device_us, device_us + 3000U})) << "related";
  frame.moment.clock = {};
  EXPECT_EQ(timesAfter3ms(frame), (Times{device_us, device_us + 3000U})) << "not related";
}

TEST(UsbCameraDevice, AFrameThatLacksBytesIsRefused) {
  Plugged plugged{{}};
  Transfer ask = depthTransfer(16'384);
  EXPECT_FALSE(plugged.camera->serve(ask, plugged.clock.steady()));
  Frame frame = depthFrame();
  frame.planes[0].data = frame.planes[0].data.part(0, frame.planes[0].data.size() - 4);
  const auto taken = plugged.camera->take(frame, {});
  ASSERT_FALSE(taken.ok());
  EXPECT_THAT(taken.error().message, testing::HasSubstr("has no depth"));
  EXPECT_TRUE(plugged.camera->take(depthFrame(), {}).ok());
}

TEST(UsbCameraDevice, AnIsochronousStreamThatHasBegunIsNotDueForTheOtherOne) {
  Keys keys;
  keys.transfers = Endpoint::Isochronous;
  Plugged plugged{{}, keys};
  const SteadyTime now = plugged.clock.steady();
  Transfer ask = depthTransfer(3072);
  ask.packets = {{.length = 3072}};
  EXPECT_FALSE(plugged.camera->serve(ask, now));
  EXPECT_EQ(plugged.camera->due(0x81), now + std::chrono::microseconds{125});
  EXPECT_EQ(plugged.camera->due(0x82), SteadyTime::max());
  EXPECT_EQ(plugged.camera->due(0x8F), SteadyTime::max()) << "there is none";
}

// ---- transfers ---------------------------------------------------------------------------------

/// Has bytes for whoever asks, once it is not `idle`.
class Fountain final : public UsbDevice {
 public:
  [[nodiscard]] Bytes deviceDescriptor() const override { return {}; }
  [[nodiscard]] Bytes configurationDescriptor() const override { return {}; }
  [[nodiscard]] std::string text(int) const override { return {}; }
  Answer control(const Setup&, std::span<const std::byte>) override { return stall(); }
  bool serve(Transfer& transfer, SteadyTime) override {
    if (is_idle) return false;
    served.push_back(transfer.endpoint & 0x7F);
    transfer.data.resize(transfer.length);
    return true;
  }
  [[nodiscard]] SteadyTime due(std::uint8_t endpoint) const override {
    return SteadyTime{} + std::chrono::seconds{endpoint & 0x7F};
  }
  bool is_idle = false;
  std::vector<int> served;
};

void ask(Transfers& transfers, std::uint32_t number, std::uint32_t endpoint, std::uint32_t length) {
  Bytes command;
  for (const std::uint32_t word : {1U, number, 0x10002U, 1U, endpoint, 0U, length, 0U, 0U, 0U, 0U, 0U})
    appendBig32(command, word);
  ASSERT_TRUE(transfers.take(command).ok());
}

TEST(UsbTransfers, EndpointsTakeTurnsHoweverLittleTheHostReads) {
  for (const std::uint32_t length : {64U, 700'000U, 2'000'000U}) {  // all at once, two or one until it reads
    Fountain device;
    Transfers transfers{device};
    for (std::uint32_t i = 0; i < 4; ++i) {
      ask(transfers, 10 + i, 1, length);
      ask(transfers, 20 + i, 2, length);
    }
    ask(transfers, 30, 3, length);
    for (int i = 0; i < 9; ++i) {
      transfers.serve({});
      transfers.output().clear();
    }
    EXPECT_THAT(device.served, testing::ElementsAre(1, 2, 3, 1, 2, 1, 2, 1, 2)) << length;
  }
}

TEST(UsbTransfers, AreDueWhenTheEndpointsAreThatTheHostWaitsFor) {
  Fountain device;
  device.is_idle = true;
  Transfers transfers{device};
  EXPECT_EQ(transfers.due(), SteadyTime::max());
  ask(transfers, 1, 3, 64);
  transfers.serve({});
  EXPECT_EQ(transfers.due(), device.due(3));
  ask(transfers, 2, 2, 2'000'000);
  EXPECT_EQ(transfers.due(), device.due(2));
  device.is_idle = false;
  transfers.serve({});
  ask(transfers, 3, 1, 64);
  ASSERT_TRUE(transfers.isFull());
  EXPECT_EQ(transfers.due(), SteadyTime::max()) << "the host is to read first";
  transfers.output().clear();
  EXPECT_EQ(transfers.due(), device.due(1));
}

}  // namespace
}  // namespace toftwin::daemon::usb_camera
