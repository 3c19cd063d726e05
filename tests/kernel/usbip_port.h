// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <thread>

#include "daemon/facades/usb_camera/transfers.h"

namespace toftwin::kernel_test {

/// A port of the kernel's virtual USB controller (vhci-hcd) with a device of ours in it. It is plugged in
/// while this object lives. USB/IP over a pair of sockets, with the facade's code: no network is used.
class UsbIpPort {
 public:
  /// The controller has eight ports for each speed. Throws if it does not take the device.
  UsbIpPort(int port, std::shared_ptr<daemon::usb_camera::UsbDevice> device);
  UsbIpPort(const UsbIpPort&) = delete;
  UsbIpPort& operator=(const UsbIpPort&) = delete;
  ~UsbIpPort();

 private:
  void run(const std::stop_token& stop);
  bool readCommand();
  bool write();

  std::shared_ptr<daemon::usb_camera::UsbDevice> device_;  // the test talks to it too
  daemon::usb_camera::Transfers transfers_;
  int socket_ = -1;
  std::jthread thread_;
};

}  // namespace toftwin::kernel_test
