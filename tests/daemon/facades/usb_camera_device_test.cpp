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
#include "daemon/facades/usb_camera/live_camera.h"

namespace toftwin::daemon::usb_camera {
namespace {

using test::FakeClock;

constexpr int kWidth = 8, kHeight = 4;

/// A source of depth whose parameters are as described, and what was set of it.
struct Plugged {
  explicit Plugged(std::vector<Parameter> parameters) {
    wire::SourceDescription description;
    description.camera.width = kWidth;
    description.camera.height = kHeight;
    description.planes = {PlaneKind::Depth};
    description.parameters = std::move(parameters);
    const auto layout = layoutOf({}, "cam", description);
    EXPECT_TRUE(layout.ok());
    for (const Parameter& one : description.parameters) values[one.name] = one.value.value_or(0.0);
    camera.emplace(*layout, description, ShortImages::Scale{}, clock,
                   LiveCamera::Hooks{[this](const std::string& name) -> std::optional<double> {
                                       return values.at(name);
                                     },
                                     [this](const std::string& name, double value,
                                            const LiveCamera::Done& done) {
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

}  // namespace
}  // namespace toftwin::daemon::usb_camera
