// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "daemon/facades/usb_camera/usb_device.h"

/// USB/IP's own numbers are big-endian, unlike those of USB.
namespace toftwin::daemon::usb_camera {

inline std::uint32_t big16At(std::span<const std::byte> bytes, std::size_t at) {
  return std::to_integer<std::uint32_t>(bytes[at]) << 8U | std::to_integer<std::uint32_t>(bytes[at + 1]);
}
inline std::uint32_t big32At(std::span<const std::byte> bytes, std::size_t at) {
  return big16At(bytes, at) << 16U | big16At(bytes, at + 2);
}

inline void appendBig16(Bytes& to, std::uint32_t value) {
  to.push_back(static_cast<std::byte>(value >> 8U));
  to.push_back(static_cast<std::byte>(value));
}
inline void appendBig32(Bytes& to, std::uint32_t value) {
  appendBig16(to, value >> 16U);
  appendBig16(to, value);
}

}  // namespace toftwin::daemon::usb_camera
