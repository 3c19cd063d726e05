// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <toftwin/result.h>

#include "drivers/o3d303/wire/bytes.h"

/// PCIC: the messages on the camera's TCP port 50010. Used by the driver and by whoever plays the camera.
/// A message of version 3, in which each connection begins, is
///
///   TTTT "L" nnnnnnnnn CR LF   TTTT content CR LF
///
/// with a ticket TTTT of four digits, which tells answers from what comes by itself, and nine
/// decimal digits for the length of what follows the first line.
namespace toftwin::o3d303 {

/// The others are for people at a terminal. In both directions: 1 content CR LF; 2 TTTT content CR LF. 4: as 1 to
/// the camera, and "L" nnnnnnnnn CR LF content CR LF from it. [ifm, operating instructions O3D303, process interface]
enum class PcicVersion { V1 = 1, V2 = 2, V3 = 3, V4 = 4 };

inline constexpr std::string_view kFrameTicket = "0000";
inline constexpr std::string_view kErrorTicket = "0001";
inline constexpr std::string_view kNotificationTicket = "0010";
/// Answers to a command: done, refused now, not understood.
inline constexpr char kDone = '*', kRefused = '!', kUnknown = '?';

struct PcicMessage {
  std::string ticket;
  Bytes content;
};

/// As the camera sends it.
Bytes encodePcic(std::string_view ticket, std::span<const std::byte> content,
                 PcicVersion version = PcicVersion::V3);
Bytes encodePcic(std::string_view ticket, std::string_view content, PcicVersion version = PcicVersion::V3);
/// The command that sets what a frame consists of for this connection: "c", its length, the schema.
std::string schemaCommand(std::string_view schema_json);
/// The schema's text in such a command. Malformed if the length is not that of what follows.
Result<std::string_view> schemaInCommand(std::string_view content);

/// Cuts messages out of a stream of bytes that arrive in pieces.
class PcicReader {
 public:
  /// A message that claims to be longer is an error, so that no peer can make us hold more.
  explicit PcicReader(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Of what is sent to the camera from the next message on. Without tickets they are empty.
  void setVersion(PcicVersion version) { version_ = version; }
  void feed(std::span<const std::byte> bytes);
  /// The next whole message, or nothing until more bytes are fed. After an error the stream's
  /// message boundaries are lost: the connection has to be made anew.
  Result<std::optional<PcicMessage>> next();
  /// Whether a message has begun that is not complete.
  [[nodiscard]] bool isWithinMessage() const { return end_ > begin_; }

 private:
  Result<std::optional<PcicMessage>> nextLine();

  std::size_t most_bytes_;
  PcicVersion version_ = PcicVersion::V3;
  Bytes buffer_;  // bytes [begin_, end_) are not yet consumed
  std::size_t begin_ = 0, end_ = 0;
};

}  // namespace toftwin::o3d303
