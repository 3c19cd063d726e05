// SPDX-License-Identifier: Apache-2.0
#include "uvc_camera.h"

#include <linux/usb/ch9.h>
#include <linux/usb/video.h>

#include <algorithm>
#include <array>

namespace toftwin::kernel_test {
namespace {

using Clock = std::chrono::steady_clock;

// Ids of the entities within the camera; its outputs follow, one for each
// stream.
constexpr unsigned kSensor = 1, kProcessing = 2, kFirstOutput = 3;
constexpr unsigned kClassInterface = USB_DT_CS_INTERFACE;
constexpr std::uint32_t kPictureBytes = UvcCamera::kWidth * UvcCamera::kHeight * 2;
constexpr std::uint32_t kPayload = 16384;  // of a bulk transfer, header included
constexpr std::uint32_t kHeaderBytes = 2;
constexpr unsigned kBulkPacket = 512, kSuperBulkPacket = 1024, kIsochronousPacket = 1024;
constexpr std::chrono::microseconds kMicroframe{125};
constexpr unsigned kProbeBytes = 26;
constexpr std::uint32_t kIntervalUnits = 10;  // of 100 ns in a microsecond

unsigned endpointOf(int stream) { return 0x81U + static_cast<unsigned>(stream); }

/// "Z16 " and the tail that all four-letter codes share.
Bytes guid(const char* four_letters) {
  Writer writer;
  for (int i = 0; i < 4; ++i) writer.u8(static_cast<unsigned char>(four_letters[i]));
  return writer.u16(0x0000)
      .u16(0x0010)
      .u8(0x80)
      .u8(0x00)
      .u8(0x00)
      .u8(0xAA)
      .u8(0x00)
      .u8(0x38)
      .u8(0x9B)
      .u8(0x71)
      .done();
}

Bytes interface(unsigned number, unsigned alternate, unsigned endpoints, unsigned subclass) {
  return Writer{}
      .u8(9)
      .u8(USB_DT_INTERFACE)
      .u8(number)
      .u8(alternate)
      .u8(endpoints)
      .u8(USB_CLASS_VIDEO)
      .u8(subclass)
      .u8(0)
      .u8(0)
      .done();
}

/// With its companion, which says the same once more to SuperSpeed hosts.
Bytes endpoint(int stream, unsigned kind, unsigned packet, UsbSpeed speed) {
  Writer writer;
  writer.u8(7).u8(USB_DT_ENDPOINT).u8(endpointOf(stream)).u8(kind).u16(packet).u8(1);
  if (speed == UsbSpeed::Super) {
    const bool is_periodic = (kind & USB_ENDPOINT_XFERTYPE_MASK) == USB_ENDPOINT_XFER_ISOC;
    writer.u8(6).u8(USB_DT_SS_ENDPOINT_COMP).u8(0).u8(0).u16(is_periodic ? packet : 0);
  }
  return writer.done();
}

/// The control interface: sensor → processing → outputs.
Bytes controlInterface(unsigned streams) {
  Writer units;
  constexpr unsigned kExposureBit = 1U << 3U, kGainBit = 1U << 9U;
  units.u8(18).u8(kClassInterface).u8(UVC_VC_INPUT_TERMINAL).u8(kSensor).u16(0x0201).u8(0).u8(0);
  units.u16(0).u16(0).u16(0).u8(3).u8(kExposureBit).u8(0).u8(0);
  units.u8(11)
      .u8(kClassInterface)
      .u8(UVC_VC_PROCESSING_UNIT)
      .u8(kProcessing)
      .u8(kSensor)
      .u16(0)
      .u8(2);
  units.u16(kGainBit).u8(0);
  for (unsigned i = 0; i < streams; ++i) {
    units.u8(9)
        .u8(kClassInterface)
        .u8(UVC_VC_OUTPUT_TERMINAL)
        .u8(kFirstOutput + i)
        .u16(0x0101)
        .u8(0);
    units.u8(kProcessing).u8(0);
  }
  const Bytes all = units.done();
  Writer header;
  const unsigned size = 12 + streams;
  header.u8(size).u8(kClassInterface).u8(UVC_VC_HEADER).u16(0x0100);
  header.u16(size + static_cast<unsigned>(all.size())).u32(48'000'000).u8(streams);
  for (unsigned i = 0; i < streams; ++i) header.u8(1 + i);
  return Writer{}
      .bytes(interface(0, 0, 0, UVC_SC_VIDEOCONTROL))
      .bytes(header.done())
      .bytes(all)
      .done();
}

/// What a streaming interface offers: one format in one size.
Bytes streamFormats(int stream, std::uint32_t interval_100ns) {
  Writer format;
  format.u8(27).u8(kClassInterface).u8(UVC_VS_FORMAT_UNCOMPRESSED).u8(1).u8(1);
  format.bytes(guid(stream == 0 ? "Z16 " : "Y16 ")).u8(16).u8(1).u8(0).u8(0).u8(0).u8(0);
  format.u8(30).u8(kClassInterface).u8(UVC_VS_FRAME_UNCOMPRESSED).u8(1).u8(0);
  format.u16(UvcCamera::kWidth)
      .u16(UvcCamera::kHeight)
      .u32(kPictureBytes * 8 * 30)
      .u32(kPictureBytes * 8 * 30);
  format.u32(kPictureBytes).u32(interval_100ns).u8(1).u32(interval_100ns);
  const Bytes all = format.done();
  Writer header;
  header.u8(14).u8(kClassInterface).u8(UVC_VS_INPUT_HEADER).u8(1);
  header.u16(14 + static_cast<unsigned>(all.size())).u8(endpointOf(stream)).u8(0);
  header.u8(kFirstOutput + static_cast<unsigned>(stream)).u8(0).u8(0).u8(0).u8(1).u8(0);
  return header.bytes(all).done();
}

/// The answer to GET_… of a control, where `value` tells what each would say.
template <class Value>
Answer get(unsigned request, std::size_t size, Value value) {
  if (request == UVC_GET_LEN) return {0, Writer{}.u16(static_cast<unsigned>(size)).done()};
  if (request == UVC_GET_INFO)
    return {0, Writer{}.u8(UVC_CONTROL_CAP_GET | UVC_CONTROL_CAP_SET).done()};
  const std::uint32_t number = value(request);
  return {0, size == 2 ? Writer{}.u16(number).done() : Writer{}.u32(number).done()};
}

std::uint32_t numberIn(std::span<const std::byte> bytes) {
  std::uint32_t number = 0;
  for (std::size_t i = bytes.size(); i-- > 0;)
    number = number << 8U | std::to_integer<std::uint32_t>(bytes[i]);
  return number;
}

}  // namespace

UvcCamera::UvcCamera(Options options) : options_(options), streams_(options.has_infrared ? 2 : 1) {}

std::uint16_t UvcCamera::codeAt(std::uint32_t frame, int stream, std::uint32_t x, std::uint32_t y) {
  if (x == 0 && y == 0) return static_cast<std::uint16_t>(frame % 60'000 + 1);
  if (stream == 1) return static_cast<std::uint16_t>(x * 256 + y);
  return static_cast<std::uint16_t>((x + y) % 7 == 0 ? 0 : 1000 + (x + 3 * y + frame) % 500);
}

// ---- descriptors
// -------------------------------------------------------------------------------

Bytes UvcCamera::deviceDescriptor() const {
  // 1209:0001 is for tests (pid.codes). SuperSpeed tells the packets of
  // endpoint 0 as a power of two.
  const bool is_super = options_.speed == UsbSpeed::Super;
  return Writer{}
      .u8(18)
      .u8(USB_DT_DEVICE)
      .u16(is_super ? 0x0300 : 0x0200)
      .u8(USB_CLASS_MISC)
      .u8(2)
      .u8(1)
      .u8(is_super ? 9 : 64)
      .u16(0x1209)
      .u16(0x0001)
      .u16(0x0100)
      .u8(1)
      .u8(2)
      .u8(3)
      .u8(1)
      .done();
}

std::string UvcCamera::text(int index) const {
  return index == 1 ? "toftwin" : index == 2 ? kName : index == 3 ? kSerial : "";
}

Bytes UvcCamera::configurationDescriptor() const {
  const auto streams = static_cast<unsigned>(streams_.size());
  const bool is_super = options_.speed == UsbSpeed::Super;
  Writer body;
  body.u8(8)
      .u8(USB_DT_INTERFACE_ASSOCIATION)
      .u8(0)
      .u8(1 + streams)
      .u8(USB_CLASS_VIDEO)
      .u8(UVC_SC_VIDEO_INTERFACE_COLLECTION)
      .u8(0)
      .u8(0);
  body.bytes(controlInterface(streams));
  const auto interval_100ns =
      static_cast<std::uint32_t>(options_.interval.count()) * kIntervalUnits;
  for (int i = 0; i < static_cast<int>(streams); ++i) {
    const unsigned number = 1 + static_cast<unsigned>(i);
    const bool is_bulk = options_.endpoint == Endpoint::Bulk;
    body.bytes(interface(number, 0, is_bulk ? 1 : 0, UVC_SC_VIDEOSTREAMING));
    body.bytes(streamFormats(i, interval_100ns));
    if (is_bulk) {
      body.bytes(endpoint(i, USB_ENDPOINT_XFER_BULK, is_super ? kSuperBulkPacket : kBulkPacket,
                          options_.speed));
    } else {
      body.bytes(interface(number, 1, 1, UVC_SC_VIDEOSTREAMING));
      body.bytes(endpoint(i, USB_ENDPOINT_XFER_ISOC | USB_ENDPOINT_SYNC_ASYNC, kIsochronousPacket,
                          options_.speed));
    }
  }
  const Bytes all = body.done();
  return Writer{}
      .u8(9)
      .u8(USB_DT_CONFIG)
      .u16(9 + static_cast<unsigned>(all.size()))
      .u8(1 + streams)
      .u8(1)
      .u8(0)
      .u8(0x80)
      .u8(50)
      .bytes(all)
      .done();
}

// ---- requests
// ----------------------------------------------------------------------------------

Answer UvcCamera::control(const Setup& setup, std::span<const std::byte> out) {
  const unsigned where = setup.index & 0xFFU, entity = setup.index >> 8U,
                 selector = setup.value >> 8U;
  if (where > 0 && where <= streams_.size() &&
      (selector == UVC_VS_PROBE_CONTROL || selector == UVC_VS_COMMIT_CONTROL)) {
    return probe(setup, out);
  }
  if (where != 0) return stall();
  if (entity == kSensor && selector == UVC_CT_EXPOSURE_TIME_ABSOLUTE_CONTROL)
    return exposureControl(setup, out);
  if (entity == kProcessing && selector == UVC_PU_GAIN_CONTROL) return gainControl(setup, out);
  return stall();
}

Answer UvcCamera::probe(const Setup& setup, std::span<const std::byte>) {
  if (setup.request == UVC_SET_CUR) return {};  // there is nothing to choose
  if (setup.request == UVC_GET_LEN) return {0, Writer{}.u16(kProbeBytes).done()};
  const std::uint32_t payload = options_.endpoint == Endpoint::Bulk ? kPayload : kIsochronousPacket;
  Writer answer;
  answer.u16(1).u8(1).u8(1).u32(static_cast<std::uint32_t>(options_.interval.count()) *
                                kIntervalUnits);
  answer.u16(0).u16(0).u16(0).u16(0).u16(0).u32(kPictureBytes).u32(payload);
  return {0, answer.done()};
}

Answer UvcCamera::exposureControl(const Setup& setup, std::span<const std::byte> out) {
  if (setup.request == UVC_SET_CUR) {
    exposure_ = numberIn(out);
    return {};
  }
  return get(setup.request, 4, [this](unsigned request) -> std::uint32_t {
    return request == UVC_GET_MAX   ? kMostExposure_100us
           : request == UVC_GET_DEF ? kExposure_100us
           : request == UVC_GET_CUR ? exposure_.load()
                                    : 1;
  });
}

Answer UvcCamera::gainControl(const Setup& setup, std::span<const std::byte> out) {
  if (setup.request == UVC_SET_CUR) {
    gain_ = static_cast<std::uint16_t>(numberIn(out));
    return {};
  }
  return get(setup.request, 2, [this](unsigned request) -> std::uint32_t {
    return request == UVC_GET_MAX   ? kMostGain
           : request == UVC_GET_DEF ? kGain
           : request == UVC_GET_CUR ? gain_.load()
           : request == UVC_GET_RES ? 1
                                    : 0;
  });
}

// ---- pictures
// ----------------------------------------------------------------------------------

/// Isochronous streams stop by alternate setting 0, bulk streams when the
/// endpoint's halt is cleared.
void UvcCamera::onInterface(int number, int) {
  if (number < 1 || number > static_cast<int>(streams_.size())) return;
  Stream& stream = streams_[static_cast<std::size_t>(number - 1)];
  const std::uint32_t frame = stream.frame;
  stream = Stream{};
  stream.frame = frame;
}

void UvcCamera::onClearHalt(std::uint8_t address) {
  onInterface(static_cast<int>(address & 0x7FU), 0);
}

SteadyTime UvcCamera::due() const {
  SteadyTime next = Clock::now() + std::chrono::milliseconds{20};
  for (const Stream& stream : streams_) {
    if (stream.next_transfer) {
      next = std::min(next, *stream.next_transfer);
    } else if (stream.next_picture && stream.picture.empty() && !hangs_) {
      next = std::min(next, *stream.next_picture);
    }
  }
  return next;
}

/// Takes the next picture if it is time for it. False if there is none to send.
bool UvcCamera::begin(Stream& stream, int index, SteadyTime now) {
  if (!stream.picture.empty()) return true;
  if (!stream.next_picture) stream.next_picture = now;
  if (now < *stream.next_picture || hangs_) return false;
  stream.next_picture = std::max(*stream.next_picture + options_.interval, now - options_.interval);
  Writer picture;
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    for (std::uint32_t x = 0; x < kWidth; ++x) picture.u16(codeAt(stream.frame, index, x, y));
  }
  stream.picture = picture.done();
  stream.sent = 0;
  ++stream.frame;
  stream.is_toggled = !stream.is_toggled;
  stream.is_damaged = index == 0 && damaged_ > 0 && damaged_-- > 0;
  const bool is_short = index == 0 && truncated_ > 0 && truncated_-- > 0;
  if (is_short) stream.picture.resize(kPictureBytes / 2);
  return true;
}

/// One payload: a header, and as much of the picture as fits.
std::uint32_t UvcCamera::putPayload(Stream& stream, Bytes& out, std::size_t most) {
  const std::size_t length = std::min(most - kHeaderBytes, stream.picture.size() - stream.sent);
  const bool is_last = stream.sent + length == stream.picture.size();
  unsigned bits = UVC_STREAM_EOH | (stream.is_toggled ? UVC_STREAM_FID : 0U);
  if (is_last) bits |= UVC_STREAM_EOF;
  if (stream.is_damaged) bits |= UVC_STREAM_ERR;
  out.push_back(std::byte{kHeaderBytes});
  out.push_back(static_cast<std::byte>(bits));
  const auto from = stream.picture.begin() + static_cast<std::ptrdiff_t>(stream.sent);
  out.insert(out.end(), from, from + static_cast<std::ptrdiff_t>(length));
  stream.sent += length;
  if (is_last) stream.picture.clear();
  return static_cast<std::uint32_t>(kHeaderBytes + length);
}

bool UvcCamera::serve(Transfer& transfer, SteadyTime now) {
  const int index = (transfer.endpoint & 0x7F) - 1;
  if (index < 0 || index >= static_cast<int>(streams_.size())) {
    transfer.status = stall().status;
    return true;
  }
  Stream& stream = streams_[static_cast<std::size_t>(index)];
  if (!transfer.packets.empty()) return serveIsochronous(stream, index, transfer, now);
  if (!begin(stream, index, now)) return false;
  putPayload(stream, transfer.data, transfer.length);
  return true;
}

/// A transfer takes as long as its packets have microframes, whether there is a
/// picture or not.
bool UvcCamera::serveIsochronous(Stream& stream, int index, Transfer& transfer, SteadyTime now) {
  const auto lasts = kMicroframe * static_cast<int>(transfer.packets.size());
  if (!stream.next_transfer) stream.next_transfer = now + lasts;
  if (now < *stream.next_transfer) return false;
  stream.next_transfer = std::max(*stream.next_transfer + lasts, now - 4 * lasts);
  for (Transfer::Packet& packet : transfer.packets) {
    if (begin(stream, index, now)) packet.actual = putPayload(stream, transfer.data, packet.length);
  }
  return true;
}

}  // namespace toftwin::kernel_test
