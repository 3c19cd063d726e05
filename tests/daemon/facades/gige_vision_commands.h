// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <vector>

#include "daemon/facades/gige_vision/device.h"

/// Commands of GigE Vision, and a camera that takes them, without sockets.
namespace toftwin::daemon::gige_vision::test {

inline constexpr Peer kOwner{0x7F000001, 5000}, kOther{0x7F000001, 5001}, kFar{0x7F000002, 5000};

inline Bytes commandOf(std::uint16_t command, std::uint16_t number, const Bytes& data,
                       std::uint8_t flags = 1) {
  Bytes bytes;
  append(bytes, 0x42, 1);
  append(bytes, flags, 1);
  append(bytes, command, 2);
  append(bytes, data.size(), 2);
  append(bytes, number, 2);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}
inline Bytes words(std::initializer_list<std::uint32_t> numbers) {
  Bytes bytes;
  for (const std::uint32_t number : numbers) append(bytes, number, 4);
  return bytes;
}

inline SourceFacts smallCamera() {
  SourceFacts facts;
  facts.is_there = true;
  facts.model = "small";
  facts.camera = {.width = 16,
                  .height = 12,
                  .fx = 16,
                  .fy = 16,
                  .cx = 7.5,
                  .cy = 5.5,
                  .distortion = {},
                  .calibration_id = {}};
  facts.has_range = facts.has_intensity = facts.has_confidence = true;
  facts.exposure_us = SourceNumber{1000.0, 10.0, 5000.0, "exposure_us"};
  facts.frame_rate_hz = SourceNumber{20.0, 0.001, 1000.0, "frame_rate_hz"};
  facts.can_choose_trigger = true;
  return facts;
}

/// A camera in the hands of kOwner, if it wants.
class Camera {
 public:
  Camera()
      : device(
            {.address = 0x7F000009, .netmask = 0xFF000000, .source = "cam", .serial = "S", .version = "1"}) {
    device.update(smallCamera());
  }
  Device::Outcome take(const Peer& from, const Bytes& datagram) { return device.take(from, datagram, now); }
  std::uint16_t write(std::uint64_t address, std::uint32_t value, const Peer& from = kOwner) {
    last = take(from, commandOf(Command::kWriteRegister, ++number,
                                words({static_cast<std::uint32_t>(address), value})));
    return statusOf(last.answer);
  }
  std::uint16_t write(Item item, std::uint32_t value, const Peer& from = kOwner) {
    return write(rowOf(item).address, value, from);
  }
  /// A register of eight bytes in one command.
  std::uint16_t writeFloat(Item item, double value) {
    Bytes data = words({rowOf(item).address});
    append(data, std::bit_cast<std::uint64_t>(value), 8);
    last = take(kOwner, commandOf(Command::kWriteMemory, ++number, data));
    return statusOf(last.answer);
  }
  std::uint16_t read(std::uint64_t address, const Peer& from = kOwner) {
    last =
        take(from, commandOf(Command::kReadRegister, ++number, words({static_cast<std::uint32_t>(address)})));
    return statusOf(last.answer);
  }
  std::uint32_t value(Item item) {
    EXPECT_EQ(read(rowOf(item).address), Status::kSuccess);
    return static_cast<std::uint32_t>(numberAt(last.answer, 8, 4));
  }
  double real(Item item) {
    last = take(kOwner, commandOf(Command::kReadMemory, ++number, words({rowOf(item).address, 8})));
    EXPECT_EQ(statusOf(last.answer), Status::kSuccess);
    return std::bit_cast<double>(numberAt(last.answer, 12, 8));
  }
  static std::uint16_t statusOf(const Bytes& answer) {
    return answer.size() < 8 ? std::uint16_t{0xFFFF} : static_cast<std::uint16_t>(numberAt(answer, 0, 2));
  }

  Device device;
  Device::Time now{std::chrono::hours{1}};
  std::uint16_t number = 0;
  Device::Outcome last;
};

}  // namespace toftwin::daemon::gige_vision::test
