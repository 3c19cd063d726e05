// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Depth cameras on USB: which are there, what drives them, and what is wrong with how they are
/// connected. Reads /sys, opens no device.
namespace toftwin::usb {

/// A camera by its USB identity.
struct KnownCamera {
  std::uint16_t vendor = 0, product = 0;
  std::string_view name;
  std::string_view driver;      ///< of ours that fits; empty: none yet
  double least_mbit_s = 480.0;  ///< of the link that it needs for its full frame rate
};
std::span<const KnownCamera> knownCameras();
/// Null if nobody knows it.
const KnownCamera* find(std::uint16_t vendor, std::uint16_t product);
/// Any maker's camera that speaks USB3 Vision: it is known by what one of its interfaces is for.
const KnownCamera& usb3VisionCamera();
bool isUsb3Vision(unsigned interface_class, unsigned subclass, unsigned protocol);

struct Device {
  const KnownCamera* camera = nullptr;
  std::string port;     ///< where it is plugged in: "2-1.4" is bus 2, port 1, port 4 of a hub there
  double mbit_s = 0.0;  ///< of the link, as negotiated
  std::string serial;
  std::string maker, product;  ///< as it calls itself, where it is known by an interface alone
  std::filesystem::path node;  ///< "/dev/bus/usb/002/005"
};

/// The known cameras that are plugged in, by port. `root` stands for "/" in the tests.
std::vector<Device> list(const std::filesystem::path& root = "/");

/// "Microsoft Kinect v2", "USB3 Vision camera (Example ToF 640)"
std::string nameOf(const Device& device);
/// What is wrong with the link and what to do, or nothing: a USB 3 camera on USB 2.
std::string warningOf(const Device& device);
/// "Microsoft Kinect v2 at 2-1.4, 5000 Mbit/s, serial 123, for driver kinect2"
std::string describe(const Device& device);

}  // namespace toftwin::usb
