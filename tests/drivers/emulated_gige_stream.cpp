// SPDX-License-Identifier: Apache-2.0
// What the emulated camera sees and how it sends it.
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <utility>

#include "emulated_gige.h"
#include "emulated_gige_wire.h"

namespace toftwin::test {

using namespace gige;

// ---- what it sees ------------------------------------------------------------------------------

std::uint16_t EmulatedGige::rangeCode(std::uint64_t n, int x, int y) {
  if ((x + y) % 11 == 0) return 0;
  return static_cast<std::uint16_t>(4000 + 7 * x + 13 * y + static_cast<int>(n % 64));
}
std::uint16_t EmulatedGige::intensity(int x, int y) {
  return static_cast<std::uint16_t>(300 + 3 * x + y);
}
std::uint16_t EmulatedGige::confidence(int x, int y) {
  return static_cast<std::uint16_t>((x * y) % 17 == 3 ? 0 : 900 + x);
}

// ---- stream ------------------------------------------------------------------------------------

std::uint64_t EmulatedGige::deviceTime() const {
  const std::chrono::nanoseconds now = Clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(now.count() + clock_ns);
}

Bytes EmulatedGige::imageBytes(std::uint32_t format) const {
  Bytes bytes;
  const auto real = [&](Bytes& to, double value) {
    putLittle(to, std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4);
  };
  std::array<Bytes, 3> planes;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const std::uint16_t code = rangeCode(frame_, x, y);
      const std::array<double, 3> point{code * (x - kU_px) / kFocal_px,
                                        code * (y - kV_px) / kFocal_px, static_cast<double>(code)};
      if (format == kC16) putLittle(bytes, code, 2);
      if (format == kC32f) real(bytes, code);
      for (std::size_t i = 0; i < 3; ++i) {
        const double value = code == 0 ? std::numeric_limits<double>::quiet_NaN() : point[i];
        if (format == kABC32f) real(bytes, value);
        if (format == kABC32fPlanar) real(planes[i], value);
      }
      if (format == kMono8) putLittle(bytes, intensity(x, y) % 256U, 1);
      if (format == kMono16) putLittle(bytes, intensity(x, y), 2);
      if (format == kConfidence8) putLittle(bytes, confidence(x, y) % 256U, 1);
      if (format == kConfidence16) putLittle(bytes, confidence(x, y), 2);
    }
  }
  for (const Bytes& plane : planes) bytes.insert(bytes.end(), plane.begin(), plane.end());
  return bytes;
}

std::vector<EmulatedGige::Image> EmulatedGige::images() const {
  std::vector<Image> images;
  for (std::uint32_t i = 0; i < 3; ++i) {
    if (registers_.at(kEnable + 4 * i) == 0) continue;
    const std::uint32_t format = registers_.at(kFormat + 4 * i);
    images.push_back({registers_.at(kIds + 4 * i), format, imageBytes(format)});
  }
  return images;
}

std::uint32_t EmulatedGige::payloadSize() const {
  std::size_t size = 64;  // chunk data
  for (const Image& one : images()) size += one.bytes.size();
  return static_cast<std::uint32_t>(size);
}

/// Leader, payload and trailer with 8 bytes of header: block ids of 16 bits.
std::vector<Bytes> EmulatedGige::packetsOfImage(const Image& image) const {
  std::vector<Bytes> packets;
  const auto begin = [&](unsigned content) {
    Bytes& packet = packets.emplace_back();
    put(packet, 0, 2);
    put(packet, frame_id_ & 0xFFFF, 2);
    put(packet, std::uint64_t{content} << 24U | (packets.size() - 1), 4);
    return &packet;
  };
  const bool has_chunks = registers_.at(kChunkMode) != 0 && registers_.at(kChunkEnable) != 0;
  Bytes data = image.bytes;
  if (has_chunks) {
    put(data, 1, 4);  // the image is a chunk too
    put(data, image.bytes.size(), 4);
    put(data, registers_.at(kExposure), 4);
    put(data, registers_.at(kExposure + 4), 4);
    put(data, 2, 4);
    put(data, 8, 4);
  }
  Bytes* leader = begin(1);
  put(*leader, 0, 2);
  put(*leader, has_chunks ? 0x4001 : 0x0001, 2);
  put(*leader, deviceTime(), 8);
  for (const std::uint32_t number : {image.format, std::uint32_t{kWidth}, std::uint32_t{kHeight}})
    put(*leader, number, 4);
  put(*leader, 0, 12);
  const std::size_t most = (registers_.at(kPacketSize) & 0xFFFF) - 36;
  for (std::size_t at = 0; at < data.size(); at += most) {
    const std::size_t size = std::min(most, data.size() - at);
    Bytes* packet = begin(3);
    packet->insert(packet->end(), data.begin() + static_cast<std::ptrdiff_t>(at),
                   data.begin() + static_cast<std::ptrdiff_t>(at + size));
  }
  Bytes* trailer = begin(2);
  put(*trailer, 1, 4);
  put(*trailer, kHeight, 4);
  return packets;
}

/// Several images in one frame: 20 bytes of header, block ids of 64 bits.
std::vector<Bytes> EmulatedGige::packetsOfParts(const std::vector<Image>& images) const {
  std::vector<Bytes> packets;
  const auto begin = [&](unsigned content) {
    Bytes& packet = packets.emplace_back();
    put(packet, 0, 4);
    put(packet, std::uint64_t{0x80U | content} << 24U | (content == 1 ? images.size() : 0), 4);
    put(packet, frame_id_, 8);
    put(packet, packets.size() - 1, 4);
    return &packet;
  };
  Bytes* leader = begin(1);
  put(*leader, 0, 2);
  put(*leader, 0x000A, 2);
  put(*leader, deviceTime(), 8);
  for (const Image& image : images) {
    put(*leader, image.component == 4 ? 5 : image.component == 6 ? 9 : 1, 2);  // 3D, confidence, 2D
    put(*leader, image.bytes.size(), 6);
    put(*leader, image.format, 4);
    put(*leader, 0, 8);
    put(*leader, image.component, 2);
    put(*leader, 0, 2);
    put(*leader, kWidth, 4);
    put(*leader, kHeight, 4);
    put(*leader, 0, 16);
  }
  const std::size_t most = (registers_.at(kPacketSize) & 0xFFFF) - 56;
  std::size_t part_begin = 0;
  for (std::size_t part = 0; part < images.size(); ++part) {
    const Bytes& data = images[part].bytes;
    for (std::size_t at = 0; at < data.size(); at += most) {
      const std::size_t size = std::min(most, data.size() - at);
      Bytes* packet = begin(7);
      put(*packet, part, 1);
      put(*packet, 0, 1);
      put(*packet, part_begin + at, 6);
      packet->insert(packet->end(), data.begin() + static_cast<std::ptrdiff_t>(at),
                     data.begin() + static_cast<std::ptrdiff_t>(at + size));
    }
    part_begin += data.size();
  }
  Bytes* trailer = begin(2);
  put(*trailer, 0x000A, 4);
  return packets;
}

void EmulatedGige::send(Bytes packet, bool is_first_time) {
  const int every = drop_every;
  if (is_first_time && every > 0 && ++packets_ % every == 0) return;
  largest_packet = std::max<int>(largest_packet, static_cast<int>(packet.size()) + 28);
  if (is_full_size_lost && packet.size() + 28 > 1500) return;
  if (damage && is_first_time) damage(packet);
  const sockaddr_in to = socketAddress(registers_[kStreamAddress],
                                       static_cast<std::uint16_t>(registers_[kStreamPort]));
  ::sendto(stream_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to),
           sizeof to);
}

void EmulatedGige::sendFrame() {
  frame_id_ += static_cast<std::uint64_t>(skip_frames.exchange(0));
  const bool is_multipart = (registers_[kMultipart] & kMultipartBit) != 0;
  const auto all = images();
  if (!all.empty()) {
    auto packets = is_multipart ? packetsOfParts(all) : packetsOfImage(all.front());
    sent_.push_back({is_multipart ? frame_id_ : frame_id_ & 0xFFFF, packets});
    if (sent_.size() > 8) sent_.pop_front();
    for (const Bytes& packet : packets) send(packet, true);
  }
  ++frame_;
  ++frame_id_;
  if (!is_multipart && (frame_id_ & 0xFFFF) == 0) ++frame_id_;  // 0 is no id
}

bool EmulatedGige::isDue() {
  if (is_cut || is_hung || registers_[kAcquisition] != 1 || controller_port_ == 0) return false;
  if (registers_[kTriggerMode] == 1) {
    if (triggers_ <= 0) return false;
    --triggers_;
    return true;
  }
  const double rate_hz =
      std::bit_cast<double>(std::uint64_t{registers_[kRate]} << 32U | registers_[kRate + 4]);
  const auto now = Clock::now();
  if (now < due_) return false;
  due_ = std::max(due_ + std::chrono::duration_cast<Clock::duration>(
                             std::chrono::duration<double>{1.0 / rate_hz}),
                  now);
  return true;
}

}  // namespace toftwin::test
