// SPDX-License-Identifier: Apache-2.0
#include "usbip_port.h"

#include <endian.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>

namespace toftwin::kernel_test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kSubmitted = 3, kUnlinked = 4;
constexpr std::size_t kHeaderWords = 12;
constexpr std::uint32_t kMostPackets = 1024, kMostBytes = 1U << 24U;
using Header = std::array<std::uint32_t, kHeaderWords>;  // big-endian on the wire

bool readAll(int socket, void* to, std::size_t size) {
  auto* bytes = static_cast<char*>(to);
  while (size > 0) {
    const ssize_t got = ::recv(socket, bytes, size, 0);
    if (got <= 0) return false;
    bytes += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

bool writeAll(int socket, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

void append(Bytes& message, std::span<const std::uint32_t> words) {
  for (const std::uint32_t word : words) {
    const std::uint32_t big = htobe32(word);
    const auto bytes = std::as_bytes(std::span{&big, 1});
    message.insert(message.end(), bytes.begin(), bytes.end());
  }
}

template <std::size_t N>
bool readWords(int socket, std::array<std::uint32_t, N>& words) {
  if (!readAll(socket, words.data(), sizeof words)) return false;
  for (auto& word : words) word = be32toh(word);
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

UsbIpPort::UsbIpPort(int port, std::shared_ptr<UsbDevice> device) : device_(std::move(device)) {
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
    const bool is_asked =
        std::ranges::any_of(waiting_, [](const auto& queue) { return !queue.second.empty(); });
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(device_->due() - Clock::now());
    pollfd file{socket_, POLLIN, 0};
    const int wait =
        is_asked ? static_cast<int>(std::clamp<std::int64_t>(left.count(), 0, 1000)) : 1000;
    if (::poll(&file, 1, wait) > 0 && !readCommand()) return;
    if (!serveAll()) return;
  }
}

bool UsbIpPort::readCommand() {
  Header header{};
  if (!readWords(socket_, header)) return false;
  if (header[0] == kUnlink) return unlinked(header[1], header[5]);
  return header[0] == kSubmit && submitted(header);
}

bool UsbIpPort::submitted(std::span<const std::uint32_t> words) {
  Transfer transfer;
  transfer.number = words[1];
  const bool is_in = words[3] == 1;
  transfer.endpoint = static_cast<std::uint8_t>(words[4] | (is_in ? 0x80U : 0U));
  transfer.length = words[6];
  if (transfer.length > kMostBytes) return false;
  if (!is_in) {
    transfer.data.resize(transfer.length);
    if (!readAll(socket_, transfer.data.data(), transfer.data.size())) return false;
  }
  if (words[8] <= kMostPackets) {
    for (std::uint32_t i = 0; i < words[8]; ++i) {
      std::array<std::uint32_t, 4> packet{};
      if (!readWords(socket_, packet)) return false;
      transfer.packets.push_back({.offset = packet[0], .length = packet[1]});
    }
  }
  if (words[4] != 0) {
    waiting_[transfer.endpoint].push_back(std::move(transfer));
    return true;
  }
  // The setup packet is bytes, not words.
  std::array<std::uint32_t, 2> big{htobe32(words[10]), htobe32(words[11])};
  std::array<std::uint8_t, 8> raw{};
  std::memcpy(raw.data(), big.data(), raw.size());
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint16_t>(raw.at(at) | raw.at(at + 1) << 8U);
  };
  const Setup setup{raw[0], raw[1], word(2), word(4), word(6)};
  const Answer answer = controlOf(*device_, setup, transfer.data);
  // Of what came in, all was taken.
  return answerControl(transfer.number, answer,
                       is_in                ? answer.data.size()
                       : answer.status == 0 ? transfer.data.size()
                                            : 0);
}

bool UsbIpPort::unlinked(std::uint32_t number, std::uint32_t wanted) {
  bool was_waiting = false;
  for (auto& [endpoint, queue] : waiting_) {
    was_waiting =
        std::erase_if(queue, [&](const Transfer& one) { return one.number == wanted; }) > 0 ||
        was_waiting;
  }
  Header header{kUnlinked, number};
  header[5] = static_cast<std::uint32_t>(was_waiting ? -ECONNRESET : 0);
  Bytes message;
  append(message, header);
  return writeAll(socket_, message);
}

bool UsbIpPort::serveAll() {
  const SteadyTime now = Clock::now();
  for (auto& [endpoint, queue] : waiting_) {
    while (!queue.empty() && device_->serve(queue.front(), now)) {
      const Transfer done = std::move(queue.front());
      queue.pop_front();
      if (!answer(done)) return false;
    }
  }
  return true;
}

bool UsbIpPort::answerControl(std::uint32_t number, const Answer& answer, std::size_t actual) {
  Header header{kSubmitted, number};
  header[5] = static_cast<std::uint32_t>(answer.status);
  header[6] = static_cast<std::uint32_t>(actual);
  Bytes message;
  append(message, header);
  message.insert(message.end(), answer.data.begin(), answer.data.end());
  return writeAll(socket_, message);
}

bool UsbIpPort::answer(const Transfer& transfer) {
  Header header{kSubmitted, transfer.number};
  header[5] = static_cast<std::uint32_t>(transfer.status);
  header[6] = static_cast<std::uint32_t>(transfer.data.size());
  header[8] = static_cast<std::uint32_t>(transfer.packets.size());
  Bytes message;
  append(message, header);
  if (transfer.isIn()) message.insert(message.end(), transfer.data.begin(), transfer.data.end());
  for (const auto& packet : transfer.packets) {
    append(message, std::array{packet.offset, packet.length, packet.actual,
                               static_cast<std::uint32_t>(packet.status)});
  }
  return writeAll(socket_, message);
}

}  // namespace toftwin::kernel_test
