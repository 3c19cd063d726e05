// SPDX-License-Identifier: Apache-2.0
#include "kinect2_device.h"

#include <linux/usb/ch9.h>

#include <algorithm>
#include <utility>

#include "descriptors.h"

namespace toftwin::kernel_test {
namespace {

using daemon::usb_camera::stall;
using daemon::usb_camera::Writer;

constexpr std::uint8_t kCommands = 0x02, kAnswers = 0x81, kStream = 0x84;
constexpr unsigned kStreamPacket = 1024, kBurst = 11, kMult = 3;
constexpr ClassCode kVendors{USB_CLASS_VENDOR_SPEC, 0xFF, 0};

/// With the companion that USB 3 has.
Bytes streamEndpoint(UsbSpeed speed) {
  const bool is_super = speed == UsbSpeed::Super;
  Writer writer;
  writer.u8(USB_DT_ENDPOINT_SIZE).u8(USB_DT_ENDPOINT).u8(kStream).u8(USB_ENDPOINT_XFER_ISOC);
  writer.u16(is_super ? kStreamPacket : 512).u8(1);
  if (!is_super) return writer.done();
  writer.u8(USB_DT_SS_EP_COMP_SIZE).u8(USB_DT_SS_ENDPOINT_COMP).u8(kBurst - 1).u8(kMult - 1);
  return writer.u16(kBurst * kMult * kStreamPacket).done();
}

}  // namespace

Kinect2Device::Kinect2Device(Options options) : options_(std::move(options)), camera_(options_.camera) {}

Bytes Kinect2Device::deviceDescriptor() const {
  return kernel_test::deviceDescriptor(options_.speed, 0x045E, options_.product);
}

std::string Kinect2Device::text(int index) const {
  return index == 1 ? "Microsoft" : index == 2 ? kName : index == 3 ? options_.camera.serial : "";
}

Bytes Kinect2Device::configurationDescriptor() const {
  Writer body;
  body.bytes(interfaceDescriptor(0, 0, 2, kVendors));
  body.bytes(bulkEndpoint(kAnswers, options_.speed)).bytes(bulkEndpoint(kCommands, options_.speed));
  body.bytes(interfaceDescriptor(1, 0, 0, kVendors));
  body.bytes(interfaceDescriptor(1, 1, 1, kVendors)).bytes(streamEndpoint(options_.speed));
  return kernel_test::configurationDescriptor(2, body.done());
}

Answer Kinect2Device::control(const Setup&, std::span<const std::byte>) { return stall(); }

void Kinect2Device::onInterface(int number, int alternate) {
  if (number != 1) return;
  camera_.alternate(alternate);
  packets_.clear();
  next_frame_ = {};
}

SteadyTime Kinect2Device::due(std::uint8_t) const {
  const auto now = std::chrono::steady_clock::now();
  const auto soon = now + std::chrono::milliseconds{20};
  if (!camera_.isStreaming()) return soon;
  return packets_.empty() ? std::min(soon, std::max(now, next_frame_)) : now;
}

bool Kinect2Device::serve(Transfer& transfer, SteadyTime now) {
  if (transfer.endpoint == kCommands) {
    camera_.command(transfer.data);
    message_.clear();
    return true;
  }
  if (transfer.endpoint == kAnswers) return serveAnswer(transfer);
  if (transfer.endpoint == kStream) return serveStream(transfer, now);
  transfer.status = stall().status;
  return true;
}

/// A message may take several transfers; the last is not full, or a full one ends it as well.
bool Kinect2Device::serveAnswer(Transfer& transfer) {
  if (message_.empty()) {
    auto answer = camera_.answer();
    if (!answer) return false;
    message_ = *std::move(answer);
  }
  const std::size_t size = std::min<std::size_t>(transfer.length, message_.size());
  const auto end = message_.begin() + static_cast<std::ptrdiff_t>(size);
  transfer.data.assign(message_.begin(), end);
  message_.erase(message_.begin(), end);
  return true;
}

/// Between frames the real camera sends empty packets all the time; here transfers wait, to leave the machine
/// time.
bool Kinect2Device::serveStream(Transfer& transfer, SteadyTime now) {
  if (packets_.empty()) {
    if (!camera_.isStreaming() || now < next_frame_) return false;
    next_frame_ = std::max(now, next_frame_ + options_.interval);
    packets_.emplace_back();
    for (auto& packet : camera_.nextFrame()) packets_.push_back(std::move(packet));
  }
  for (Transfer::Packet& packet : transfer.packets) {
    if (packets_.empty()) continue;
    test::EmulatedKinect2::Packet next = std::move(packets_.front());
    packets_.pop_front();
    if (next.is_lost) {
      packet.status = -EILSEQ;
      continue;
    }
    packet.actual = static_cast<std::uint32_t>(std::min<std::size_t>(next.bytes.size(), packet.length));
    transfer.data.insert(transfer.data.end(), next.bytes.begin(), next.bytes.begin() + packet.actual);
  }
  return true;
}

}  // namespace toftwin::kernel_test
