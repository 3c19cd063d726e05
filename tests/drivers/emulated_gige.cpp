// SPDX-License-Identifier: Apache-2.0
#include "emulated_gige.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "emulated_gige_wire.h"

namespace toftwin::test {

using namespace gige;

namespace {

int boundSocket(const std::string& address, std::uint16_t port, bool is_shared) {
  const int file = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int yes = 1;
  if (is_shared) ::setsockopt(file, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in own = socketAddress(0, port);
  ::inet_pton(AF_INET, address.c_str(), &own.sin_addr);
  if (::bind(file, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0) return file;
  ::close(file);
  throw std::runtime_error(address + " is taken");
}

}  // namespace

std::string ownLoopbackAddress() {
  const auto pid = static_cast<std::uint32_t>(::getpid());
  return "127." + std::to_string(1 + pid % 199) + "." + std::to_string(pid / 199 % 251) + ".7";
}

// ---- registers ---------------------------------------------------------------------------------

EmulatedGige::EmulatedGige(std::string address, std::string serial, std::string user_name)
    : address_(std::move(address)), serial_(std::move(serial)), user_name_(std::move(user_name)) {
  factorySettings();
  control_ = boundSocket(address_, kPort, false);
  broadcast_ = boundSocket("127.255.255.255", kPort, true);
  stream_ = boundSocket(address_, 0, false);
  thread_ = std::jthread{[this](const std::stop_token& stop) { run(stop); }};
}

EmulatedGige::~EmulatedGige() {
  thread_.request_stop();
  thread_.join();
  for (const int file : {control_, broadcast_, stream_}) ::close(file);
}

void EmulatedGige::factorySettings() {
  registers_.clear();
  in_addr own{};
  ::inet_pton(AF_INET, address_.c_str(), &own);
  registers_ = {{0x0, 0x20000},
                {0x4, 0x80000001},
                {0x8, 0x0211},
                {0xC, ntohl(own.s_addr)},
                {0x24, ntohl(own.s_addr)},
                {0x904, 1},
                {0x934, 0x6},
                {0x938, 3000},
                {0x93C, 0},
                {0x940, 1'000'000'000},
                {0xA00, 0},
                {0xD00, 0},
                {0xD04, 1500},
                {0xD08, 0},
                {0xD18, 0},
                {0xD1C, 0},
                {0xD20, kMultipartBit},
                {0xD24, 0}};
  setText(0x48, "toftwin", 32);
  setText(0x68, "Emulated ToF", 32);
  setText(0x88, "1", 32);
  setText(0xA8, "", 48);
  setText(0xD8, serial_, 16);
  setText(0xE8, user_name_, 16);
  std::array<char, 64> url{};
  std::snprintf(url.data(), url.size(), "Local:tof.xml;%x;%zx", kXmlAddress, description().size());
  setText(0x200, url.data(), 512);
  setText(0x400, "", 512);
  factoryFeatures();
}

void EmulatedGige::reboot() {
  const std::lock_guard lock{mutex_};
  factorySettings();
  controller_port_ = 0;
  sent_.clear();
  frame_id_ = 1;
}

std::optional<std::uint32_t> EmulatedGige::read(std::uint32_t address) const {
  const auto xml = description();
  if (address >= kXmlAddress && address - kXmlAddress < xml.size()) {
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t at = address - kXmlAddress + i;
      word = word << 8U | (at < xml.size() ? static_cast<unsigned char>(xml[at]) : 0U);
    }
    return word;
  }
  if (address == kPayloadReg) return payloadSize();
  if (address == kSourcePort) {
    sockaddr_in own{};
    socklen_t size = sizeof own;
    ::getsockname(stream_, reinterpret_cast<sockaddr*>(&own), &size);
    return ntohs(own.sin_port);
  }
  return EmulatedTof::read(address);
}

void EmulatedGige::write(std::uint32_t address, std::uint32_t value) {
  EmulatedTof::write(address, value);
  if (address == kPacketSize && (value & kTestBit) != 0) {
    registers_[address] = value & ~kTestBit;
    fireTestPacket();
  }
  if (address == kAcquisition && value == 1) sent_.clear();
}

void EmulatedGige::fireTestPacket() {
  const std::uint32_t size = registers_[kPacketSize] & 0xFFFF;
  ++test_packets;
  if (size < 64 || (is_full_size_lost && size > 1500)) return;
  const sockaddr_in to = socketAddress(registers_[kStreamAddress],
                                       static_cast<std::uint16_t>(registers_[kStreamPort]));
  const Bytes packet(size - 28);  // without IP and UDP headers
  ::sendto(stream_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to),
           sizeof to);
}

// ---- control -----------------------------------------------------------------------------------

Bytes EmulatedGige::handle(std::uint16_t command, std::span<const std::byte> data, bool may_write,
                           std::uint16_t& status) {
  Bytes answer;
  const auto at = static_cast<std::uint32_t>(get(data, 0, 4));
  const auto append = [&](std::uint32_t address) {
    const auto value = read(address);
    if (!value) status = kInvalidAddress;
    put(answer, value.value_or(0), 4);
  };
  switch (command) {
    case 0x02:  // discovery
      for (std::uint32_t i = 0; i < 248; i += 4) put(answer, read(i).value_or(0), 4);
      break;
    case 0x80:  // read registers
      for (std::size_t i = 0; i + 4 <= data.size(); i += 4)
        append(static_cast<std::uint32_t>(get(data, i, 4)));
      break;
    case 0x84: {  // read memory
      put(answer, at, 4);
      const auto count = std::min<std::uint64_t>(get(data, 6, 2), 536);
      for (std::uint32_t i = 0; i < count; i += 4) append(at + i);
      break;
    }
    case 0x82:  // write registers
    case 0x86:  // write memory
      if (!may_write) status = kAccessDenied;
      for (std::size_t i = 4; i + 4 <= data.size() && may_write; i += command == 0x82 ? 8 : 4) {
        const std::uint32_t address = command == 0x82
                                          ? static_cast<std::uint32_t>(get(data, i - 4, 4))
                                          : at + static_cast<std::uint32_t>(i - 4);
        if (!read(address)) status = kInvalidAddress;
        if (read(address)) write(address, static_cast<std::uint32_t>(get(data, i, 4)));
      }
      put(answer, command == 0x82 ? 1 : data.size() - 4, 4);
      break;
    default:
      status = kNotImplemented;
  }
  return answer;
}

void EmulatedGige::answer(int socket) {
  std::array<std::byte, 1500> buffer;
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const ssize_t count = ::recvfrom(socket, buffer.data(), buffer.size(), 0,
                                   reinterpret_cast<sockaddr*>(&from), &size);
  if (count < 8 || is_cut) return;
  const std::lock_guard lock{mutex_};
  const auto all = std::span<const std::byte>{buffer}.first(static_cast<std::size_t>(count));
  const auto command = static_cast<std::uint16_t>(get(all, 2, 2));
  const auto data = all.subspan(8);
  if (command == 0x40) return resend(data, (get(all, 1, 1) & 0x10) != 0);
  const std::uint32_t peer = ntohl(from.sin_addr.s_addr);
  const std::uint16_t port = ntohs(from.sin_port);
  const bool is_controller = controller_address_ == peer && controller_port_ == port;
  const bool may_write = !is_other_controller && (controller_port_ == 0 || is_controller);
  if (is_controller) heard_at_ = Clock::now();
  std::uint16_t status = 0;
  const Bytes answer_data = handle(command, data, may_write, status);
  if (may_write && (command == 0x82 || command == 0x86)) {
    const bool has_control = (registers_[kControl] & 3U) != 0;
    controller_address_ = peer;
    controller_port_ = has_control ? port : 0;
    heard_at_ = Clock::now();
  }
  Bytes out;
  put(out, status, 2);
  put(out, command + 1U, 2);
  put(out, answer_data.size(), 2);
  put(out, get(all, 6, 2), 2);
  out.insert(out.end(), answer_data.begin(), answer_data.end());
  ::sendto(control_, out.data(), out.size(), 0, reinterpret_cast<const sockaddr*>(&from), size);
}

void EmulatedGige::resend(std::span<const std::byte> data, bool is_extended) {
  const std::uint64_t id = is_extended ? get(data, 12, 8) : get(data, 2, 2);
  const std::uint64_t first = get(data, 4, 4), last = get(data, 8, 4);
  const auto found = std::ranges::find(sent_, id, &Sent::id);
  if (found == sent_.end()) return;
  for (std::uint64_t i = first; i <= last && i < found->packets.size(); ++i) {
    if (drops_resent) continue;
    ++resent;
    send(found->packets[i], false);
  }
}

void EmulatedGige::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::array<pollfd, 2> files{pollfd{control_, POLLIN, 0}, pollfd{broadcast_, POLLIN, 0}};
    ::poll(files.data(), files.size(), 1);
    for (const pollfd& one : files) {
      if ((one.revents & POLLIN) != 0) answer(one.fd);
    }
    const std::lock_guard lock{mutex_};
    const std::chrono::milliseconds heartbeat{registers_[kHeartbeat]};
    if (controller_port_ != 0 && Clock::now() - heard_at_ > heartbeat) {
      controller_port_ = 0;
      registers_[kControl] = 0;
      registers_[kAcquisition] = 0;
    }
    if (isDue()) sendFrame();
  }
}

}  // namespace toftwin::test
