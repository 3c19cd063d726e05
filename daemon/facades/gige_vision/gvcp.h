// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

/// GigE Vision's control protocol as bytes: no sockets, no state.
///   command: 0x42 (1), flags (1), command (2), length of what follows (2), number (2)
///   answer:  status (2), command + 1 (2), length of what follows (2), the command's number (2)
namespace toftwin::daemon::gige_vision {

using Bytes = std::vector<std::byte>;

struct Command {
  static constexpr std::uint16_t kDiscovery = 0x0002, kPacketResend = 0x0040, kReadRegister = 0x0080,
                                 kWriteRegister = 0x0082, kReadMemory = 0x0084, kWriteMemory = 0x0086,
                                 kPending = 0x0088;  ///< answers alone: 0x0089
};

/// What an answer's first two bytes say.
struct Status {
  static constexpr std::uint16_t kSuccess = 0, kPacketResent = 0x0100, kNotImplemented = 0x8001,
                                 kInvalidParameter = 0x8002, kInvalidAddress = 0x8003, kWriteProtect = 0x8004,
                                 kBadAlignment = 0x8005, kAccessDenied = 0x8006, kBusy = 0x8007,
                                 kPacketUnavailable = 0x800C, kInvalidHeader = 0x800E, kError = 0x8FFF;
};

// Numbers are big endian throughout.
std::uint64_t numberAt(std::span<const std::byte> bytes, std::size_t at, std::size_t size);
void append(Bytes& bytes, std::uint64_t number, std::size_t size);

struct Request {
  std::uint8_t flags = 0;
  std::uint16_t command = 0, number = 0;
  std::span<const std::byte> data;
  bool is_whole = true;  ///< it has the length that it says

  [[nodiscard]] bool wantsAnswer() const { return (flags & 0x01) != 0; }
  [[nodiscard]] bool hasLongIds() const { return (flags & 0x10) != 0; }
};
/// Nothing for whatever is no command of this protocol, which is not answered.
std::optional<Request> readRequest(std::span<const std::byte> datagram);

Bytes encodeAnswer(const Request& to, std::uint16_t status, std::span<const std::byte> data);
/// "Not yet; it takes that long": to a command whose answer waits for the camera.
Bytes encodePending(const Request& to, std::uint16_t most_ms);

/// Packets of a block that are to be sent once more.
struct Resend {
  std::uint64_t block = 0;
  std::uint32_t first = 0, last = 0;
  bool has_long_ids = false;
};
std::optional<Resend> readResend(const Request& request);

}  // namespace toftwin::daemon::gige_vision
