// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "daemon/facades/gige_vision/gvcp.h"
#include "daemon/facades/gige_vision/images.h"

/// GigE Vision's stream protocol as bytes.
///   header:  status (2), block (2), 0x00 + kind (1), packet (3)
///   or long: status (2), flags (2), 0x80 + kind (1), 0 or number of parts (3), block (8), packet (4)
/// Packet 0 is the leader, the last one the trailer.
namespace toftwin::daemon::gige_vision {

/// One frame under way: its packets can be made again at any time.
class Block {
 public:
  struct Header {
    std::uint64_t id = 1;
    std::int64_t stamp_ns = 0;
    std::uint32_t packet_size = 1500;  ///< with the headers of IP and UDP
    bool is_multipart = false;         ///< has long ids then
    bool has_long_ids = false;
  };
  Block(const Header& header, Payload payload);

  [[nodiscard]] std::uint64_t id() const { return header_.id; }
  [[nodiscard]] bool hasLongIds() const { return header_.has_long_ids; }
  [[nodiscard]] std::uint32_t packets() const { return trailer_ + 1; }
  [[nodiscard]] std::size_t size() const { return payload_.bytes.size(); }
  /// `number` below packets().
  [[nodiscard]] Bytes packet(std::uint32_t number, bool is_sent_again = false) const;

 private:
  [[nodiscard]] Bytes begin(unsigned kind, std::uint32_t number, bool is_sent_again) const;
  [[nodiscard]] std::uint32_t payloadType() const;
  void appendLeader(Bytes& to) const;
  void appendTrailer(Bytes& to) const;
  void appendPiece(Bytes& to, std::uint32_t number) const;

  Header header_;
  Payload payload_;
  std::size_t piece_;      ///< bytes of payload in a packet
  std::uint32_t trailer_;  ///< its number
};

/// A packet that cannot be sent again any more.
Bytes unavailablePacket(const Resend& asked, std::uint32_t number);
/// A packet whose size alone matters, of `size` bytes with the headers of IP and UDP.
Bytes testPacket(std::uint32_t size);

/// The id after that one: those of 16 bits go from 65535 to 1, because 0 is none.
std::uint64_t idAfter(std::uint64_t id, std::uint64_t steps, bool is_long);

}  // namespace toftwin::daemon::gige_vision
