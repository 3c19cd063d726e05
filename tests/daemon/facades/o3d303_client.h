// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "drivers/o3d303/wire/frame_content.h"
#include "drivers/o3d303/wire/pcic.h"
#include "drivers/o3d303/wire/schema.h"
#include "drivers/o3d303/wire/xmlrpc.h"

/// A client of an O3D303 that says what the test wants. Blocking; the test's time limit is its patience.
namespace toftwin::daemon::test {

using RpcParams = std::vector<o3d303::XmlRpcValue>;

/// Bytes to the XML-RPC port.
class RawHttp {
 public:
  explicit RawHttp(std::uint16_t port);
  void send(std::string_view bytes);
  /// Until the other side closes.
  std::string receiveAll();

 private:
  boost::asio::io_context io_;
  boost::asio::ip::tcp::socket socket_{io_};
};

class O3d303Client {
 public:
  static constexpr const char* kSession = "0123456789abcdef0123456789abcdef";
  explicit O3d303Client(std::uint16_t xmlrpc) : xmlrpc_(xmlrpc) {}

  /// Fails the test on a fault.
  o3d303::XmlRpcValue call(const std::string& object, const std::string& method, RpcParams params);
  /// The fault's code, 0 if there is none.
  int fault(const std::string& object, const std::string& method, RpcParams params);
  /// Whether there was an answer.
  bool tryCall(const std::string& object, const std::string& method, RpcParams params);
  std::uint16_t pcicPort();

  [[nodiscard]] std::string session(const std::string& object) const {
    return "session_" + std::string{kSession} + "/" + object;
  }
  [[nodiscard]] std::string imager() const { return session("edit/application/imager_001/"); }
  void beginSession();
  void edit();
  void endSession();

 private:
  o3d303::XmlRpcAnswer ask(const std::string& object, const std::string& method, RpcParams params);
  std::uint16_t xmlrpc_;
};

class PcicClient {
 public:
  explicit PcicClient(std::uint16_t port);
  void sendBytes(std::string_view bytes);
  /// The answer; what else comes meanwhile is kept.
  std::string command(std::string_view command);
  std::string setSchema(const std::vector<std::string_view>& blobs);
  /// The content of the next message with that ticket.
  std::string nextOf(std::string_view ticket);
  /// The next frame, whose bytes stay until the next call.
  o3d303::FrameContent frame();
  /// Frames that were read and not asked for.
  [[nodiscard]] int framesSoFar() const;
  void forgetFrames();
  bool isClosedByPeer();
  /// Whether it has a part of a message whose rest did not come.
  [[nodiscard]] bool isWithinMessage() const { return reader_.isWithinMessage(); }

 private:
  bool readSome();
  boost::asio::io_context io_;
  boost::asio::ip::tcp::socket socket_{io_};
  o3d303::PcicReader reader_{8 << 20};
  std::deque<o3d303::PcicMessage> kept_;
  o3d303::Bytes frame_;
};

}  // namespace toftwin::daemon::test
