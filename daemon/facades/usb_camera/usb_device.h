// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

/// USB devices that are programs: whatever class they are of, a kernel's own drivers see them over USB/IP as
/// if they were plugged in.
namespace toftwin::daemon::usb_camera {

using SteadyTime = std::chrono::steady_clock::time_point;
using Bytes = std::vector<std::byte>;

/// The first packet of a control transfer. [USB 2.0, table 9-2]
struct Setup {
  std::uint8_t type = 0, request = 0;
  std::uint16_t value = 0, index = 0, length = 0;
  [[nodiscard]] bool isIn() const { return (type & 0x80U) != 0; }
};

/// What a device answers; a negative errno is a stall (-EPIPE) or worse.
struct Answer {
  int status = 0;
  Bytes data{};
  bool comes_later = false;  ///< the host waits until UsbDevice::lateAnswer() has it
};
Answer stall();

/// A transfer on an endpoint other than 0 that the host waits for.
struct Transfer {
  struct Packet {
    std::uint32_t offset = 0, length = 0, actual = 0;
    int status = 0;
  };
  std::uint32_t number = 0;
  std::uint8_t endpoint = 0;    ///< with the direction bit
  std::uint32_t length = 0;     ///< most bytes that the host takes
  Bytes data;                   ///< of an OUT transfer; to be filled for an IN transfer, without gaps
  std::vector<Packet> packets;  ///< of an isochronous one
  int status = 0;
  [[nodiscard]] bool isIn() const { return (endpoint & 0x80U) != 0; }
};

enum class UsbSpeed { High = 3, Super = 5 };  // the numbers of the kernel and of USB/IP

/// A device. One thread makes all calls.
class UsbDevice {
 public:
  virtual ~UsbDevice() = default;

  [[nodiscard]] virtual UsbSpeed speed() const { return UsbSpeed::High; }
  [[nodiscard]] virtual Bytes deviceDescriptor() const = 0;
  [[nodiscard]] virtual Bytes configurationDescriptor() const = 0;
  /// Empty if there is no such string; they count from 1. ASCII.
  [[nodiscard]] virtual std::string text(int index) const = 0;

  /// Class and vendor requests on endpoint 0; `out` are the bytes that came along.
  virtual Answer control(const Setup& setup, std::span<const std::byte> out) = 0;
  /// Of the one request whose answer comes later, once it has come.
  virtual std::optional<Answer> lateAnswer() { return std::nullopt; }
  /// A host has it from now on; what was before is forgotten.
  virtual void onAttach() {}
  virtual void onInterface(int /*number*/, int /*alternate*/) {}
  /// Of interface 0's function. [USB 3.1, 9.4.9]
  virtual void onFunctionSuspend(bool /*is_suspended*/) {}
  virtual void onClearHalt(std::uint8_t /*endpoint*/) {}

  /// Does the transfer that is first in its endpoint's queue if that can be done now.
  virtual bool serve(Transfer& transfer, SteadyTime now) = 0;
  /// When to ask serve() again for that endpoint, of which a transfer waits.
  [[nodiscard]] virtual SteadyTime due(std::uint8_t endpoint) const = 0;
};

/// Any request on endpoint 0: the standard ones are answered from the descriptors.
Answer controlOf(UsbDevice& device, const Setup& setup, std::span<const std::byte> out);

/// Builds descriptors, little-endian.
class Writer {
 public:
  Writer& u8(unsigned value);
  Writer& u16(unsigned value);
  Writer& u32(std::uint32_t value);
  Writer& bytes(std::span<const std::byte> all);
  [[nodiscard]] Bytes done() const { return bytes_; }

 private:
  Bytes bytes_;
};

}  // namespace toftwin::daemon::usb_camera
