// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <toftwin/result.h>

/// What is said to a Kinect v2's firmware and what it answers, as bytes. No public document of the maker
/// describes it: codes, layouts and their meaning are what the libfreenect2 project found out (its
/// protocol/command.h, protocol/response.h, command_transaction.h). All numbers are little-endian.
namespace toftwin::drivers::kinect2 {

using Bytes = std::vector<std::byte>;

constexpr int kWidth = 512, kHeight = 424;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

enum class Code : std::uint32_t {
  Shutdown = 0x00,
  FirmwareVersions = 0x02,
  InitStreams = 0x09,
  Stop = 0x0A,
  HardwareInfo = 0x14,
  Status = 0x16,
  DataPage = 0x22,
  SetStreaming = 0x2B,
  SetMode = 0x4B,
};

/// A command to endpoint 0x02: five words, then its parameters.
///     0x06022009, number of the command, most bytes of the answer, code, 0, parameters …
struct Command {
  Code code{};
  std::uint32_t most_bytes = 0;  ///< of the answer's data; 0: it has none
  std::vector<std::uint32_t> parameters{};
};

constexpr std::uint32_t kCommandMagic = 0x06022009, kDoneMagic = 0x0A6FE000;
constexpr std::uint32_t kDoneBytes = 16;
/// Of the tables in the camera's memory, their headers and what surrounds them.
constexpr std::uint32_t kMostTableBytes = 0x1C0000;

Command readFirmware();
Command readHardware();
Command readSerial();
Command readPhaseTables();
Command readLens();
/// Bit 0 of the answer: it is ready to stream.
Command readStatus();
Command initStreams();
Command setStreaming(bool on);
/// What the modes mean is not known; libfreenect2 sends {1, 0x00640064} and {0} before it starts and stops.
Command setMode(bool on, std::uint32_t value = 0);
Command stopStreams();
Command shutDown();

Bytes encode(const Command& command, std::uint32_t number);
/// The number of the command that a message from endpoint 0x81 says is done; nothing if it says something
/// else.
std::optional<std::uint32_t> doneNumber(std::span<const std::byte> message);

/// What the factory measured of the lens. Pixel (0, 0)'s centre lies at (0.5, 0.5), and left is right.
struct Lens {
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
};
/// Of each modulation frequency the phase that each pixel adds, in steps of −0.000031 π rad; upright, left
/// is right.
using PhaseTables = std::array<std::vector<std::uint16_t>, 3>;

Result<std::string> serialIn(std::span<const std::byte> answer);
/// "4.0.3912.0": of the fourth part, which libfreenect2 takes for the main one.
Result<std::string> firmwareIn(std::span<const std::byte> answer);
Result<Lens> lensIn(std::span<const std::byte> answer);
Result<PhaseTables> phaseTablesIn(std::span<const std::byte> answer);
Result<std::uint32_t> statusIn(std::span<const std::byte> answer);

/// Little-endian numbers in bytes that somebody has counted.
inline std::uint16_t u16At(std::span<const std::byte> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(std::to_integer<unsigned>(bytes[at]) |
                                    std::to_integer<unsigned>(bytes[at + 1]) << 8U);
}
inline std::uint32_t u32At(std::span<const std::byte> bytes, std::size_t at) {
  return u16At(bytes, at) | std::uint32_t{u16At(bytes, at + 2)} << 16U;
}

}  // namespace toftwin::drivers::kinect2
