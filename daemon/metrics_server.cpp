// SPDX-License-Identifier: Apache-2.0
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>

#include <chrono>

#include "daemon/listen.h"
#include "daemon/metrics.h"

namespace toftwin::daemon {
namespace {

namespace http = boost::beast::http;
using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMostConnections = 8;
constexpr std::uint32_t kLongestHeader = 4096;
constexpr std::chrono::seconds kPatience{5};  ///< with the whole of a question and its answer

}  // namespace

class MetricsServer::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(MetricsServer& server, tcp::socket socket)
      : server_(server), alive_(server.is_alive_), socket_(std::move(socket)), timer_(socket_.get_executor()) {
    parser_.header_limit(kLongestHeader);
    parser_.body_limit(0);
  }
  void serve() {
    timer_.expires_after(kPatience);
    timer_.async_wait([weak = weak_from_this()](error_code cancelled) {
      const auto self = weak.lock();
      if (!cancelled && self) self->close();
    });
    http::async_read(socket_, buffer_, parser_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error || !*self->alive_) return self->close();
      self->answer();
    });
  }
  void close() {
    error_code ignored;
    socket_.close(ignored);
    timer_.cancel();
    if (*alive_) server_.connections_.erase(shared_from_this());
  }

 private:
  void answer() {
    const auto& request = parser_.get();
    const bool is_known = request.target() == "/metrics" && request.method() == http::verb::get;
    response_.result(is_known ? http::status::ok : http::status::not_found);
    response_.set(http::field::content_type, "application/openmetrics-text; version=1.0.0; charset=utf-8");
    response_.keep_alive(false);
    response_.body() = is_known ? server_.text_() : "there is only GET /metrics\n";
    response_.prepare_payload();
    http::async_write(socket_, response_, [self = shared_from_this()](error_code, std::size_t) { self->close(); });
  }

  MetricsServer& server_;
  const std::shared_ptr<bool> alive_;
  tcp::socket socket_;
  boost::asio::steady_timer timer_;
  boost::beast::flat_buffer buffer_{2 * kLongestHeader};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

Result<std::unique_ptr<MetricsServer>> MetricsServer::open(boost::asio::io_context& io, std::uint16_t port, Text text) {
  auto acceptor = listenTcp(io, "127.0.0.1", port, "listen.metrics_port");
  if (!acceptor) return acceptor.error();
  return std::make_unique<MetricsServer>(*std::move(acceptor), std::move(text));
}

MetricsServer::MetricsServer(tcp::acceptor acceptor, Text text)
    : text_(std::move(text)),
      accepting_(std::move(acceptor), [this](tcp::socket socket) { take(std::move(socket)); }) {}

MetricsServer::~MetricsServer() {
  *is_alive_ = false;
  const auto all = connections_;
  for (const auto& connection : all) connection->close();
}

void MetricsServer::take(tcp::socket socket) {
  if (connections_.size() >= kMostConnections) (*connections_.begin())->close();
  auto connection = std::make_shared<Connection>(*this, std::move(socket));
  connections_.insert(connection);
  connection->serve();
}

}  // namespace toftwin::daemon
