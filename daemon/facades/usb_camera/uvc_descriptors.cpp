// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/usb_camera/uvc_descriptors.h"

#include <linux/usb/ch9.h>
#include <linux/usb/video.h>

#include <algorithm>
#include <limits>

namespace toftwin::daemon::usb_camera {
namespace {

constexpr unsigned kClassInterface = USB_DT_CS_INTERFACE, kVersion = 0x0110;
constexpr unsigned kHighBulkPacket = 512, kIsochronousPacket = 1024;
constexpr unsigned kHighPackets = 3, kSuperPackets = 12;  // in a microframe: 24 and 98 MB/s
constexpr std::uint32_t kBulkPayload = 16384;  // a transfer of uvcvideo has 32 packets of at least 512 bytes

bool isSuper(const UvcLayout& layout) { return layout.speed == UsbSpeed::Super; }
unsigned isochronousPackets(const UvcLayout& layout) {
  return isSuper(layout) ? kSuperPackets : kHighPackets;
}

Bytes guidOf(const UvcLayout::Stream& stream) {
  Writer writer;
  for (std::size_t i = 0; i < 4; ++i) writer.u8(static_cast<unsigned char>(stream.fourcc[i]));
  for (const std::uint8_t byte : stream.guid_tail) writer.u8(byte);
  return writer.done();
}

Bytes interface(unsigned number, unsigned alternate, unsigned endpoints, unsigned subclass) {
  Writer writer;
  writer.u8(9).u8(USB_DT_INTERFACE).u8(number).u8(alternate).u8(endpoints);
  return writer.u8(USB_CLASS_VIDEO).u8(subclass).u8(0).u8(0).done();
}

/// With its companion, which says the rest to SuperSpeed hosts.
Bytes endpoint(const UvcLayout& layout, std::size_t stream) {
  const bool is_bulk = layout.endpoint == Endpoint::Bulk, is_super = isSuper(layout);
  const unsigned kind = is_bulk ? USB_ENDPOINT_XFER_BULK : USB_ENDPOINT_XFER_ISOC | USB_ENDPOINT_SYNC_ASYNC;
  const unsigned packets = isochronousPackets(layout);
  // High speed tells in bits 11 and 12 how many packets more than one a microframe has. [USB 2.0, 9.6.6]
  const unsigned size = is_bulk    ? (is_super ? 1024U : kHighBulkPacket)
                        : is_super ? kIsochronousPacket
                                   : kIsochronousPacket | (packets - 1) << 11U;
  Writer writer;
  writer.u8(7).u8(USB_DT_ENDPOINT).u8(endpointOf(stream)).u8(kind).u16(size).u8(1);
  if (is_super) {
    writer.u8(6).u8(USB_DT_SS_ENDPOINT_COMP).u8(is_bulk ? 0 : packets - 1).u8(0);
    writer.u16(is_bulk ? 0 : packets * kIsochronousPacket);
  }
  return writer.done();
}

/// The control interface: sensor → processing → outputs.
Bytes controlInterface(const UvcLayout& layout) {
  const auto streams = static_cast<unsigned>(layout.streams.size());
  const unsigned exposure_bit = layout.exposure_100us ? 1U << 3U : 0U, gain_bit = layout.gain ? 1U << 9U : 0U;
  Writer units;
  units.u8(18).u8(kClassInterface).u8(UVC_VC_INPUT_TERMINAL).u8(kSensor).u16(0x0201).u8(0).u8(0);
  units.u16(0).u16(0).u16(0).u8(3).u8(exposure_bit).u8(0).u8(0);
  units.u8(12).u8(kClassInterface).u8(UVC_VC_PROCESSING_UNIT).u8(kProcessing).u8(kSensor);
  units.u16(0).u8(2).u16(gain_bit).u8(0).u8(0);
  for (unsigned i = 0; i < streams; ++i) {
    units.u8(9).u8(kClassInterface).u8(UVC_VC_OUTPUT_TERMINAL).u8(kFirstOutput + i).u16(0x0101).u8(0);
    units.u8(kProcessing).u8(0);
  }
  const Bytes all = units.done();
  Writer header;
  const unsigned size = 12 + streams;
  header.u8(size).u8(kClassInterface).u8(UVC_VC_HEADER).u16(kVersion);
  header.u16(size + static_cast<unsigned>(all.size())).u32(kClockHz).u8(streams);
  for (unsigned i = 0; i < streams; ++i) header.u8(kFirstStreaming + i);
  return Writer{}.bytes(interface(0, 0, 0, UVC_SC_VIDEOCONTROL)).bytes(header.done()).bytes(all).done();
}

std::uint32_t bitRateOf(const UvcLayout::Stream& stream, std::uint32_t interval_100ns) {
  const double rate = 8.0 * stream.pictureBytes() * kIntervalUnitsPerSecond / std::max(interval_100ns, 1U);
  return static_cast<std::uint32_t>(
      std::min(rate, static_cast<double>(std::numeric_limits<std::uint32_t>::max())));
}

/// What a streaming interface offers: one format in one size.
Bytes streamFormats(const UvcLayout& layout, std::size_t number) {
  const UvcLayout::Stream& stream = layout.streams[number];
  const Intervals& intervals = layout.intervals;
  const bool is_fixed = intervals.min == intervals.max;
  Writer format;
  format.u8(27).u8(kClassInterface).u8(UVC_VS_FORMAT_UNCOMPRESSED).u8(1).u8(1);
  format.bytes(guidOf(stream)).u8(16).u8(1).u8(0).u8(0).u8(0).u8(0);
  format.u8(is_fixed ? 30 : 38).u8(kClassInterface).u8(UVC_VS_FRAME_UNCOMPRESSED).u8(1).u8(0);
  format.u16(stream.width).u16(stream.height);
  format.u32(bitRateOf(stream, intervals.max)).u32(bitRateOf(stream, intervals.min));
  format.u32(stream.pictureBytes()).u32(intervals.preset).u8(is_fixed ? 1 : 0);
  format.u32(intervals.min);
  if (!is_fixed) format.u32(intervals.max).u32(1);
  const Bytes all = format.done();
  Writer header;
  header.u8(14).u8(kClassInterface).u8(UVC_VS_INPUT_HEADER).u8(1);
  header.u16(14 + static_cast<unsigned>(all.size())).u8(endpointOf(number)).u8(0);
  header.u8(kFirstOutput + static_cast<unsigned>(number)).u8(0).u8(0).u8(0).u8(1).u8(0);
  return header.bytes(all).done();
}

}  // namespace

std::uint32_t payloadBytesOf(const UvcLayout& layout) {
  return layout.endpoint == Endpoint::Bulk ? kBulkPayload : isochronousPackets(layout) * kIsochronousPacket;
}

Bytes deviceDescriptorOf(const UvcLayout& layout) {
  const bool is_super = isSuper(layout);
  Writer writer;
  writer.u8(18).u8(USB_DT_DEVICE).u16(is_super ? 0x0300 : 0x0200).u8(USB_CLASS_MISC).u8(2).u8(1);
  writer.u8(is_super ? 9 : 64);  // packets of endpoint 0, which SuperSpeed tells as a power of two
  return writer.u16(layout.vendor_id).u16(layout.product_id).u16(0x0100).u8(1).u8(2).u8(3).u8(1).done();
}

Bytes configurationDescriptorOf(const UvcLayout& layout) {
  const auto streams = static_cast<unsigned>(layout.streams.size());
  Writer body;
  body.u8(8).u8(USB_DT_INTERFACE_ASSOCIATION).u8(0).u8(1 + streams);
  body.u8(USB_CLASS_VIDEO).u8(UVC_SC_VIDEO_INTERFACE_COLLECTION).u8(0).u8(0);
  body.bytes(controlInterface(layout));
  for (std::size_t i = 0; i < layout.streams.size(); ++i) {
    const unsigned number = kFirstStreaming + static_cast<unsigned>(i);
    const bool is_bulk = layout.endpoint == Endpoint::Bulk;
    body.bytes(interface(number, 0, is_bulk ? 1 : 0, UVC_SC_VIDEOSTREAMING));
    body.bytes(streamFormats(layout, i));
    if (!is_bulk) body.bytes(interface(number, 1, 1, UVC_SC_VIDEOSTREAMING));
    body.bytes(endpoint(layout, i));
  }
  const Bytes all = body.done();
  Writer writer;
  writer.u8(9).u8(USB_DT_CONFIG).u16(9 + static_cast<unsigned>(all.size())).u8(1 + streams);
  return writer.u8(1).u8(0).u8(0x80).u8(50).bytes(all).done();
}

}  // namespace toftwin::daemon::usb_camera
