// SPDX-License-Identifier: Apache-2.0
// The GigE Vision facade in a running daemon, spoken to by datagrams.
#include <gtest/gtest.h>

#include <boost/asio/ip/udp.hpp>
#include <poll.h>

#include <new>

#include "daemon/facades/gige_vision/control_sockets.h"
#include "gige_vision_commands.h"
#include "gige_vision_testing.h"

namespace toftwin::daemon {
namespace {

using namespace toftwin::daemon::test;
using namespace gige_vision;
using boost::asio::ip::udp;
using gige_vision::test::commandOf;
using gige_vision::test::words;

class GigeVisionWire : public RunningGigeVision {
 protected:
  /// A socket of that address of this machine.
  udp::socket socketOn(const std::string& address) {
    return udp::socket{io_, {boost::asio::ip::make_address_v4(address), 0}};
  }
  void say(udp::socket& socket, const Bytes& bytes) {
    socket.send_to(boost::asio::buffer(bytes), {boost::asio::ip::make_address_v4(address_), 3956});
  }
  /// The next datagram; nothing if none comes within `most_ms`.
  static Bytes hear(udp::socket& socket, int most_ms = 20'000) {
    pollfd file{socket.native_handle(), POLLIN, 0};
    if (::poll(&file, 1, most_ms) < 1) return {};
    Bytes bytes(70'000);
    bytes.resize(socket.receive(boost::asio::buffer(bytes)));
    return bytes;
  }
  std::uint16_t write(udp::socket& socket, Item item, std::uint32_t value) {
    say(socket, commandOf(Command::kWriteRegister, ++number_, words({rowOf(item).address, value})));
    const Bytes answer = hear(socket);
    return answer.size() < 8 ? std::uint16_t{0xFFFF} : static_cast<std::uint16_t>(numberAt(answer, 0, 2));
  }
  boost::asio::io_context io_;
  std::uint16_t number_ = 0;
};

TEST_F(GigeVisionWire, AnnouncesAnAnswerThatWaitsToWhoWantsThat) {
  startGige(kSmallSim);
  udp::socket control = socketOn("127.0.0.1");
  EXPECT_EQ(write(control, Item::ControlPrivilege, 2), Status::kSuccess);
  EXPECT_EQ(write(control, Item::ControlConfiguration, 2), Status::kSuccess);
  Bytes data = words({rowOf(Item::ExposureTime).address});
  append(data, std::bit_cast<std::uint64_t>(450.0), 8);
  say(control, commandOf(Command::kWriteMemory, 900, data));
  const Bytes pending = hear(control), answer = hear(control);
  ASSERT_EQ(pending.size(), 12U);
  EXPECT_EQ(numberAt(pending, 0, 8), 0x0000'0089'0004'0384U);  // of command 900
  ASSERT_EQ(answer.size(), 12U);
  EXPECT_EQ(numberAt(answer, 0, 8), 0x0000'0087'0004'0384U);
  auto native = client();
  const auto source = native.describe("cam");
  ASSERT_TRUE(source.ok()) << source.error().message;
  const auto exposure = std::ranges::find(source->parameters, "exposure_us", &Parameter::name);
  ASSERT_NE(exposure, source->parameters.end());
  EXPECT_EQ(exposure->value, 450.0);
  // What the source refuses is refused: its own bound may be narrower than what the register said.
  EXPECT_EQ(write(control, Item::TriggerSoftware, 1), Status::kBusy);  // it is not triggered
}

TEST_F(GigeVisionWire, GivesNoFrameToAnAddressThatDoesNotControlIt) {
  startGige(kSmallSim);
  udp::socket control = socketOn("127.0.0.1"), victim = socketOn("127.0.0.2"), stream = socketOn("127.0.0.1");
  EXPECT_EQ(write(control, Item::ControlPrivilege, 2), Status::kSuccess);
  EXPECT_EQ(write(control, Item::Destination, 0x7F000002), Status::kAccessDenied);
  const std::uint16_t port = victim.local_endpoint().port();
  // No address is not this computer, whose services trust what comes from it.
  udp::socket own{io_, {boost::asio::ip::make_address_v4(address_), port}};
  EXPECT_EQ(write(control, Item::HostPort, port), Status::kSuccess);
  EXPECT_EQ(write(control, Item::AcquisitionStart, 1), Status::kSuccess);
  EXPECT_EQ(write(control, Item::PacketSize, 0x8000'0000U | 1500), Status::kSuccess);  // a test packet
  udp::socket other = socketOn("127.0.0.2");
  EXPECT_EQ(write(other, Item::Destination, 0x7F000002), Status::kAccessDenied);
  EXPECT_EQ(write(control, Item::Destination, 0x7F000001), Status::kSuccess);
  EXPECT_EQ(write(control, Item::HostPort, stream.local_endpoint().port()), Status::kSuccess);
  EXPECT_FALSE(hear(stream).empty());  // so there were frames all the time
  EXPECT_TRUE(hear(victim, 0).empty());
  EXPECT_TRUE(hear(own, 0).empty());
}

TEST_F(GigeVisionWire, StopsByItselfAfterAsManyFramesAsWereWanted) {
  startGige(kSmallSim);
  udp::socket control = socketOn("127.0.0.1"), stream = socketOn("127.0.0.1");
  EXPECT_EQ(write(control, Item::ControlPrivilege, 2), Status::kSuccess);
  EXPECT_EQ(write(control, Item::Destination, 0x7F000001), Status::kSuccess);
  EXPECT_EQ(write(control, Item::HostPort, stream.local_endpoint().port()), Status::kSuccess);
  EXPECT_EQ(write(control, Item::PacketSize, 9000), Status::kSuccess);
  EXPECT_EQ(write(control, Item::AcquisitionMode, 2), Status::kSuccess);
  EXPECT_EQ(write(control, Item::AcquisitionFrameCount, 3), Status::kSuccess);
  EXPECT_EQ(write(control, Item::AcquisitionStart, 1), Status::kSuccess);
  int trailers = 0;
  while (trailers < 3) {
    const Bytes packet = hear(stream);
    ASSERT_GE(packet.size(), 8U);
    trailers += numberAt(packet, 4, 1) == 2 ? 1 : 0;
  }
  // The next would have come after 50 ms; the camera can be set again, which it cannot be while it sends.
  EXPECT_EQ(write(control, Item::AcquisitionFrameCount, 1), Status::kSuccess);
  EXPECT_TRUE(hear(stream, 200).empty());
}

TEST_F(GigeVisionWire, FramesThatAreLostForWantOfTimeAreNotAmongThoseThatWereWanted) {
  startGige(kSmallSim);
  udp::socket control = socketOn("127.0.0.1"), stream = socketOn("127.0.0.1");
  EXPECT_EQ(write(control, Item::ControlPrivilege, 2), Status::kSuccess);
  EXPECT_EQ(write(control, Item::Destination, 0x7F000001), Status::kSuccess);
  EXPECT_EQ(write(control, Item::HostPort, stream.local_endpoint().port()), Status::kSuccess);
  EXPECT_EQ(write(control, Item::HeartbeatTimeout, 60'000), Status::kSuccess);
  // 46 kB in 85 packets a millisecond apart, of images that come every 50 ms; three wait at most.
  EXPECT_EQ(write(control, Item::PacketSize, 576), Status::kSuccess);
  EXPECT_EQ(write(control, Item::PacketDelay, 1'000'000), Status::kSuccess);
  EXPECT_EQ(write(control, Item::AcquisitionMode, 2), Status::kSuccess);
  EXPECT_EQ(write(control, Item::AcquisitionFrameCount, 12), Status::kSuccess);
  EXPECT_EQ(write(control, Item::AcquisitionStart, 1), Status::kSuccess);
  int trailers = 0;
  std::uint64_t last_id = 0;
  while (trailers < 12) {
    const Bytes packet = hear(stream);
    ASSERT_GE(packet.size(), 8U);
    if (numberAt(packet, 4, 1) != 2) continue;
    ++trailers;
    last_id = numberAt(packet, 2, 2);
  }
  EXPECT_GT(last_id, 12U);  // some were lost
}

TEST_F(GigeVisionWire, SendsPacketsAgainAndSaysWhichItHasNotAnyMore) {
  startGige(kSmallSim);
  udp::socket control = socketOn("127.0.0.1"), stream = socketOn("127.0.0.1");
  EXPECT_EQ(write(control, Item::ControlPrivilege, 2), Status::kSuccess);
  EXPECT_EQ(write(control, Item::Destination, 0x7F000001), Status::kSuccess);
  EXPECT_EQ(write(control, Item::HostPort, stream.local_endpoint().port()), Status::kSuccess);
  EXPECT_EQ(write(control, Item::AcquisitionMode, 1), Status::kSuccess);
  EXPECT_EQ(write(control, Item::PacketDelay, 1'000'000), Status::kSuccess);
  EXPECT_EQ(write(control, Item::AcquisitionStart, 1), Status::kSuccess);
  EXPECT_GT(hear(stream).size(), 8U);  // the leader; the frame goes on although commands come
  EXPECT_EQ(write(control, Item::AcquisitionStop, 1), Status::kSuccess);
  std::map<std::uint64_t, Bytes> first;  // by number
  for (Bytes packet = hear(stream); packet.size() >= 8; packet = hear(stream)) {
    first[numberAt(packet, 5, 3)] = packet;
    if (numberAt(packet, 4, 1) == 2) break;
  }
  ASSERT_GT(first.size(), 5U);
  // Nobody else's wish brings packets there: the next are those that the controller asks for.
  udp::socket other = socketOn("127.0.0.2");
  say(other, commandOf(Command::kPacketResend, 69, words({1, 1, 5}), 0));
  say(control, commandOf(Command::kPacketResend, 70, words({1, 2, 4}), 0));
  for (std::uint64_t i = 2; i <= 4; ++i) {
    const Bytes again = hear(stream);
    ASSERT_GE(again.size(), 8U);
    EXPECT_EQ(numberAt(again, 5, 3), i);
    EXPECT_EQ(numberAt(again, 0, 2), Status::kPacketResent);
    EXPECT_TRUE(std::equal(again.begin() + 2, again.end(), first[i].begin() + 2, first[i].end()));
  }
  say(control, commandOf(Command::kPacketResend, 71, words({99, 2, 3}), 0));  // block 99
  for (std::uint64_t i = 2; i <= 3; ++i) {
    const Bytes none = hear(stream);
    ASSERT_EQ(none.size(), 8U);
    EXPECT_EQ(numberAt(none, 0, 2), Status::kPacketUnavailable);
    EXPECT_EQ(numberAt(none, 5, 3), i);
  }
}

TEST(GigeVisionControl, HearsBroadcastsOfItsOwnInterfaceAlone) {
  boost::asio::io_context io;
  const auto place = localPlace("127.0.0.77");
  ASSERT_TRUE(place.ok());
  const auto sockets = ControlSockets::open(io, *place, [](const Peer&, std::span<const std::byte>) {});
  ASSERT_TRUE(sockets.ok()) << sockets.error().message;
  EXPECT_TRUE((*sockets)->hearsBroadcasts());
  int ears = 0;
  for (int file = 0; file < 1024; ++file) {
    sockaddr_in bound{};
    socklen_t size = sizeof bound;
    if (::getsockname(file, reinterpret_cast<sockaddr*>(&bound), &size) != 0 || bound.sin_family != AF_INET ||
        ntohs(bound.sin_port) != kControlPort || ntohl(bound.sin_addr.s_addr) == place->address.to_uint())
      continue;
    ++ears;
    std::array<char, 64> name{};
    size = name.size();
    EXPECT_EQ(::getsockopt(file, SOL_SOCKET, SO_BINDTODEVICE, name.data(), &size), 0);
    EXPECT_EQ(name.data(), place->interface_name);
    EXPECT_STRNE(name.data(), "");
  }
  EXPECT_EQ(ears, 2);
}

TEST(GigeVisionControl, HearsTheNextCommandAfterOneThatFailed) {
  boost::asio::io_context io;
  const auto pid = static_cast<unsigned>(::getpid());
  const std::string address = fmt::format("127.{}.{}.8", 1 + pid % 199, pid / 199 % 251);
  const auto place = localPlace(address);
  ASSERT_TRUE(place.ok());
  int heard = 0;
  const auto sockets = ControlSockets::open(io, *place, [&](const Peer&, std::span<const std::byte>) {
    if (++heard == 1) throw std::bad_alloc{};
    io.stop();
  });
  ASSERT_TRUE(sockets.ok()) << sockets.error().message;
  udp::socket client{io, {boost::asio::ip::make_address_v4("127.0.0.1"), 0}};
  const Bytes search = commandOf(Command::kDiscovery, 1, {});
  const udp::endpoint to{boost::asio::ip::make_address_v4(address), kControlPort};
  client.send_to(boost::asio::buffer(search), to);
  EXPECT_THROW(io.run_for(kSoon), std::bad_alloc);
  client.send_to(boost::asio::buffer(search), to);
  io.run_for(kSoon);
  EXPECT_EQ(heard, 2);
}

}  // namespace
}  // namespace toftwin::daemon
