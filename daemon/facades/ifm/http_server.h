// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "daemon/facades/accepting.h"

namespace toftwin::daemon::ifm {

/// XML over HTTP: the camera's configuration port, for programs and not for web pages. A client that stalls
/// is closed after half a minute and holds up nobody. Used on the facade's thread only.
class HttpServer {
 public:
  using Answer = std::function<void(std::string xml)>;
  /// Called with a request's path and body; the answer may be given later.
  using Ask = std::function<void(std::string path, std::string body, Answer)>;

  /// `own_names`: see request_check.h.
  HttpServer(Listening listening, std::vector<std::string> own_names, Ask ask);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  [[nodiscard]] std::uint16_t port() const { return accepting_.port(); }
  /// Closes all connections and takes no more until it is open again: those that come wait for that.
  void setOpen(bool is_open);

 private:
  class Connection;
  void take(boost::asio::ip::tcp::socket socket);

  const std::vector<std::string> own_names_;
  const Ask ask_;
  std::set<std::shared_ptr<Connection>> connections_;  // shared with their handlers
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
  Accepting accepting_;
};

}  // namespace toftwin::daemon::ifm
