// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "daemon/facades/usb_camera/usb_device.h"

/// What USB/IP says before a device is imported: which there are, and which is wanted.
/// [Linux kernel, Documentation/usb/usbip_protocol.rst]
namespace toftwin::daemon::usb_camera {

inline constexpr const char* kBusId = "1-1";  ///< by which hosts name the one device

struct Operation {
  enum class Kind { List, Import };
  Kind kind = Kind::List;
  std::string bus_id{};
  std::size_t size = 0;  ///< of the request, in bytes
};
/// What these bytes begin with; nothing: more of them are needed. An error is what no host says.
Result<std::optional<Operation>> readOperation(std::span<const std::byte> bytes);

/// No device: there is none now.
Bytes listAnswer(const UsbDevice* device);

enum class ImportStatus : std::uint32_t { Imported = 0, Busy = 2, NoDevice = 4 };
/// The device's facts follow only where it is imported.
Bytes importAnswer(ImportStatus status, const UsbDevice* device);

}  // namespace toftwin::daemon::usb_camera
