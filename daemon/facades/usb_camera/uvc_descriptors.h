// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/facades/usb_camera/usb_device.h"

/// What a UVC camera tells of itself. [USB Video Class 1.1]
namespace toftwin::daemon::usb_camera {

enum class Endpoint { Bulk, Isochronous };

/// A number that can be set, in the unit of its control.
struct ControlRange {
  std::uint32_t min = 0, max = 0, preset = 0;
  bool operator==(const ControlRange&) const = default;
};

/// Between two pictures, in units of 100 ns.
struct Intervals {
  std::uint32_t min = 333'333, max = 333'333, preset = 333'333;
  bool operator==(const Intervals&) const = default;
};

/// A camera with one interface for each of its images, of 16 bits per pixel.
struct UvcLayout {
  struct Stream {
    std::string fourcc;  ///< "Z16 " or "Y16 "
    std::uint16_t width = 0, height = 0;
    std::array<std::uint8_t, 12> guid_tail{0x00, 0x00, 0x10, 0x00, 0x80, 0x00,
                                           0x00, 0xAA, 0x00, 0x38, 0x9B, 0x71};  ///< that most codes share
    [[nodiscard]] std::uint32_t pictureBytes() const { return std::uint32_t{2} * width * height; }
    bool operator==(const Stream&) const = default;
  };
  UsbSpeed speed = UsbSpeed::High;
  Endpoint endpoint = Endpoint::Bulk;
  std::uint16_t vendor_id = 0x1209, product_id = 0x0001;  ///< pid.codes: for tests
  std::string vendor{}, model{}, serial{};
  std::vector<Stream> streams{};
  Intervals intervals{};
  std::optional<ControlRange> exposure_100us{}, gain{};
  bool operator==(const UvcLayout&) const = default;
};

constexpr std::uint32_t kClockHz = 1'000'000;  ///< of the times in payloads' headers
constexpr double kIntervalUnitsPerSecond = 1e7;  ///< frame intervals are in units of 100 ns
constexpr unsigned kFirstStreaming = 1;        ///< number of the first stream's interface
constexpr unsigned kSensor = 1, kProcessing = 2, kFirstOutput = 3;  ///< entities within the camera

/// With the direction bit.
constexpr std::uint8_t endpointOf(std::size_t stream) { return static_cast<std::uint8_t>(0x81 + stream); }
/// Most bytes of a payload, its header included: one bulk transfer, or one isochronous packet.
std::uint32_t payloadBytesOf(const UvcLayout& layout);

Bytes deviceDescriptorOf(const UvcLayout& layout);
Bytes configurationDescriptorOf(const UvcLayout& layout);

}  // namespace toftwin::daemon::usb_camera
