// SPDX-License-Identifier: Apache-2.0
#include "usbip_port.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>

namespace toftwin::kernel_test {
namespace {

using daemon::usb_camera::Bytes;
using daemon::usb_camera::Transfers;
using daemon::usb_camera::UsbDevice;
using daemon::usb_camera::UsbSpeed;
using Clock = std::chrono::steady_clock;

bool readAll(int socket, Bytes& to, std::size_t size) {
  std::size_t have = to.size();
  to.resize(have + size);
  while (have < to.size()) {
    const ssize_t got = ::recv(socket, to.data() + have, to.size() - have, 0);
    if (got <= 0) return false;
    have += static_cast<std::size_t>(got);
  }
  return true;
}

/// The port of the device that was there before becomes free a little after it was pulled.
void attach(int port, int socket, UsbSpeed speed) {
  constexpr int kDevice = 0x10002;  // "bus 1, device 2" at the far end; any will do
  const std::string wish = std::to_string(port) + " " + std::to_string(socket) + " " +
                           std::to_string(kDevice) + " " + std::to_string(static_cast<int>(speed));
  for (int tries = 0; tries < 200; ++tries) {
    std::ofstream file{"/sys/devices/platform/vhci_hcd.0/attach"};
    if (file << wish << std::flush) return;
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
  }
  throw std::runtime_error{"vhci-hcd takes no device at port " + std::to_string(port)};
}

}  // namespace

UsbIpPort::UsbIpPort(int port, std::shared_ptr<UsbDevice> device)
    : device_(std::move(device)), transfers_(*device_) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw std::runtime_error{"no pair of sockets"};
  }
  socket_ = ends[0];
  constexpr int kSuperPorts = 8;  // follow those of high speed
  attach(port + (device_->speed() == UsbSpeed::Super ? kSuperPorts : 0), ends[1], device_->speed());
  ::close(ends[1]);  // the kernel has it
  thread_ = std::jthread{[this](const std::stop_token& stop) { run(stop); }};
}

UsbIpPort::~UsbIpPort() {
  thread_.request_stop();
  ::shutdown(socket_, SHUT_RDWR);
  if (thread_.joinable()) thread_.join();
  ::close(socket_);
}

void UsbIpPort::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    constexpr std::chrono::milliseconds kLongest{1000};
    const auto now = Clock::now();
    const auto due = std::min(transfers_.due(), now + kLongest);
    const std::int64_t wait_ms =
        std::max<std::int64_t>(std::chrono::ceil<std::chrono::milliseconds>(due - now).count(), 0);
    pollfd file{socket_, POLLIN, 0};
    if (::poll(&file, 1, static_cast<int>(wait_ms)) > 0 && !readCommand()) return;
    transfers_.serve(Clock::now());
    if (!write()) return;
  }
}

bool UsbIpPort::readCommand() {
  Bytes command;
  if (!readAll(socket_, command, 48)) return false;
  const auto size = Transfers::sizeOf(command);
  return size && *size && readAll(socket_, command, **size - command.size()) && transfers_.take(command);
}

bool UsbIpPort::write() {
  const Bytes bytes = std::exchange(transfers_.output(), {});
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t some = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (some <= 0) return false;
    sent += static_cast<std::size_t>(some);
  }
  return true;
}

}  // namespace toftwin::kernel_test
