// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include <toftwin/result.h>

#include "daemon/facades/accepting.h"
#include "daemon/hub.h"

namespace toftwin::daemon {

/// What operators watch, in the text format of OpenMetrics 1.0.
std::string openMetrics(const Hub& hub, std::uint64_t log_lines_lost);

/// Gives it to whoever asks for /metrics over HTTP, on this machine only. Used on the thread of the io_context only.
class MetricsServer {
 public:
  using Text = std::function<std::string()>;
  static Result<std::unique_ptr<MetricsServer>> open(boost::asio::io_context& io, std::uint16_t port, Text text);
  MetricsServer(boost::asio::ip::tcp::acceptor acceptor, Text text);
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;
  [[nodiscard]] std::uint16_t port() const { return accepting_.port(); }

 private:
  class Connection;
  void take(boost::asio::ip::tcp::socket socket);

  const Text text_;
  std::set<std::shared_ptr<Connection>> connections_;  // shared with their handlers
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
  Accepting accepting_;
};

}  // namespace toftwin::daemon
