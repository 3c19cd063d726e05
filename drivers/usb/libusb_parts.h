// SPDX-License-Identifier: Apache-2.0
#pragma once

// For those who speak to devices by libusb; everybody else needs neither this nor its header.
#include <fmt/format.h>
#include <libusb.h>

#include <array>
#include <cstdint>
#include <string>

namespace toftwin::usb {

/// libusb's own context, so that nobody else's handlers run in our waits.
class Context {
 public:
  Context() { error_ = libusb_init(&context_); }
  ~Context() {
    if (error_ == 0) libusb_exit(context_);
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  [[nodiscard]] int error() const { return error_; }
  [[nodiscard]] libusb_context* get() const { return context_; }

 private:
  libusb_context* context_ = nullptr;
  int error_ = 0;
};

/// As the kernel writes it below /sys.
inline std::string portOf(libusb_device* device) {
  std::array<std::uint8_t, 7> ports{};
  const int count = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  if (count <= 0) return fmt::format("usb{}", libusb_get_bus_number(device));
  std::string port = fmt::format("{}-{}", libusb_get_bus_number(device), ports[0]);
  for (int i = 1; i < count; ++i) port += fmt::format(".{}", ports[static_cast<std::size_t>(i)]);
  return port;
}

}  // namespace toftwin::usb
