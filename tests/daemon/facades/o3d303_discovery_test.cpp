// SPDX-License-Identifier: Apache-2.0
// The vendor's search for cameras, and the warning of a facade that other machines reach.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/ip/udp.hpp>

#include <algorithm>
#include <array>
#include <string>

#include "daemon/facades/ifm/discovery.h"
#include "facade_testing.h"

namespace toftwin::daemon {
namespace {

using namespace std::chrono_literals;
using namespace test;
using boost::asio::ip::address_v4;
using boost::asio::ip::udp;

std::uint64_t bigAt(std::span<const std::byte> bytes, std::size_t at, std::size_t count) {
  std::uint64_t number = 0;
  for (const std::byte one : bytes.subspan(at, count))
    number = number << 8 | std::to_integer<std::uint64_t>(one);
  return number;
}

std::string textAt(std::span<const std::byte> bytes, std::size_t at, std::size_t count) {
  std::string text;
  for (const std::byte one : bytes.subspan(at, count)) text += std::to_integer<char>(one);
  EXPECT_EQ(text.back(), '\0') << "there is at least one zero";
  return text.substr(0, text.find('\0'));
}

/// The fourteen numbers and texts, where the vendor's client looks for them.
TEST(O3d303Discovery, AnAnswerSaysWhereTheCameraIs) {
  const auto bytes = ifm::encode({.address = {192, 168, 0, 69},
                                     .gateway = {192, 168, 0, 201},
                                     .netmask = {255, 255, 255, 0},
                                     .port = 8080,
                                     .mac = {2, 0, 0, 0, 0, 7},
                                     .host_name = std::string(70, 'h'),
                                     .device_name = "dock"});
  ASSERT_EQ(bytes.size(), 360u);
  EXPECT_EQ(bigAt(bytes, 0, 4), 0x1911'1981u);
  EXPECT_EQ(bigAt(bytes, 4, 4), 0xC0A8'0045u);
  EXPECT_EQ(bigAt(bytes, 8, 4), 0xC0A8'00C9u);
  EXPECT_EQ(bigAt(bytes, 12, 4), 0xFFFF'FF00u);
  EXPECT_EQ(bigAt(bytes, 16, 2), 8080u);
  EXPECT_EQ(bigAt(bytes, 18, 2), 310u) << "the vendor";
  EXPECT_EQ(bigAt(bytes, 20, 2), 2u) << "the device";
  EXPECT_EQ(bigAt(bytes, 22, 2), 0u);
  EXPECT_EQ(bigAt(bytes, 24, 8), 0u) << "reserved";
  EXPECT_EQ(bigAt(bytes, 32, 6), 0x0200'0000'0007u);
  EXPECT_EQ(bigAt(bytes, 38, 2), 0u) << "flags";
  EXPECT_EQ(textAt(bytes, 40, 64), std::string(63, 'h'));
  EXPECT_EQ(textAt(bytes, 104, 256), "dock");
}

/// A UDP port that was free just now.
std::uint16_t freeUdpPort() {
  boost::asio::io_context io;
  return udp::socket{io, {address_v4::loopback(), 0}}.local_endpoint().port();
}

class O3d303Search : public RunningFacade {
 protected:
  /// The answer to a search that is sent there; empty if none comes.
  std::vector<std::byte> search(const char* to, std::uint16_t port) {
    boost::asio::io_context io;
    udp::socket socket{io, {address_v4::loopback(), 0}};
    socket.set_option(boost::asio::socket_base::broadcast{true});
    const std::uint16_t own = socket.local_endpoint().port();
    const std::array<std::uint8_t, 8> question{
        0x10, 0x20, 0xEF, 0xCF, static_cast<std::uint8_t>(own >> 8), static_cast<std::uint8_t>(own & 0xFF),
        0,    0};
    std::vector<std::byte> answer(2048);
    std::size_t size = 0;
    EXPECT_TRUE(eventually([&] {  // a datagram may get lost
      socket.send_to(boost::asio::buffer(question), {boost::asio::ip::make_address_v4(to), port});
      socket.async_receive(boost::asio::buffer(answer),
                           [&](boost::system::error_code error, std::size_t got) { size = error ? 0 : got; });
      io.restart();
      io.run_for(500ms);
      socket.cancel();
      io.restart();
      io.run();
      return size > 0;
    })) << to;
    answer.resize(size);
    return answer;
  }
};

TEST_F(O3d303Search, IsAnsweredToOneAddressAndToAll) {
  const std::uint16_t port = freeUdpPort();
  xmlrpc_ = freePort();
  start(
      fmt::format("[[source]]\nname = 'cam'\n{}[[facade]]\nkind = 'o3d303'\nsource = 'cam'\nname = 'dock'\n"
                  "xmlrpc_port = {}\npcic_port = 0\ndiscovery_port = {}\n",
                  kPattern, xmlrpc_, port));
  for (const char* to : {"127.0.0.1", "127.255.255.255"}) {
    const auto answer = search(to, port);
    ASSERT_EQ(answer.size(), 360u) << to;
    EXPECT_EQ(bigAt(answer, 0, 4), 0x1911'1981u);
    EXPECT_EQ(bigAt(answer, 4, 4), 0x7F00'0001u);
    EXPECT_EQ(bigAt(answer, 16, 2), xmlrpc_);
    EXPECT_EQ(textAt(answer, 104, 256), "dock");
  }
}

TEST_F(O3d303Search, AFacadeThatOtherMachinesReachSaysWhatThatMeans) {
  start(
      fmt::format("[[source]]\nname = 'cam'\n{}[[facade]]\nkind = 'o3d303'\nsource = 'cam'\n"
                  "address = '0.0.0.0'\nallow_remote = true\nxmlrpc_port = 0\npcic_port = 0\n"
                  "discoverable = false\n[[facade]]\nkind = 'modbus'\nsource = 'cam'\nport = 0\n",
                  kPattern));
  EXPECT_TRUE(log_->waitFor("facade o3d303 of cam listens on 0.0.0.0, which other machines reach", 1));
  EXPECT_TRUE(log_->waitFor("facade modbus of cam: ", 1));
  EXPECT_EQ(log_->count("which other machines reach"), 1) << "the other is on loopback";
}

}  // namespace
}  // namespace toftwin::daemon
