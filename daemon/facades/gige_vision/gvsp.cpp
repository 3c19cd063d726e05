// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/gvsp.h"

#include <algorithm>
#include <utility>

namespace toftwin::daemon::gige_vision {
namespace {

constexpr unsigned kLeader = 1, kTrailer = 2, kPayload = 3, kMultipart = 7, kLong = 0x80;
constexpr std::uint32_t kIpAndUdp = 28, kShortHeader = 8, kLongHeader = 20, kPlace = 8;
constexpr std::uint32_t kImageType = 0x0001, kPartsType = 0x000A, kWithChunks = 0x4000;
constexpr std::uint16_t kSentAgainFlag = 0x0001;

std::size_t pieceOf(const Block::Header& header) {
  const std::uint32_t overhead =
      kIpAndUdp + (header.has_long_ids ? kLongHeader : kShortHeader) + (header.is_multipart ? kPlace : 0);
  return header.packet_size - overhead;
}

std::uint32_t piecesOf(std::size_t bytes, std::size_t piece) {
  return static_cast<std::uint32_t>((bytes + piece - 1) / piece);
}

void appendImage(Bytes& to, const Part& part) {
  append(to, part.format, 4);
  for (const std::uint32_t number : {part.width, part.height, part.x, part.y}) append(to, number, 4);
  append(to, 0, 4);  // padding
}

void appendPart(Bytes& to, const Part& part) {
  append(to, part.data_type, 2);
  append(to, part.size, 6);
  append(to, part.format, 4);
  append(to, 0, 8);  // source, zones
  append(to, part.component, 2);
  append(to, 0, 2);  // region
  for (const std::uint32_t number : {part.width, part.height, part.x, part.y}) append(to, number, 4);
  append(to, 0, 8);  // padding
}

}  // namespace

Block::Block(const Header& header, Payload payload)
    : header_(header), payload_(std::move(payload)), piece_(pieceOf(header)) {
  std::uint32_t pieces = 0;
  if (header_.is_multipart) {
    for (const Part& part : payload_.parts) pieces += piecesOf(part.size, piece_);
  } else {
    pieces = piecesOf(payload_.bytes.size(), piece_);
  }
  trailer_ = pieces + 1;
}

std::uint32_t Block::payloadType() const {
  return (header_.is_multipart ? kPartsType : kImageType) | (payload_.has_chunks ? kWithChunks : 0);
}

Bytes Block::begin(unsigned kind, std::uint32_t number, bool is_sent_again) const {
  Bytes bytes;
  if (!header_.has_long_ids) {
    append(bytes, is_sent_again ? Status::kPacketResent : Status::kSuccess, 2);
    append(bytes, header_.id, 2);
    append(bytes, kind, 1);
    append(bytes, number, 3);
    return bytes;
  }
  append(bytes, Status::kSuccess, 2);
  append(bytes, is_sent_again ? kSentAgainFlag : 0U, 2);
  append(bytes, kLong | kind, 1);
  append(bytes, header_.is_multipart && kind == kLeader ? payload_.parts.size() : 0, 3);
  append(bytes, header_.id, 8);
  append(bytes, number, 4);
  return bytes;
}

void Block::appendLeader(Bytes& to) const {
  append(to, 0, 2);
  append(to, payloadType(), 2);
  append(to, static_cast<std::uint64_t>(header_.stamp_ns), 8);
  if (!header_.is_multipart) return appendImage(to, payload_.parts.front());
  for (const Part& part : payload_.parts) appendPart(to, part);
}

void Block::appendTrailer(Bytes& to) const {
  append(to, payloadType(), 4);
  if (!header_.is_multipart) append(to, payload_.parts.front().height, 4);
  if (!payload_.has_chunks) return;
  append(to, payload_.bytes.size(), 4);
  append(to, 0, 4);  // layout of the chunks
}

/// `number` counts from 1.
void Block::appendPiece(Bytes& to, std::uint32_t number) const {
  std::size_t begin = 0, end = payload_.bytes.size(), at = number - 1;
  if (header_.is_multipart) {
    std::size_t part = 0;
    for (; at >= piecesOf(payload_.parts[part].size, piece_); ++part)
      at -= piecesOf(payload_.parts[part].size, piece_);
    begin = payload_.parts[part].offset;
    end = begin + payload_.parts[part].size;
    append(to, part, 1);
    append(to, 0, 1);  // zone
    append(to, begin + at * piece_, 6);
  }
  const auto from = payload_.bytes.begin();
  const std::size_t first = begin + at * piece_, last = std::min(first + piece_, end);
  to.insert(to.end(), from + static_cast<std::ptrdiff_t>(first), from + static_cast<std::ptrdiff_t>(last));
}

Bytes Block::packet(std::uint32_t number, bool is_sent_again) const {
  const unsigned kind = number == 0            ? kLeader
                        : number == trailer_   ? kTrailer
                        : header_.is_multipart ? kMultipart
                                               : kPayload;
  Bytes bytes = begin(kind, number, is_sent_again);
  if (number == 0) {
    appendLeader(bytes);
  } else if (number == trailer_) {
    appendTrailer(bytes);
  } else {
    appendPiece(bytes, number);
  }
  return bytes;
}

Bytes unavailablePacket(const Resend& asked, std::uint32_t number) {
  Bytes bytes;
  append(bytes, Status::kPacketUnavailable, 2);
  append(bytes, asked.has_long_ids ? kSentAgainFlag : asked.block, 2);
  append(bytes, (asked.has_long_ids ? kLong : 0U) | kPayload, 1);
  append(bytes, asked.has_long_ids ? 0 : number, 3);
  if (asked.has_long_ids) {
    append(bytes, asked.block, 8);
    append(bytes, number, 4);
  }
  return bytes;
}

Bytes testPacket(std::uint32_t size) {
  Bytes bytes;
  append(bytes, 0, 4);  // block 0 is no frame
  append(bytes, kPayload, 1);
  append(bytes, 0, 3);
  bytes.resize(size - kIpAndUdp);
  return bytes;
}

std::uint64_t idAfter(std::uint64_t id, std::uint64_t steps, bool is_long) {
  constexpr std::uint64_t kMostShort = 65'535;
  if (is_long) return id + steps;
  return (id - 1 + steps % kMostShort) % kMostShort + 1;
}

}  // namespace toftwin::daemon::gige_vision
