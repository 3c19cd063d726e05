// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <thread>

#include "usb_device.h"

namespace toftwin::kernel_test {

/// A port of the kernel's virtual USB controller (vhci-hcd) with a device of ours in it. It is
/// plugged in while this object lives. USB/IP over a pair of sockets: no network is used. [Linux
/// kernel, Documentation/usb/usbip_protocol.rst]
class UsbIpPort {
 public:
  /// The controller has eight ports for each speed. Throws if it does not take the device.
  UsbIpPort(int port, std::shared_ptr<UsbDevice> device);
  UsbIpPort(const UsbIpPort&) = delete;
  UsbIpPort& operator=(const UsbIpPort&) = delete;
  ~UsbIpPort();

 private:
  void run(const std::stop_token& stop);
  bool readCommand();
  bool submitted(std::span<const std::uint32_t> words);
  bool unlinked(std::uint32_t number, std::uint32_t wanted);
  bool serveAll();
  bool answer(const Transfer& transfer);
  bool answerControl(std::uint32_t number, const Answer& answer, std::size_t actual);

  std::shared_ptr<UsbDevice> device_;  // the test talks to it too
  int socket_ = -1;
  std::map<std::uint8_t, std::deque<Transfer>> waiting_;  // by endpoint
  std::jthread thread_;
};

}  // namespace toftwin::kernel_test
