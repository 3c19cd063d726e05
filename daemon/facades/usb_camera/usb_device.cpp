// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/usb_camera/usb_device.h"

#include <linux/usb/ch9.h>

#include <algorithm>
#include <cerrno>

namespace toftwin::daemon::usb_camera {
namespace {

constexpr unsigned kEnglish = 0x0409;

Bytes stringDescriptor(const UsbDevice& device, int index) {
  Writer body;
  if (index == 0) body.u16(kEnglish);
  constexpr std::size_t kMost = 126;  // a descriptor's length is one byte
  const std::string text = index == 0 ? std::string{} : device.text(index).substr(0, kMost);
  for (const char c : text) body.u16(static_cast<unsigned char>(c));
  const Bytes content = body.done();
  if (content.empty()) return {};
  return Writer{}.u8(static_cast<unsigned>(content.size()) + 2).u8(USB_DT_STRING).bytes(content).done();
}

Answer descriptor(const UsbDevice& device, const Setup& setup) {
  Bytes bytes;
  if (setup.value >> 8U == USB_DT_DEVICE) bytes = device.deviceDescriptor();
  if (setup.value >> 8U == USB_DT_CONFIG) bytes = device.configurationDescriptor();
  if (setup.value >> 8U == USB_DT_STRING) bytes = stringDescriptor(device, setup.value & 0xFF);
  if (bytes.empty()) return stall();
  return {0, bytes};
}

Answer standard(UsbDevice& device, const Setup& setup) {
  switch (setup.request) {
    case USB_REQ_GET_DESCRIPTOR:
      return descriptor(device, setup);
    case USB_REQ_GET_CONFIGURATION:
      return {0, Writer{}.u8(1).done()};
    case USB_REQ_GET_STATUS:
      return {0, Writer{}.u16(0).done()};
    case USB_REQ_SET_FEATURE:
      if ((setup.type & USB_RECIP_MASK) == USB_RECIP_INTERFACE && setup.value == USB_INTRF_FUNC_SUSPEND) {
        device.onFunctionSuspend((setup.index & USB_INTRF_FUNC_SUSPEND_LP) != 0);
      }
      return {};
    case USB_REQ_SET_ADDRESS:
    case USB_REQ_SET_CONFIGURATION:
    case USB_REQ_SET_SEL:
    case USB_REQ_SET_ISOCH_DELAY:
      return {};
    case USB_REQ_SET_INTERFACE:
      device.onInterface(setup.index & 0xFF, setup.value & 0xFF);
      return {};
    case USB_REQ_CLEAR_FEATURE:
      if ((setup.type & USB_RECIP_MASK) == USB_RECIP_ENDPOINT && setup.value == USB_ENDPOINT_HALT) {
        device.onClearHalt(static_cast<std::uint8_t>(setup.index));
      }
      return {};
    default:
      return stall();
  }
}

}  // namespace

Answer stall() { return {.status = -EPIPE}; }

Answer controlOf(UsbDevice& device, const Setup& setup, std::span<const std::byte> out) {
  const bool is_standard = (setup.type & USB_TYPE_MASK) == USB_TYPE_STANDARD;
  Answer answer = is_standard ? standard(device, setup) : device.control(setup, out);
  answer.data.resize(std::min<std::size_t>(answer.data.size(), setup.length));
  return answer;
}

Writer& Writer::u8(unsigned value) {
  bytes_.push_back(static_cast<std::byte>(value));
  return *this;
}
Writer& Writer::u16(unsigned value) { return u8(value & 0xFFU).u8(value >> 8U & 0xFFU); }
Writer& Writer::u32(std::uint32_t value) { return u16(value & 0xFFFFU).u16(value >> 16U); }
Writer& Writer::bytes(std::span<const std::byte> all) {
  bytes_.insert(bytes_.end(), all.begin(), all.end());
  return *this;
}

}  // namespace toftwin::daemon::usb_camera
