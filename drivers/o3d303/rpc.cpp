// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/rpc.h"

#include <fmt/format.h>

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <memory>
#include <optional>
#include <utility>

namespace toftwin::drivers::o3d303 {
namespace {

namespace http = boost::beast::http;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::uint64_t kLongestAnswer = 4 << 20;
// Faults of the camera that are not a mistake in what was asked for.
constexpr int kSessionExists = 101'004, kWrongPassword = 101'005, kNoSession = 100'000;

std::string nameOf(const Endpoint& endpoint) {
  return fmt::format("{}:{}", endpoint.address().to_string(), endpoint.port());
}

Error disconnected(std::string_view driver, const Endpoint& camera, std::string what) {
  return {Error::Code::Disconnected, fmt::format("{}: {}: {}", driver, nameOf(camera), what)};
}

/// Waits for an operation on the socket; what does not end in time is ended by closing the socket.
Result<> finish(EventLoop& loop, boost::asio::ip::tcp::socket& socket, std::string_view driver, const Endpoint& camera,
                const std::optional<error_code>& done, std::chrono::milliseconds within,
                std::string_view what, const std::stop_token& stop) {
  const auto end = loop.waitUntil([&] { return done.has_value(); }, Clock::now() + within, stop);
  if (end != EventLoop::End::Done) {
    error_code ignored;
    socket.close(ignored);  // the handler comes with an error now
    loop.waitUntil([&] { return done.has_value(); }, SteadyTime::max());
    if (end == EventLoop::End::Stopped) return Error{Error::Code::Stopped, "asked to stop"};
    return disconnected(driver, camera, fmt::format("{} took more than {} ms", what, within.count()));
  }
  if (*done) return disconnected(driver, camera, fmt::format("{}: {}", what, done->message()));
  return {};
}

Error errorOf(const toftwin::o3d303::XmlRpcFault& fault, std::string_view driver, const Endpoint& camera,
              std::string_view method) {
  if (fault.code == kSessionExists) {
    return {Error::Code::Busy,
            fmt::format("{}: {}: another program configures the camera; close its session or "
                        "wait until it ends",
                        driver, nameOf(camera))};
  }
  const auto code = fault.code == kWrongPassword ? Error::Code::PermissionDenied
                    : fault.code == kNoSession   ? Error::Code::Disconnected
                                                 : Error::Code::InvalidArgument;
  return {code, fmt::format("{}: {}: {} was refused: {} ({})", driver, nameOf(camera), method,
                            fault.text, fault.code)};
}

}  // namespace

Result<> connect(EventLoop& loop, boost::asio::ip::tcp::socket& socket, const Endpoint& to,
                 const std::stop_token& stop, std::string_view driver) {
  std::optional<error_code> done;
  socket.async_connect(to, [&](error_code error) { done = error; });
  return finish(loop, socket, driver, to, done, kConnectTime,
                "connecting (is the camera powered, its cable in, its address right?)", stop);
}

Result<XmlRpcValue> Rpc::call(std::string_view object, std::string method,
                              std::vector<XmlRpcValue> params, const std::stop_token& stop,
                              milliseconds within) {
  const toftwin::o3d303::XmlRpcCall call{std::move(method), std::move(params)};
  const auto body =
      exchange(std::string{kMain} + std::string{object}, encodeXmlRpc(call), stop, within);
  if (!body) return body.error();
  auto answer = toftwin::o3d303::readXmlRpcAnswer(*body);
  if (!answer) return disconnected(driver_, camera_, answer.error().message);
  if (const auto* fault = std::get_if<toftwin::o3d303::XmlRpcFault>(&*answer)) {
    return errorOf(*fault, driver_, camera_, call.method);
  }
  return std::get<XmlRpcValue>(*std::move(answer));
}

Result<std::string> Rpc::parameter(const std::string& name, const std::stop_token& stop) {
  const auto value = call("", "getParameter", {name}, stop);
  if (!value) return value.error();
  return value->text();
}

Result<std::string> Rpc::exchange(const std::string& path, std::string body,
                                  const std::stop_token& stop, milliseconds within) {
  boost::asio::ip::tcp::socket socket{loop_.io()};
  if (auto connected = connect(loop_, socket, camera_, stop, driver_); !connected) return connected.error();
  http::request<http::string_body> request{http::verb::post, path, 11};
  request.set(http::field::host, nameOf(camera_));
  request.set(http::field::content_type, "text/xml");
  request.keep_alive(false);
  request.body() = std::move(body);
  request.prepare_payload();
  std::optional<error_code> done;
  http::async_write(socket, request, [&](error_code error, std::size_t) { done = error; });
  if (auto sent = finish(loop_, socket, driver_, camera_, done, within, "sending a call", stop); !sent) {
    return sent.error();
  }
  boost::beast::flat_buffer buffer;
  http::response_parser<http::string_body> parser;
  parser.body_limit(kLongestAnswer);
  done.reset();
  http::async_read(socket, buffer, parser, [&](error_code error, std::size_t) { done = error; });
  if (auto got = finish(loop_, socket, driver_, camera_, done, within, "its answer to a call", stop); !got) {
    return got.error();
  }
  if (parser.get().result() != http::status::ok) {
    return disconnected(driver_, camera_,
                        fmt::format("HTTP status {} for {}", parser.get().result_int(), path));
  }
  return std::move(parser.get().body());
}

}  // namespace toftwin::drivers::o3d303
