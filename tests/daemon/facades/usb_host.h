// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "daemon/facades/usb_camera/big_endian.h"
#include "protocol/transport/memfd.h"

namespace toftwin::daemon::test {

/// A host of USB/IP that says what the test wants.
class UsbHost {
 public:
  using Bytes = usb_camera::Bytes;
  struct Reply {
    std::uint32_t command = 0, number = 0;
    int status = 0;
    Bytes data;
  };
  static constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kIn = 1;

  explicit UsbHost(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  }

  void send(const Bytes& bytes) {
    EXPECT_EQ(::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  /// Nothing: the facade has closed.
  std::optional<Bytes> receive(std::size_t size) {
    Bytes bytes(size);
    if (size == 0) return bytes;
    const auto got = ::recv(socket_.get(), bytes.data(), size, MSG_WAITALL);
    return got == static_cast<ssize_t>(size) ? std::optional{bytes} : std::nullopt;
  }

  /// How many devices there are; 999: no answer.
  std::uint32_t list() {
    Bytes request;
    for (const std::uint32_t half : {0x0111U, 0x8005U, 0U, 0U}) usb_camera::appendBig16(request, half);
    send(request);
    const auto answer = receive(12);
    return answer ? usb_camera::big32At(*answer, 8) : 999;
  }
  /// The status of the answer; 0: it has the device.
  std::uint32_t import() {
    Bytes request;
    for (const std::uint32_t half : {0x0111U, 0x8003U, 0U, 0U}) usb_camera::appendBig16(request, half);
    for (const char c : std::string{"1-1"}) request.push_back(static_cast<std::byte>(c));
    request.resize(40);
    send(request);
    const auto answer = receive(8);
    const std::uint32_t status = answer ? usb_camera::big32At(*answer, 4) : 999;
    if (status == 0) receive(312);
    return status;
  }

  void command(std::uint32_t what, std::uint32_t number, std::uint32_t direction, std::uint32_t endpoint,
               std::uint32_t length, std::array<std::uint8_t, 8> setup = {}, const Bytes& out = {},
               std::uint32_t packets = 0) {
    Bytes bytes;
    for (const std::uint32_t word :
         {what, number, 0x10002U, direction, endpoint, what == kUnlink ? length : 0U,
          what == kUnlink ? 0U : length, 0U, packets, 0U})
      usb_camera::appendBig32(bytes, word);
    for (const std::uint8_t byte : setup) bytes.push_back(std::byte{byte});
    bytes.insert(bytes.end(), out.begin(), out.end());
    send(bytes);
  }
  std::optional<Reply> reply() {
    const auto header = receive(48);
    if (!header) return std::nullopt;
    const auto word = [&](std::size_t i) { return usb_camera::big32At(*header, 4 * i); };
    Reply reply{word(0), word(1), static_cast<int>(word(5)), {}};
    const bool has_data = reply.command == 3 && !is_out_;
    if (has_data) reply.data = receive(word(6)).value_or(Bytes{});
    return reply;
  }

  /// A class request to `index` and its reply. Bytes make it a SET, a length a GET.
  Reply set(std::uint8_t request, unsigned selector, unsigned index, const Bytes& out) {
    is_out_ = true;
    command(kSubmit, ++number_, 0, 0, static_cast<std::uint32_t>(out.size()),
            setupOf(0x21, request, selector, index, out.size()), out);
    const auto got = reply();
    is_out_ = false;
    return got.value_or(Reply{});
  }
  Reply get(std::uint8_t request, unsigned selector, unsigned index, std::size_t length) {
    command(kSubmit, ++number_, kIn, 0, static_cast<std::uint32_t>(length),
            setupOf(0xA1, request, selector, index, length));
    return reply().value_or(Reply{});
  }
  /// Asks for bytes of an endpoint; the reply comes when there are some.
  std::uint32_t ask(std::uint32_t endpoint, std::uint32_t length) {
    command(kSubmit, ++number_, kIn, endpoint, length);
    return number_;
  }

 private:
  static std::array<std::uint8_t, 8> setupOf(std::uint8_t type, std::uint8_t request, unsigned selector,
                                             unsigned index, std::size_t length) {
    return {type,
            request,
            0,
            static_cast<std::uint8_t>(selector),
            static_cast<std::uint8_t>(index),
            static_cast<std::uint8_t>(index >> 8U),
            static_cast<std::uint8_t>(length),
            static_cast<std::uint8_t>(length >> 8U)};
  }
  transport::FileDescriptor socket_;
  std::uint32_t number_ = 0;
  bool is_out_ = false;  ///< what is waited for has no data
};

}  // namespace toftwin::daemon::test
