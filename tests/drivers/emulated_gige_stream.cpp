// SPDX-License-Identifier: Apache-2.0
// How the emulated camera sends what it sees.
#include <sys/socket.h>

#include <algorithm>
#include <utility>

#include "emulated_gige.h"
#include "emulated_gige_wire.h"

namespace toftwin::test {

using namespace gige;

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
  const bool has_chunks = hasChunks();
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
  frame_id_ += idsLeftOut();
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

bool EmulatedGige::isDue() { return !is_cut && !is_hung && controller_port_ != 0 && isFrameDue(); }

}  // namespace toftwin::test
