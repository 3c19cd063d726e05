// SPDX-License-Identifier: Apache-2.0
#include "drivers/usb/cameras.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <sstream>

#include "fake_root.h"

namespace toftwin::usb {
namespace {

TEST(UsbCameras, AreFoundWithPortSpeedSerialAndDriver) {
  const test::FakeRoot root;
  root.plugIn("2-1.4", "045e", "02c4", "5000");
  root.plugIn("1-2", "1d27", "0601", "480");
  root.plugIn("1-3", "046d", "c077", "1.5");  // a mouse
  root.write("sys/bus/usb/devices/1-0:1.0/bInterfaceClass", "09");
  const auto devices = list(root.path());
  ASSERT_EQ(devices.size(), 2u);
  EXPECT_EQ(devices[0].camera->driver, "openni2");
  EXPECT_EQ(devices[1].port, "2-1.4");
  EXPECT_EQ(devices[1].mbit_s, 5000.0);
  EXPECT_EQ(devices[1].node, "/dev/bus/usb/002/005");
  EXPECT_EQ(describe(devices[1]),
            "Microsoft Kinect v2 (for Windows) at 2-1.4, 5000 Mbit/s, serial A02-1.4, for driver "
            "kinect2");
  EXPECT_TRUE(list(root.path() / "nowhere").empty());
}

TEST(UsbCameras, AUsb3CameraOnUsb2IsWarnedOfAndAUsb2CameraIsNot) {
  const test::FakeRoot root;
  root.plugIn("1-1", "045e", "02c4", "480");
  root.plugIn("1-2", "1d27", "0601", "480");
  root.plugIn("2-1", "045e", "02c4", "10000");
  const auto devices = list(root.path());
  ASSERT_EQ(devices.size(), 3u);
  EXPECT_NE(warningOf(devices[0]).find("link of 480 Mbit/s: it needs 5000"), std::string::npos);
  EXPECT_EQ(warningOf(devices[1]), "");
  EXPECT_EQ(warningOf(devices[2]), "");
}

TEST(UsbCameras, Usb3VisionIsKnownByItsInterfaceWhoeverMadeIt) {
  const test::FakeRoot root;
  const std::string device("\x12\x01", 2), configuration("\x09\x02", 2);
  const auto padded = [](std::string begin, std::size_t size) { return begin.resize(size), begin; };
  const auto interface = [](char subclass, char protocol) {
    return std::string{9, 4, 0, 0, 0, '\xEF', subclass, protocol, 0};
  };
  const auto plugIn = [&](const std::string& port, const std::string& interfaces) {
    root.plugIn(port, "1234", "5678", port == "2-1" ? "480" : "5000");
    root.write("sys/bus/usb/devices/" + port + "/descriptors",
               padded(device, 18) + padded(configuration, 9) + interfaces);
  };
  plugIn("2-1", interface(5, 2) + interface(5, 0));  // its stream alone would be none
  root.write("sys/bus/usb/devices/2-1/manufacturer", "Example");
  root.write("sys/bus/usb/devices/2-1/product", "Example ToF 640");
  plugIn("2-2", interface(2, 0));  // the same class, but for pairs of interfaces
  plugIn("2-3", interface(5, 2) + padded(configuration, 9) + interface(5, 0));  // in its second configuration
  plugIn("2-4", std::string(1, '\0') + interface(5, 0));                        // a descriptor of no length
  plugIn("2-5", interface(5, 0).substr(0, 6));                                  // cut short
  const auto devices = list(root.path());
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_EQ(devices[0].maker, "Example");
  EXPECT_EQ(describe(devices[0]),
            "USB3 Vision camera (Example ToF 640) at 2-1, 480 Mbit/s, serial A02-1, for driver aravis");
  EXPECT_NE(warningOf(devices[0]).find("(Example ToF 640) at 2-1 is a USB 3 camera on a link of 480"),
            std::string::npos);
}

TEST(UsbCameras, EachHasItsUdevRule) {
  std::ostringstream rules;
  rules << std::ifstream{std::string{TOFTWIN_SOURCE_DIR} + "/systemd/60-toftwin.rules"}.rdbuf();
  for (const KnownCamera& camera : knownCameras()) {
    const std::string rule = fmt::format(
        "# {}\nATTR{{idVendor}}==\"{:04x}\", ATTR{{idProduct}}==\"{:04x}\", MODE=\"0660\", "
        "GROUP=\"video\", TAG+=\"uaccess\"\n",
        camera.name, camera.vendor, camera.product);
    EXPECT_NE(rules.str().find(rule), std::string::npos) << "systemd/60-toftwin.rules must have\n"
                                                         << rule;
  }
}

}  // namespace
}  // namespace toftwin::usb
