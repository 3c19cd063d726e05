// SPDX-License-Identifier: Apache-2.0
#include "u3v_device.h"

#include <linux/usb/ch9.h>

#include <cerrno>
#include <utility>

#include "descriptors.h"

namespace toftwin::kernel_test {
namespace {

using daemon::usb_camera::stall;
using daemon::usb_camera::Writer;

constexpr std::uint8_t kControlOut = 0x01, kControlIn = 0x81, kEventIn = 0x82, kStreamIn = 0x83;
constexpr unsigned kUsb3Vision = 0x05, kGuidText = 4;
constexpr unsigned kVendor = 0x1209, kProduct = 0x0001;  // for tests, as https://pid.codes keeps them

constexpr ClassCode interfaceFor(unsigned protocol) { return {USB_CLASS_MISC, kUsb3Vision, protocol}; }

/// What the control interface says of the camera before anybody asks it: versions, and the numbers of its
/// strings.
Bytes deviceInfo() {
  constexpr unsigned kLength = 20, kKind = 0x24, kInfo = 0x01, kSuperSpeed = 0x08;
  Writer writer;
  writer.u8(kLength).u8(kKind).u8(kInfo).u32(0x0001'0002).u32(0x0001'0000).u8(kGuidText);
  writer.u8(1).u8(2).u8(0).u8(0).u8(0).u8(3).u8(
      0);  // maker, model, family, version, information, serial number, user
  return writer.u8(kSuperSpeed).done();
}

/// That the three interfaces are one function.
Bytes association() {
  constexpr unsigned kLength = 8, kFirst = 0, kCount = 3;
  Writer writer;
  writer.u8(kLength).u8(USB_DT_INTERFACE_ASSOCIATION).u8(kFirst).u8(kCount);
  return writer.u8(USB_CLASS_MISC).u8(kUsb3Vision).u8(0).u8(0).done();
}

}  // namespace

U3vDevice::U3vDevice(std::string serial, UsbSpeed speed) : speed_(speed), camera_(std::move(serial)) {}

Bytes U3vDevice::deviceDescriptor() const {
  ++introductions_;
  return kernel_test::deviceDescriptor(speed_, kVendor, kProduct);
}

Bytes U3vDevice::configurationDescriptor() const {
  Writer body;
  body.bytes(association());
  body.bytes(interfaceDescriptor(0, 0, 2, interfaceFor(0))).bytes(deviceInfo());
  body.bytes(bulkEndpoint(kControlIn, speed_)).bytes(bulkEndpoint(kControlOut, speed_));
  body.bytes(interfaceDescriptor(1, 0, 1, interfaceFor(1))).bytes(bulkEndpoint(kEventIn, speed_));
  body.bytes(interfaceDescriptor(2, 0, 1, interfaceFor(2))).bytes(bulkEndpoint(kStreamIn, speed_));
  return kernel_test::configurationDescriptor(3, body.done());
}

std::string U3vDevice::text(int index) const {
  if (index == 1) return U3vCamera::kMaker;
  if (index == 2) return U3vCamera::kName;
  if (index == 3) return camera_.serial();
  return index == kGuidText ? "120900000001" : "";
}

Answer U3vDevice::control(const Setup&, std::span<const std::byte>) { return stall(); }

/// The host begins anew: what it has not fetched is of before.
void U3vDevice::onClearHalt(std::uint8_t endpoint) {
  if (endpoint == kStreamIn) frame_.clear();
}

SteadyTime U3vDevice::due(std::uint8_t endpoint) const {
  const auto now = std::chrono::steady_clock::now();
  constexpr std::chrono::milliseconds kSoon{5};
  return endpoint == kStreamIn && !frame_.empty() ? now : now + kSoon;
}

bool U3vDevice::serve(Transfer& transfer, SteadyTime now) {
  if (transfer.endpoint == kEventIn) return false;
  if (transfer.endpoint == kStreamIn) return serveStream(transfer);
  if (transfer.endpoint == kControlOut) {
    camera_.command(transfer.data, now);
    return true;
  }
  auto answer = camera_.answer(now);
  if (!answer) return false;
  transfer.data = *std::move(answer);
  if (transfer.data.size() > transfer.length) transfer.data.resize(transfer.length);
  return true;
}

bool U3vDevice::serveStream(Transfer& transfer) {
  if (frame_.empty()) frame_ = camera_.nextFrame();
  if (frame_.empty()) return false;
  transfer.data = std::move(frame_.front());
  frame_.pop_front();
  if (transfer.data.size() > transfer.length) {
    transfer.status = -EOVERFLOW;  // the host asked for less
    transfer.data.resize(transfer.length);
  }
  return true;
}

}  // namespace toftwin::kernel_test
