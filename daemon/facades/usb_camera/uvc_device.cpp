// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/usb_camera/uvc_device.h"

#include <linux/usb/video.h>

#include <algorithm>
#include <utility>

namespace toftwin::daemon::usb_camera {
namespace {

constexpr unsigned kProbeBytes = 34;
constexpr std::uint32_t kHeaderBytes = 12;  // with both times
constexpr std::chrono::microseconds kMicroframe{125};
// The bus' frame number stands still: over USB/IP there is no bus that device and host count the frames of,
// and Linux' virtual controller says 0 always (and complains in the kernel's log whenever it is asked).
constexpr unsigned kBusFrame = 0;

std::uint32_t littleIn(std::span<const std::byte> bytes) {
  std::uint32_t number = 0;
  for (std::size_t i = std::min<std::size_t>(bytes.size(), 4); i-- > 0;)
    number = number << 8U | std::to_integer<std::uint32_t>(bytes[i]);
  return number;
}

Answer sizeAnswer(unsigned size) { return {0, Writer{}.u16(size).done()}; }
Answer canGetAndSet() { return {0, Writer{}.u8(UVC_CONTROL_CAP_GET | UVC_CONTROL_CAP_SET).done()}; }

}  // namespace

UvcDevice::UvcDevice(UvcLayout layout) : layout_(std::move(layout)), streams_(layout_.streams.size()) {
  for (Stream& stream : streams_) stream.interval_100ns = layout_.intervals.preset;
}

std::string UvcDevice::text(int index) const {
  return index == 1 ? layout_.vendor : index == 2 ? layout_.model : index == 3 ? layout_.serial : "";
}

// ---- requests ----------------------------------------------------------------------------------

Answer UvcDevice::control(const Setup& setup, std::span<const std::byte> out) {
  const unsigned where = setup.index & 0xFFU, entity = setup.index >> 8U, selector = setup.value >> 8U;
  if (where >= kFirstStreaming && where - kFirstStreaming < streams_.size()) {
    const std::size_t number = where - kFirstStreaming;
    Stream& stream = streams_[number];
    if (selector != UVC_VS_PROBE_CONTROL && selector != UVC_VS_COMMIT_CONTROL)
      return refuse(Refusal::NoSuchControl);
    const Answer answer = probe(stream, layout_.streams[number].pictureBytes(), setup, out);
    const bool is_commit = selector == UVC_VS_COMMIT_CONTROL && setup.request == UVC_SET_CUR;
    return is_commit && answer.status == 0 ? setInterval(stream.interval_100ns) : answer;
  }
  if (where == 0 && entity == 0 && selector == UVC_VC_REQUEST_ERROR_CODE_CONTROL && setup.isIn())
    return {0, Writer{}.u8(static_cast<unsigned>(refusal_)).done()};
  if (where != 0) return refuse(Refusal::NoSuchControl);
  if (entity == kSensor && selector == UVC_CT_EXPOSURE_TIME_ABSOLUTE_CONTROL)
    return numberControl(setup, out, Number::Exposure_100us, 4, layout_.exposure_100us);
  if (entity == kProcessing && selector == UVC_PU_GAIN_CONTROL)
    return numberControl(setup, out, Number::Gain, 2, layout_.gain);
  return refuse(Refusal::NoSuchControl);
}

Answer UvcDevice::refuse(Refusal why) {
  refusal_ = why;
  return stall();
}

/// What the host proposes comes back as it can be had: only the interval is to be chosen.
Answer UvcDevice::probe(Stream& stream, std::uint32_t picture_bytes, const Setup& setup,
                        std::span<const std::byte> out) {
  constexpr std::size_t kIntervalAt = 4;
  const Intervals& intervals = layout_.intervals;
  if (setup.request == UVC_SET_CUR) {
    if (out.size() < kIntervalAt + 4) return refuse(Refusal::OutOfRange);
    const std::uint32_t wanted = littleIn(out.subspan(kIntervalAt, 4));
    stream.interval_100ns = wanted == 0 ? intervals.preset : std::clamp(wanted, intervals.min, intervals.max);
    return {};
  }
  if (setup.request == UVC_GET_LEN) return sizeAnswer(kProbeBytes);
  if (setup.request == UVC_GET_INFO) return canGetAndSet();
  const std::uint32_t interval = setup.request == UVC_GET_MIN   ? intervals.min
                                 : setup.request == UVC_GET_MAX ? intervals.max
                                 : setup.request == UVC_GET_DEF ? intervals.preset
                                                                : stream.interval_100ns;
  Writer answer;
  answer.u16(1).u8(1).u8(1).u32(interval).u16(0).u16(0).u16(0).u16(0).u16(0);
  answer.u32(picture_bytes).u32(payloadBytesOf(layout_)).u32(kClockHz);
  return {0, answer.u8(UVC_STREAM_FID | UVC_STREAM_EOF).u8(0).u8(0).u8(0).done()};
}

Answer UvcDevice::numberControl(const Setup& setup, std::span<const std::byte> out, Number which,
                                std::size_t size, const std::optional<ControlRange>& range) {
  if (!range) return refuse(Refusal::NoSuchControl);
  const auto answer = [size](std::uint32_t value) {
    return Answer{0, size == 2 ? Writer{}.u16(value).done() : Writer{}.u32(value).done()};
  };
  switch (setup.request) {
    case UVC_SET_CUR: {
      const std::uint32_t wanted = littleIn(out);
      const bool is_within = out.size() == size && wanted >= range->min && wanted <= range->max;
      return is_within ? setNumber(which, wanted) : refuse(Refusal::OutOfRange);
    }
    case UVC_GET_CUR:
      return answer(number(which));
    case UVC_GET_MIN:
      return answer(range->min);
    case UVC_GET_MAX:
      return answer(range->max);
    case UVC_GET_RES:
      return answer(1);
    case UVC_GET_DEF:
      return answer(range->preset);
    case UVC_GET_LEN:
      return sizeAnswer(static_cast<unsigned>(size));
    case UVC_GET_INFO:
      return canGetAndSet();
    default:
      return refuse(Refusal::NoSuchControl);
  }
}

// ---- pictures ----------------------------------------------------------------------------------

void UvcDevice::onAttach() {
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    streams_[i].interval_100ns = layout_.intervals.preset;
    reset(i);
  }
  refusal_ = Refusal::None;
}

/// Isochronous streams stop by alternate setting 0, bulk streams when the endpoint's halt is cleared.
void UvcDevice::onInterface(int number, int) {
  if (number < static_cast<int>(kFirstStreaming)) return;
  const std::size_t index = static_cast<std::size_t>(number) - kFirstStreaming;
  if (index < streams_.size()) reset(index);
}

void UvcDevice::reset(std::size_t number) {
  const std::uint32_t chosen = streams_[number].interval_100ns;
  streams_[number] = Stream{};
  streams_[number].interval_100ns = chosen;
  onReset(number);
}

void UvcDevice::onClearHalt(std::uint8_t address) { onInterface(static_cast<int>(address & 0x7FU), 0); }

SteadyTime UvcDevice::due(std::uint8_t endpoint) const {
  const std::size_t number = (endpoint & 0x7FU) - 1U;
  if (number >= streams_.size()) return SteadyTime::max();  // its transfers are done as they come
  return streams_[number].next_transfer.value_or(nextPictureDue(number));
}

bool UvcDevice::begin(std::size_t number, SteadyTime now) {
  Stream& stream = streams_[number];
  if (stream.picture) return true;
  auto picture = nextPicture(number, now);
  if (!picture || picture->pixels.empty()) return false;
  stream.picture = std::move(picture);
  stream.sent = 0;
  stream.is_toggled = !stream.is_toggled;
  return true;
}

/// One payload: a header, and as much of the picture as fits into `most` bytes, header included.
/// [USB Video Class 1.1, 2.4.3.3]
std::uint32_t UvcDevice::putPayload(Stream& stream, Bytes& out, std::size_t most, SteadyTime now) {
  const std::size_t length = std::min(most - kHeaderBytes, stream.picture->pixels.size() - stream.sent);
  const bool is_last = stream.sent + length == stream.picture->pixels.size();
  unsigned bits =
      UVC_STREAM_EOH | UVC_STREAM_PTS | UVC_STREAM_SCR | (stream.is_toggled ? UVC_STREAM_FID : 0U);
  if (is_last) bits |= UVC_STREAM_EOF;
  if (stream.picture->is_damaged) bits |= UVC_STREAM_ERR;
  Writer header;
  header.u8(kHeaderBytes).u8(bits).u32(stream.picture->stamp);
  const Bytes head = header.u32(clockNow(now)).u16(kBusFrame).done();
  out.insert(out.end(), head.begin(), head.end());
  const auto from = stream.picture->pixels.begin() + static_cast<std::ptrdiff_t>(stream.sent);
  out.insert(out.end(), from, from + static_cast<std::ptrdiff_t>(length));
  stream.sent += length;
  if (is_last) stream.picture.reset();
  return static_cast<std::uint32_t>(kHeaderBytes + length);
}

bool UvcDevice::serve(Transfer& transfer, SteadyTime now) {
  const std::size_t number = (transfer.endpoint & 0x7FU) - 1U;
  if (!transfer.isIn() || number >= streams_.size()) {
    transfer.data.clear();
    transfer.status = stall().status;
    return true;
  }
  if (!transfer.packets.empty()) return serveIsochronous(number, transfer, now);
  return transfer.length == 0 || serveBulk(number, transfer, now);
}

/// A payload ends with a transfer that is not full, or when it has all bytes that one can have.
bool UvcDevice::serveBulk(std::size_t number, Transfer& transfer, SteadyTime now) {
  Stream& stream = streams_[number];
  if (std::exchange(stream.must_end_short, false)) return true;
  if (stream.payload_sent == stream.payload.size()) {
    if (!begin(number, now)) return false;
    stream.payload.clear();
    stream.payload_sent = 0;
    putPayload(stream, stream.payload, payloadBytesOf(layout_), now);
  }
  const std::size_t size =
      std::min<std::size_t>(transfer.length, stream.payload.size() - stream.payload_sent);
  const auto from = stream.payload.begin() + static_cast<std::ptrdiff_t>(stream.payload_sent);
  transfer.data.assign(from, from + static_cast<std::ptrdiff_t>(size));
  stream.payload_sent += size;
  stream.must_end_short = stream.payload_sent == stream.payload.size() && size == transfer.length &&
                          stream.payload.size() < payloadBytesOf(layout_);
  return true;
}

/// A transfer takes as long as its packets have microframes, whether there is a picture or not.
bool UvcDevice::serveIsochronous(std::size_t number, Transfer& transfer, SteadyTime now) {
  Stream& stream = streams_[number];
  const auto lasts = kMicroframe * static_cast<int>(transfer.packets.size());
  if (!stream.next_transfer) stream.next_transfer = now + lasts;
  if (now < *stream.next_transfer) return false;
  stream.next_transfer = std::max(*stream.next_transfer + lasts, now - 4 * lasts);
  for (Transfer::Packet& packet : transfer.packets) {
    const std::uint32_t most = std::min({packet.length, payloadBytesOf(layout_),
                                         transfer.length - static_cast<std::uint32_t>(transfer.data.size())});
    if (most > kHeaderBytes && begin(number, now))
      packet.actual = putPayload(stream, transfer.data, most, now);
  }
  return true;
}

}  // namespace toftwin::daemon::usb_camera
