// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/discovery.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

namespace toftwin::drivers::aravis {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// GigE Vision control protocol: eight bytes of header, then the command's own.
//   command:  0x42, flags, command, length of what follows, number
//   answer:   status,      command, length of what follows, number
constexpr std::uint16_t kPort = 3956;
constexpr std::byte kKey{0x42}, kAnswerWanted{0x01};
constexpr std::uint16_t kDiscover = 0x0002, kDiscovered = 0x0003;
constexpr std::uint16_t kReadRegister = 0x0080, kRegister = 0x0081;
constexpr std::size_t kHeader = 8, kDiscoveryBytes = 248;
constexpr std::uint16_t kRequest = 1;

std::uint32_t numberAt(std::span<const std::byte> bytes, std::size_t at, std::size_t size) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < size; ++i) {
    number = number << 8U | std::to_integer<std::uint32_t>(bytes[at + i]);
  }
  return number;
}

void append(std::vector<std::byte>& bytes, std::uint32_t number, unsigned size) {
  for (unsigned i = size; i-- > 0;) bytes.push_back(static_cast<std::byte>(number >> (8 * i)));
}

std::vector<std::byte> commandOf(std::uint16_t command, std::span<const std::byte> data) {
  std::vector<std::byte> bytes{kKey, kAnswerWanted};
  append(bytes, command, 2);
  append(bytes, static_cast<std::uint32_t>(data.size()), 2);
  append(bytes, kRequest, 2);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

/// What follows the header of such an answer, or nothing.
std::optional<std::span<const std::byte>> answerIn(std::span<const std::byte> datagram,
                                                   std::uint16_t answer, std::uint16_t request) {
  const bool is_it = datagram.size() >= kHeader && numberAt(datagram, 0, 2) == 0 &&
                     numberAt(datagram, 2, 2) == answer && numberAt(datagram, 6, 2) == request;
  if (!is_it) return std::nullopt;
  return datagram.subspan(kHeader);
}

/// Text of at most that many bytes; what could disturb a terminal is left out.
std::string textAt(std::span<const std::byte> bytes, std::size_t at, std::size_t size) {
  std::string text;
  for (std::size_t i = at; i < at + size && bytes[i] != std::byte{0}; ++i) {
    const auto c = std::to_integer<unsigned char>(bytes[i]);
    if (c >= 0x20 && c != 0x7F) text.push_back(static_cast<char>(c));
  }
  while (text.ends_with(' ')) text.pop_back();
  return text;
}

sockaddr_in socketAddress(std::uint32_t address, std::uint16_t port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(port);
  at.sin_addr.s_addr = htonl(address);
  return at;
}

/// A UDP socket of one interface.
class Socket {
 public:
  explicit Socket(std::uint32_t own_address)
      : file_(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
    const int yes = 1;
    const sockaddr_in own = socketAddress(own_address, 0);
    if (file_ >= 0 && (::setsockopt(file_, SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes) != 0 ||
                       ::bind(file_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0)) {
      ::close(std::exchange(file_, -1));
    }
  }
  Socket(Socket&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  Socket& operator=(Socket&&) = delete;
  ~Socket() {
    if (file_ >= 0) ::close(file_);
  }
  [[nodiscard]] int file() const { return file_; }

  void send(std::span<const std::byte> bytes, std::uint32_t address) const {
    const sockaddr_in to = socketAddress(address, kPort);
    // What cannot be sent is not answered.
    static_cast<void>(::sendto(file_, bytes.data(), bytes.size(), MSG_NOSIGNAL,
                               reinterpret_cast<const sockaddr*>(&to), sizeof to));
  }
  /// A datagram and where it is from, if one is there.
  std::optional<std::pair<std::span<const std::byte>, std::uint32_t>> receive() {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t count = ::recvfrom(file_, buffer_.data(), buffer_.size(), 0,
                                     reinterpret_cast<sockaddr*>(&from), &size);
    if (count < 0) return std::nullopt;
    return std::pair{std::span<const std::byte>{buffer_}.first(static_cast<std::size_t>(count)),
                     ntohl(from.sin_addr.s_addr)};
  }

 private:
  int file_;
  std::array<std::byte, 1024> buffer_{};
};

struct Interface {
  std::uint32_t own = 0, broadcast = 0;
  bool is_loopback = false;
};

std::vector<Interface> interfaces() {
  std::vector<Interface> all;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return all;
  for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
    const bool fits = one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET &&
                      one->ifa_netmask != nullptr && (one->ifa_flags & IFF_UP) != 0;
    if (!fits) continue;
    const auto address = [](const sockaddr* of) {
      return ntohl(reinterpret_cast<const sockaddr_in*>(of)->sin_addr.s_addr);
    };
    const std::uint32_t own = address(one->ifa_addr), mask = address(one->ifa_netmask);
    all.push_back({own, own | ~mask, (one->ifa_flags & IFF_LOOPBACK) != 0});
  }
  ::freeifaddrs(list);
  return all;
}

/// Waits for datagrams until that time or until `take` says that it has enough.
template <class Take>
void listen(std::vector<Socket>& sockets, Clock::time_point until, Take take) {
  std::vector<pollfd> files;
  for (const Socket& socket : sockets) files.push_back({socket.file(), POLLIN, 0});
  while (true) {
    const auto left = std::chrono::ceil<milliseconds>(until - Clock::now()).count();
    if (left <= 0) return;
    if (::poll(files.data(), files.size(), static_cast<int>(left)) <= 0) continue;
    for (std::size_t i = 0; i < files.size(); ++i) {
      if (files[i].revents == 0) continue;
      while (const auto datagram = sockets[i].receive()) {
        if (take(datagram->first, datagram->second)) return;
      }
    }
  }
}

/// Sends a command to one camera and gives its answer to `read`, which says whether it is one. A
/// command that is not answered in half of the time is sent once more.
template <class Read>
void ask(std::uint32_t camera, std::span<const std::byte> command, milliseconds wait, Read read) {
  std::vector<Socket> sockets;
  sockets.emplace_back(INADDR_ANY);
  if (sockets.front().file() < 0) return;
  bool is_answered = false;
  for (int attempt = 0; attempt < 2 && !is_answered; ++attempt) {
    sockets.front().send(command, camera);
    listen(sockets, Clock::now() + wait / 2,
           [&](std::span<const std::byte> datagram, std::uint32_t from) {
             is_answered = from == camera && read(datagram);
             return is_answered;
           });
  }
}

}  // namespace

std::string GigeCamera::name() const { return fmt::format("{}-{}-{}", vendor, model, serial); }

bool GigeCamera::isCalled(std::string_view called) const {
  const auto is_same = [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) ==
           std::tolower(static_cast<unsigned char>(b));
  };
  return !called.empty() && (called == textOf(address) || called == serial || called == user_name ||
                             called == name() || std::ranges::equal(called, mac, is_same));
}

std::optional<std::uint32_t> addressOf(const std::string& text) {
  in_addr address{};
  if (::inet_pton(AF_INET, text.c_str(), &address) != 1) return std::nullopt;
  return ntohl(address.s_addr);
}

std::string textOf(std::uint32_t address) {
  return fmt::format("{}.{}.{}.{}", address >> 24U, address >> 16U & 0xFFU, address >> 8U & 0xFFU,
                     address & 0xFFU);
}

std::optional<GigeCamera> readDiscoveryAnswer(std::span<const std::byte> datagram,
                                              std::uint16_t request) {
  const auto data = answerIn(datagram, kDiscovered, request);
  if (!data || data->size() < kDiscoveryBytes) return std::nullopt;
  GigeCamera camera;
  const std::uint32_t high = numberAt(*data, 0x0A, 2), low = numberAt(*data, 0x0C, 4);
  camera.mac = fmt::format("{:02x}:{:02x}:{:02x}:{:02x}:{:02x}:{:02x}", high >> 8U, high & 0xFFU,
                           low >> 24U, low >> 16U & 0xFFU, low >> 8U & 0xFFU, low & 0xFFU);
  camera.address = numberAt(*data, 0x24, 4);
  camera.vendor = textAt(*data, 0x48, 32);
  camera.model = textAt(*data, 0x68, 32);
  camera.serial = textAt(*data, 0xD8, 16);
  camera.user_name = textAt(*data, 0xE8, 16);
  if (camera.serial.empty()) camera.serial = camera.mac;
  return camera;
}

std::vector<GigeCamera> discover(const Discovery& how) {
  constexpr std::uint32_t kEveryone = 0xFFFFFFFF;
  const auto command = commandOf(kDiscover, {});
  std::vector<Socket> sockets;
  const auto own = interfaces();
  for (const Interface& one : own) {
    if (one.is_loopback && !how.on_this_host) continue;
    Socket socket{one.own};
    if (socket.file() < 0) continue;
    socket.send(command, one.broadcast);
    socket.send(command, kEveryone);
    sockets.push_back(std::move(socket));
  }
  std::vector<GigeCamera> found;
  listen(sockets, Clock::now() + how.wait,
         [&](std::span<const std::byte> datagram, std::uint32_t from) {
           auto camera = readDiscoveryAnswer(datagram, kRequest);
           if (!camera) return false;
           camera->address = from;  // this one can be reached, whatever it says
           const bool is_on_this_host = std::ranges::find(own, from, &Interface::own) != own.end();
           if (is_on_this_host && !how.on_this_host) return false;
           const bool is_known = std::ranges::any_of(found, [&](const GigeCamera& other) {
             return other.address == from ||
                    (other.mac == camera->mac && other.name() == camera->name());
           });
           if (is_known) return false;
           found.push_back(*std::move(camera));
           return how.enough && how.enough(found.back());
         });
  return found;
}

bool seesInterfaces() { return !interfaces().empty(); }

std::optional<GigeCamera> discoverAt(std::uint32_t address, milliseconds wait) {
  std::optional<GigeCamera> camera;
  ask(address, commandOf(kDiscover, {}), wait, [&](std::span<const std::byte> datagram) {
    camera = readDiscoveryAnswer(datagram, kRequest);
    if (camera) camera->address = address;
    return camera.has_value();
  });
  return camera;
}

std::optional<std::uint32_t> readRegister(std::uint32_t camera, std::uint32_t address,
                                          milliseconds wait) {
  std::vector<std::byte> data;
  append(data, address, 4);
  std::optional<std::uint32_t> value;
  ask(camera, commandOf(kReadRegister, data), wait, [&](std::span<const std::byte> datagram) {
    const auto answer = answerIn(datagram, kRegister, kRequest);
    if (answer && answer->size() >= 4) value = numberAt(*answer, 0, 4);
    return value.has_value();
  });
  return value;
}

std::optional<std::uint32_t> interfaceTowards(std::uint32_t camera) {
  const int file = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (file < 0) return std::nullopt;
  const sockaddr_in to = socketAddress(camera, kPort);
  sockaddr_in own{};
  socklen_t size = sizeof own;
  // Connecting a UDP socket sends nothing: it asks for the route.
  const bool has_route = ::connect(file, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0 &&
                         ::getsockname(file, reinterpret_cast<sockaddr*>(&own), &size) == 0;
  ::close(file);
  if (!has_route) return std::nullopt;
  return ntohl(own.sin_addr.s_addr);
}

}  // namespace toftwin::drivers::aravis
