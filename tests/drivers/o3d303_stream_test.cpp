// SPDX-License-Identifier: Apache-2.0
// The bytes of a PCIC connection, and when they came.
#include <gtest/gtest.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <future>
#include <string>
#include <thread>

#include "drivers/o3d303/pcic_stream.h"

namespace toftwin::drivers::o3d303 {
namespace {

using boost::asio::ip::tcp;
using Clock = std::chrono::steady_clock;
using toftwin::o3d303::Bytes;
using toftwin::o3d303::encodePcic;

/// Takes one connection, says yes to its schema, and then sends what it is given.
class Camera {
 public:
  [[nodiscard]] Endpoint endpoint() const { return acceptor_.local_endpoint(); }
  void acceptAndAgree() {
    acceptor_.accept(socket_);
    std::array<char, 4096> command;
    socket_.read_some(boost::asio::buffer(command));
    const Bytes yes = encodePcic("1000", "*");
    boost::asio::write(socket_, boost::asio::buffer(yes));
  }
  void send(std::span<const std::byte> bytes) {
    boost::asio::write(socket_, boost::asio::buffer(bytes.data(), bytes.size()));
  }

 private:
  boost::asio::io_context io_;
  tcp::acceptor acceptor_{io_, tcp::endpoint{boost::asio::ip::address_v4::loopback(), 0}};
  tcp::socket socket_{io_};
};

// A reader that is behind never comes to the end of a message with nothing of the next one there.
TEST(PcicStream, AMessageArrivedWhenItsOwnFirstBytesWereReadAlsoIfOthersCameBeforeThem) {
  Camera camera;
  std::jthread agreeing{[&] { camera.acceptAndAgree(); }};
  EventLoop loop;
  PcicStream stream{loop};
  const auto opened = stream.open(camera.endpoint(), {});
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  agreeing.join();

  const Bytes one = encodePcic("0000", std::string(1000, 'x'));
  const std::span all{one};
  const auto half = all.first(all.size() / 2), rest = all.subspan(all.size() / 2);
  const auto whole_and_half = [&](std::span<const std::byte> begin) {
    Bytes bytes{begin.begin(), begin.end()};
    bytes.insert(bytes.end(), half.begin(), half.end());
    camera.send(bytes);
  };
  const auto next = [&] { return stream.next(Clock::now() + std::chrono::seconds{10}, {}); };
  whole_and_half(all);
  const auto first = next();
  ASSERT_TRUE(first.ok()) << first.error().message;
  const auto before_second = Clock::now();
  whole_and_half(rest);
  const auto second = next();
  ASSERT_TRUE(second.ok()) << second.error().message;
  camera.send(rest);
  const auto third = next();
  ASSERT_TRUE(third.ok()) << third.error().message;
  EXPECT_LE(first->arrived, before_second);
  EXPECT_GE(third->arrived, before_second) << "its first bytes were sent after that";
}

}  // namespace
}  // namespace toftwin::drivers::o3d303
