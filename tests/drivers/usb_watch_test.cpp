// SPDX-License-Identifier: Apache-2.0
// The real libusb over devices that umockdev makes up; run below umockdev-wrapper.
#include "drivers/usb/watch.h"

#include <gtest/gtest.h>
#include <umockdev.h>

#include <memory>
#include <vector>

namespace toftwin::usb {
namespace {

struct Unref {
  void operator()(UMockdevTestbed* testbed) const { g_object_unref(testbed); }
};

class WatchTest : public testing::Test {
 protected:
  void SetUp() override {
    testbed_.reset(umockdev_testbed_new());
    ASSERT_TRUE(umockdev_in_mock_environment()) << "run it as: umockdev-wrapper usb_watch_test";
    plugIn("usb1", 1, 0x1d, 0x6b, 0x02, 0x00);
  }
  /// A device with one configuration, as the kernel shows it; without interfaces, or with that one.
  void plugIn(const char* name, int number, int vendor_high, int vendor_low, int product_low,
              int product_high, const char* parent = nullptr,
              const std::vector<unsigned char>& interface = {}) {
    // The device descriptor (18 bytes) and that of the configuration (9), both little-endian.
    std::vector<unsigned char> bytes = {18,
                                        1,
                                        0,
                                        2,
                                        0,
                                        0,
                                        0,
                                        64,
                                        static_cast<unsigned char>(vendor_low),
                                        static_cast<unsigned char>(vendor_high),
                                        static_cast<unsigned char>(product_low),
                                        static_cast<unsigned char>(product_high),
                                        0,
                                        1,
                                        0,
                                        0,
                                        0,
                                        1,
                                        9,
                                        2,
                                        static_cast<unsigned char>(9 + interface.size()),
                                        0,
                                        static_cast<unsigned char>(interface.empty() ? 0 : 1),
                                        1,
                                        0,
                                        0x80,
                                        50};
    bytes.insert(bytes.end(), interface.begin(), interface.end());
    const std::string busnum = "1", devnum = std::to_string(number);
    const std::string devname = "bus/usb/001/00" + devnum;
    const char* attributes[] = {"busnum", busnum.c_str(),        "devnum", devnum.c_str(), "speed",
                                "480",    "bConfigurationValue", "1",      nullptr};
    const std::string minor = std::to_string(number - 1);
    const char* properties[] = {"DEVTYPE",      "usb_device",  "BUSNUM",        "001",   "DEVNUM",
                                devnum.c_str(), "DEVNAME",     devname.c_str(), "MAJOR", "189",
                                "MINOR",        minor.c_str(), nullptr};
    gchar* path = umockdev_testbed_add_devicev(testbed_.get(), "usb", name, parent,
                                               const_cast<gchar**>(attributes),
                                               const_cast<gchar**>(properties));
    ASSERT_NE(path, nullptr);
    umockdev_testbed_set_attribute_binary(testbed_.get(), path, "descriptors", bytes.data(),
                                          static_cast<gint>(bytes.size()));
    paths_.emplace_back(path);
    g_free(path);
  }
  void unplug(const std::string& path) {
    umockdev_testbed_uevent(testbed_.get(), path.c_str(), "remove");
    umockdev_testbed_remove_device(testbed_.get(), path.c_str());
  }
  /// Waits until so many events have come; ten seconds at most.
  void waitFor(Watch& watch, std::size_t events) {
    for (int i = 0; i < 100 && seen_.size() < events; ++i) {
      ASSERT_TRUE(watch.wait(std::chrono::milliseconds{100}).ok());
    }
  }

  std::unique_ptr<UMockdevTestbed, Unref> testbed_;
  std::vector<std::string> paths_;
  std::vector<Watch::Event> seen_;
};

TEST_F(WatchTest, TellsOfKnownCamerasThatAreThereComeAndGo) {
  plugIn("1-2", 3, 0x1d, 0x27, 0x01, 0x06, paths_[0].c_str());  // an Xtion Pro Live
  auto watch = Watch::begin([this](const Watch::Event& event) { seen_.push_back(event); });
  ASSERT_TRUE(watch.ok()) << watch.error().message;
  waitFor(**watch, 1);
  ASSERT_EQ(seen_.size(), 1u) << "of two devices that are there, one is a camera";
  EXPECT_TRUE(seen_[0].has_arrived);
  EXPECT_EQ(seen_[0].camera->name, "ASUS Xtion Pro Live");
  plugIn("1-3", 4, 0x04, 0x5e, 0xae, 0x02, paths_[0].c_str());  // a Kinect v1
  umockdev_testbed_uevent(testbed_.get(), paths_.back().c_str(), "add");
  waitFor(**watch, 2);
  ASSERT_EQ(seen_.size(), 2u);
  EXPECT_EQ(seen_[1].camera->name, "Microsoft Kinect v1 camera");
  unplug(paths_[1]);
  waitFor(**watch, 3);
  ASSERT_EQ(seen_.size(), 3u);
  EXPECT_FALSE(seen_[2].has_arrived);
  EXPECT_EQ(seen_[2].camera->name, "ASUS Xtion Pro Live");
}

TEST_F(WatchTest, TellsOfUsb3VisionCamerasWhoeverMadeThem) {
  const std::vector<unsigned char> control{9, 4, 0, 0, 0, 0xEF, 0x05, 0x00, 0},
      other{9, 4, 0, 0, 0, 0xEF, 0x02, 0x00, 0};
  plugIn("1-2", 3, 0x12, 0x34, 0x78, 0x56, paths_[0].c_str(), other);
  plugIn("1-3", 4, 0x12, 0x34, 0x79, 0x56, paths_[0].c_str(), control);
  auto watch = Watch::begin([this](const Watch::Event& event) { seen_.push_back(event); });
  ASSERT_TRUE(watch.ok()) << watch.error().message;
  waitFor(**watch, 1);
  ASSERT_EQ(seen_.size(), 1u);
  EXPECT_EQ(seen_[0].port, "1-3");
  EXPECT_EQ(seen_[0].camera->driver, "aravis");
  unplug(paths_[2]);
  waitFor(**watch, 2);
  ASSERT_EQ(seen_.size(), 2u);
  EXPECT_FALSE(seen_[1].has_arrived);
}

TEST_F(WatchTest, WhatIsNotThereIsNotReset) {
  const auto done = reset("7-7");
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().code, Error::Code::NotFound);
}

}  // namespace
}  // namespace toftwin::usb
