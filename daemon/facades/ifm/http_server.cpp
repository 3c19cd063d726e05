// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ifm/http_server.h"

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>

#include <chrono>
#include <optional>
#include <string_view>

#include "daemon/facades/ifm/request_check.h"

namespace toftwin::daemon::ifm {
namespace {

namespace http = boost::beast::http;
using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMostHttpConnections = 16;
constexpr std::uint64_t kLongestBody = 8 << 20;  // the longest that is exported, with what is around it
constexpr std::uint32_t kLongestHeader = 8192;
constexpr std::chrono::seconds kPatience{30};

}  // namespace

class HttpServer::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(HttpServer& server, tcp::socket socket)
      : server_(server),
        alive_(server.is_alive_),
        socket_(std::move(socket)),
        timer_(socket_.get_executor()) {}

  void read() {
    parser_.emplace();
    parser_->body_limit(kLongestBody);
    parser_->header_limit(kLongestHeader);
    wait();
    http::async_read(socket_, buffer_, *parser_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error || !*self->alive_) return self->close();
      self->ask();
    });
  }
  void close() {
    error_code ignored;
    socket_.close(ignored);
    timer_.cancel();
    if (*alive_) server_.connections_.erase(shared_from_this());
  }

 private:
  void ask() {
    const auto& request = parser_->get();
    if (request.method() == http::verb::get || request.method() == http::verb::head)
      return answer(http::status::not_found, "there are no files here: XML-RPC is asked by POST\n");
    if (request.method() != http::verb::post) return answer(http::status::method_not_allowed, "only POST\n");
    const auto fieldOf = [&](http::field name) {
      const auto value = request[name];
      return std::string_view{value.data(), value.size()};
    };
    const auto refused = refusalOf({.host = fieldOf(http::field::host),
                                    .origin = fieldOf(http::field::origin),
                                    .content_type = fieldOf(http::field::content_type)},
                                   server_.own_names_);
    if (refused.status != 0) return answer(http::status{static_cast<unsigned>(refused.status)}, refused.why);
    const auto target = request.target();
    server_.ask_(
        std::string{target.data(), target.size()}, request.body(),
        [self = shared_from_this()](std::string xml) { self->answer(http::status::ok, std::move(xml)); });
  }
  void answer(http::status status, std::string body) {
    if (!socket_.is_open()) return;
    response_ = {};
    response_.result(status);
    response_.set(http::field::content_type, "text/xml");
    response_.keep_alive(parser_->get().keep_alive());
    response_.body() = std::move(body);
    response_.prepare_payload();
    wait();
    http::async_write(socket_, response_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error || !self->response_.keep_alive() || !*self->alive_) return self->close();
      self->read();
    });
  }
  void wait() {
    timer_.expires_after(kPatience);
    timer_.async_wait([weak = weak_from_this()](error_code cancelled) {
      const auto self = weak.lock();
      if (!cancelled && self) self->close();
    });
  }

  HttpServer& server_;
  const std::shared_ptr<bool> alive_;
  tcp::socket socket_;
  boost::asio::steady_timer timer_;
  boost::beast::flat_buffer buffer_{kLongestBody + kLongestHeader};
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> response_;
};

HttpServer::HttpServer(Listening listening, std::vector<std::string> own_names, Ask ask)
    : own_names_(std::move(own_names)),
      ask_(std::move(ask)),
      accepting_(std::move(listening), [this](tcp::socket socket) { take(std::move(socket)); }) {}

HttpServer::~HttpServer() {
  *is_alive_ = false;
  const auto all = connections_;
  for (const auto& connection : all) connection->close();
}

void HttpServer::setOpen(bool is_open) {
  accepting_.setOpen(is_open);
  if (is_open) return;
  const auto all = std::exchange(connections_, {});
  for (const auto& connection : all) connection->close();
}

void HttpServer::take(tcp::socket socket) {
  if (connections_.size() >= kMostHttpConnections) return;
  auto connection = std::make_shared<Connection>(*this, std::move(socket));
  connections_.insert(connection);
  connection->read();
}

}  // namespace toftwin::daemon::ifm
