// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>

#include "daemon/facades/usb_camera/usb_device.h"

namespace toftwin::daemon::usb_camera {

/// A device's end of USB/IP, once it is imported: transfers that the host submits and unlinks, and what
/// becomes of them. Knows no sockets, and takes any bytes. [Linux kernel,
/// Documentation/usb/usbip_protocol.rst]
class Transfers {
 public:
  static constexpr std::size_t kMostWaiting = 1024;          ///< more is an error of the host's
  static constexpr std::size_t kMostBytes = 16U << 20U;      ///< that a host may ask for in one
  static constexpr std::size_t kMostSentBytes = 64U << 10U;  ///< that a host may send in one
  static constexpr std::size_t kMostPackets = 1024;          ///< of an isochronous one

  explicit Transfers(UsbDevice& device) : device_(device) {}

  /// How long the command is that these bytes begin with; nothing: more of them are needed to tell. An error
  /// is what no host says.
  static Result<std::optional<std::size_t>> sizeOf(std::span<const std::byte> bytes);
  /// One whole command.
  Result<> take(std::span<const std::byte> command);
  /// Lets the device do what it can, but while much waits to be written.
  void serve(SteadyTime now);

  /// What is to be written to the host. Whoever writes it takes it out.
  Bytes& output() { return output_; }
  /// Nothing more is to be read before the host has read.
  [[nodiscard]] bool isFull() const { return output_.size() > kMostOutput; }
  /// When to serve() again, for the transfers that wait; the end of time: not before something else happens.
  [[nodiscard]] SteadyTime due() const;

 private:
  static constexpr std::size_t kMostOutput = 1U << 20U;
  struct Control {
    std::uint32_t number = 0;
    bool is_in = false;        ///< what the host expects, whatever the setup packet says
    std::uint32_t length = 0;  ///< most bytes that it takes
    Setup setup;
    Bytes out;
  };
  Result<> submitted(std::span<const std::uint32_t> words, std::span<const std::byte> rest);
  void unlinked(std::uint32_t number, std::uint32_t wanted);
  void serveControl();
  bool serveFirst(std::deque<Transfer>& queue, SteadyTime now);
  void answerControl(const Control& control, const Answer& answer);
  void answer(const Transfer& transfer);

  UsbDevice& device_;
  Bytes output_;
  std::map<std::uint8_t, std::deque<Transfer>> waiting_;  ///< by endpoint
  std::size_t waiting_count_ = 0;
  std::uint8_t served_last_ = 0;  ///< endpoint, after which it is the next one's turn
  std::deque<Control> controls_;  ///< the first may be waiting for the device's late answer
  bool is_late_ = false, is_abandoned_ = false;
};

}  // namespace toftwin::daemon::usb_camera
