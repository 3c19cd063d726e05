// SPDX-License-Identifier: Apache-2.0
#include "drivers/usb/cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <iterator>
#include <optional>

namespace toftwin::usb {
namespace {

constexpr double kUsb2 = 480.0, kUsb3 = 5000.0;

/// A line of a file below /sys, or nothing.
std::string lineOf(const std::filesystem::path& file) {
  std::string line;
  std::ifstream in{file};
  std::getline(in, line);
  return line;
}

template <class Number>
std::optional<Number> numberOf(const std::string& text, int base) {
  Number number{};
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (read.ec != std::errc{} || text.empty()) return std::nullopt;
  return number;
}

/// Whether an interface of the first configuration says so, by the descriptors that the device gave: they are
/// there as soon as its folder is, while those of its interfaces come later.
bool hasUsb3Vision(const std::filesystem::path& folder) {
  constexpr std::size_t kInterfaceBytes = 9;
  constexpr unsigned char kConfiguration = 2, kInterface = 4;
  std::ifstream in{folder / "descriptors", std::ios::binary};
  const std::vector<unsigned char> all(std::istreambuf_iterator<char>{in}, std::istreambuf_iterator<char>{});
  int configurations = 0;
  std::span<const unsigned char> rest{all};
  while (rest.size() >= 2 && rest[0] >= 2 && rest[0] <= rest.size()) {  // each begins with length and kind
    const auto one = rest.first(rest[0]);
    rest = rest.subspan(one.size());
    configurations += one[1] == kConfiguration ? 1 : 0;
    if (configurations > 1) return false;
    if (one[1] != kInterface || one.size() < kInterfaceBytes) continue;
    if (isUsb3Vision(one[5], one[6], one[7])) return true;
  }
  return false;
}

std::optional<Device> deviceAt(const std::filesystem::path& folder) {
  const auto vendor = numberOf<std::uint16_t>(lineOf(folder / "idVendor"), 16);
  const auto product = numberOf<std::uint16_t>(lineOf(folder / "idProduct"), 16);
  if (!vendor || !product) return std::nullopt;
  Device device;
  device.camera = find(*vendor, *product);
  if (device.camera == nullptr) {
    if (!hasUsb3Vision(folder)) return std::nullopt;
    device.camera = &usb3VisionCamera();
    device.maker = lineOf(folder / "manufacturer");
    device.product = lineOf(folder / "product");
  }
  device.port = folder.filename().string();
  device.serial = lineOf(folder / "serial");
  // "1.5" of a low-speed device would be read as 1, which is slow enough.
  device.mbit_s = numberOf<int>(lineOf(folder / "speed"), 10).value_or(0);
  device.node = fmt::format("/dev/bus/usb/{:03}/{:03}",
                            numberOf<int>(lineOf(folder / "busnum"), 10).value_or(0),
                            numberOf<int>(lineOf(folder / "devnum"), 10).value_or(0));
  return device;
}

}  // namespace

std::span<const KnownCamera> knownCameras() {
  // Vendor and product numbers as in the public USB ID registry (linux-usb.org/usb.ids) and in the
  // vendors' own udev rules.
  static constexpr std::array kCameras{
      KnownCamera{0x045e, 0x02c4, "Microsoft Kinect v2 (for Windows)", "kinect2", kUsb3},
      KnownCamera{0x045e, 0x02d8, "Microsoft Kinect v2 (Xbox One)", "kinect2", kUsb3},
      KnownCamera{0x045e, 0x02ae, "Microsoft Kinect v1 camera", "", kUsb2},
      KnownCamera{0x045e, 0x097c, "Microsoft Azure Kinect depth camera", "", kUsb3},
      KnownCamera{0x1d27, 0x0600, "ASUS Xtion", "openni2", kUsb2},
      KnownCamera{0x1d27, 0x0601, "ASUS Xtion Pro Live", "openni2", kUsb2},
      KnownCamera{0x1d27, 0x0609, "PrimeSense Carmine 1.09", "openni2", kUsb2},
      KnownCamera{0x2bc5, 0x0401, "Orbbec Astra", "openni2", kUsb2},
      KnownCamera{0x8086, 0x0ad3, "Intel RealSense D415", "v4l2", kUsb3},
      KnownCamera{0x8086, 0x0b07, "Intel RealSense D435", "v4l2", kUsb3},
      KnownCamera{0x8086, 0x0b3a, "Intel RealSense D435i", "v4l2", kUsb3},
      KnownCamera{0x8086, 0x0b5c, "Intel RealSense D455", "v4l2", kUsb3},
      KnownCamera{0x8086, 0x0b64, "Intel RealSense L515", "v4l2", kUsb3},
  };
  return kCameras;
}

const KnownCamera* find(std::uint16_t vendor, std::uint16_t product) {
  const auto cameras = knownCameras();
  const auto found = std::ranges::find_if(cameras, [&](const KnownCamera& one) {
    return one.vendor == vendor && one.product == product;
  });
  return found == cameras.end() ? nullptr : &*found;
}

const KnownCamera& usb3VisionCamera() {
  static constexpr KnownCamera kCamera{0, 0, "USB3 Vision camera", "aravis", kUsb3};
  return kCamera;
}

bool isUsb3Vision(unsigned interface_class, unsigned subclass, unsigned protocol) {
  constexpr unsigned kMiscellaneous = 0xEF, kUsb3Vision = 0x05, kControl = 0x00;
  return interface_class == kMiscellaneous && subclass == kUsb3Vision && protocol == kControl;
}

std::vector<Device> list(const std::filesystem::path& root) {
  std::vector<Device> devices;
  std::error_code ignored;
  for (const auto& entry :
       std::filesystem::directory_iterator{root / "sys/bus/usb/devices", ignored}) {
    if (auto device = deviceAt(entry.path())) devices.push_back(*std::move(device));
  }
  std::ranges::sort(devices, {}, &Device::port);
  return devices;
}

std::string nameOf(const Device& device) {
  return device.product.empty() ? std::string{device.camera->name}
                                : fmt::format("{} ({})", device.camera->name, device.product);
}

std::string warningOf(const Device& device) {
  if (device.camera == nullptr || device.mbit_s >= device.camera->least_mbit_s) return {};
  return fmt::format(
      "{} at {} is a USB 3 camera on a link of {:.0f} Mbit/s: it needs {:.0f}. Use a blue or SS "
      "port and a USB 3 cable of at most 3 m, without a hub",
      nameOf(device), device.port, device.mbit_s, device.camera->least_mbit_s);
}

std::string describe(const Device& device) {
  return fmt::format("{} at {}, {:.0f} Mbit/s{}{}, {}", nameOf(device), device.port, device.mbit_s,
                     device.serial.empty() ? "" : ", serial ", device.serial,
                     device.camera->driver.empty() ? std::string{"for which there is no driver yet"}
                                                   : fmt::format("for driver {}", device.camera->driver));
}

}  // namespace toftwin::usb
