// SPDX-License-Identifier: Apache-2.0
#include "o3d303_client.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <utility>

namespace toftwin::daemon::test {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;

tcp::endpoint at(std::uint16_t port) { return {boost::asio::ip::address_v4::loopback(), port}; }

}  // namespace

RawHttp::RawHttp(std::uint16_t port) {
  error_code error;
  socket_.connect(at(port), error);
}

void RawHttp::send(std::string_view bytes) {
  error_code error;
  boost::asio::write(socket_, boost::asio::buffer(bytes), error);
}

std::string RawHttp::receiveAll() {
  std::string all;
  error_code end;
  boost::asio::read(socket_, boost::asio::dynamic_buffer(all), end);
  return all;
}

o3d303::XmlRpcAnswer O3d303Client::ask(const std::string& object, const std::string& method,
                                       RpcParams params) {
  const std::string body = encodeXmlRpc(o3d303::XmlRpcCall{method, std::move(params)});
  RawHttp http{xmlrpc_};
  http.send(
      fmt::format("POST /api/rpc/v1/com.ifm.efector/{} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/xml\r\nConnection: close\r\n"
                  "Content-Length: {}\r\n\r\n{}",
                  object, body.size(), body));
  const std::string answer = http.receiveAll();
  const auto begin = answer.find("\r\n\r\n");
  if (begin == std::string::npos) return o3d303::XmlRpcFault{-1, "no answer"};
  auto read = o3d303::readXmlRpcAnswer(std::string_view{answer}.substr(begin + 4));
  return read ? *std::move(read) : o3d303::XmlRpcAnswer{o3d303::XmlRpcFault{-2, read.error().message}};
}

o3d303::XmlRpcValue O3d303Client::call(const std::string& object, const std::string& method,
                                       RpcParams params) {
  const auto answer = ask(object, method, std::move(params));
  if (const auto* fault = std::get_if<o3d303::XmlRpcFault>(&answer)) {
    ADD_FAILURE() << object << " " << method << ": " << fault->code << " " << fault->text;
    return {};
  }
  return std::get<o3d303::XmlRpcValue>(answer);
}

int O3d303Client::fault(const std::string& object, const std::string& method, RpcParams params) {
  const auto answer = ask(object, method, std::move(params));
  const auto* fault = std::get_if<o3d303::XmlRpcFault>(&answer);
  return fault == nullptr ? 0 : fault->code;
}

bool O3d303Client::tryCall(const std::string& object, const std::string& method, RpcParams params) {
  return fault(object, method, std::move(params)) == 0;
}

std::uint16_t O3d303Client::pcicPort() {
  return static_cast<std::uint16_t>(std::stoi("0" + call("", "getParameter", {"PcicTcpPort"}).text()));
}

void O3d303Client::beginSession() { call("", "requestSession", {"", kSession}); }
void O3d303Client::edit() {
  beginSession();
  call(session(""), "setOperatingMode", {1});
  call(session("edit/"), "editApplication", {1});
}
void O3d303Client::endSession() { call(session(""), "cancelSession", {}); }

PcicClient::PcicClient(std::uint16_t port) { socket_.connect(at(port)); }

void PcicClient::sendBytes(std::string_view bytes) {
  error_code error;
  boost::asio::write(socket_, boost::asio::buffer(bytes), error);
}

bool PcicClient::readSome() {
  std::array<std::byte, 65'536> piece;
  error_code error;
  const std::size_t size = socket_.read_some(boost::asio::buffer(piece), error);
  if (error) return false;
  reader_.feed(std::span{piece}.first(size));
  while (auto message = reader_.next()) {
    if (!*message) return true;
    kept_.push_back(**std::move(message));
  }
  ADD_FAILURE() << "bytes that are no messages";
  return false;
}

std::string PcicClient::nextOf(std::string_view ticket) {
  while (true) {
    const auto found = std::ranges::find(kept_, ticket, &o3d303::PcicMessage::ticket);
    if (found != kept_.end()) {
      std::string content{o3d303::textOf(found->content)};
      kept_.erase(found);
      return content;
    }
    if (!readSome()) return "the connection ended";
  }
}

std::string PcicClient::command(std::string_view command) {
  const auto bytes = o3d303::encodePcic("1000", command);
  sendBytes(o3d303::textOf(bytes));
  return nextOf("1000");
}

std::string PcicClient::setSchema(const std::vector<std::string_view>& blobs) {
  const std::string answer = command(o3d303::schemaCommand(toJson(o3d303::schemaOf(blobs))));
  forgetFrames();  // of the schema before
  return answer;
}

o3d303::FrameContent PcicClient::frame() {
  const std::string content = nextOf("0000");
  const auto bytes = std::as_bytes(std::span{content});
  frame_.assign(bytes.begin(), bytes.end());
  auto read = o3d303::readFrameContent(frame_);
  EXPECT_TRUE(read.ok()) << content.substr(0, 40);
  return read ? *std::move(read) : o3d303::FrameContent{};
}

int PcicClient::framesSoFar() const {
  return static_cast<int>(std::ranges::count(kept_, o3d303::kFrameTicket, &o3d303::PcicMessage::ticket));
}
void PcicClient::forgetFrames() {
  std::erase_if(kept_, [](const auto& one) { return one.ticket == o3d303::kFrameTicket; });
}

bool PcicClient::isClosedByPeer() {
  while (readSome()) {
  }
  return true;
}

}  // namespace toftwin::daemon::test
