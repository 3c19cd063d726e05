// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include <chrono>
#include <functional>
#include <memory>

#include "daemon/networks.h"

namespace toftwin::daemon {

/// Where connections come in, and whose are taken.
struct Listening {
  Listening(boost::asio::ip::tcp::acceptor of, Networks whose = {})  // NOLINT(google-explicit-constructor)
      : acceptor(std::move(of)), allowed(std::move(whose)) {}
  boost::asio::ip::tcp::acceptor acceptor;
  Networks allowed;
};

/// Takes connections one after another; those of others than are allowed are closed. Where accept(2) fails, for want of file descriptors say, it waits a
/// moment instead of failing at full speed. Used on the acceptor's thread only.
class Accepting {
 public:
  Accepting(Listening listening, std::function<void(boost::asio::ip::tcp::socket)> take)
      : acceptor_(std::move(listening.acceptor)),
        allowed_(std::move(listening.allowed)),
        pause_(acceptor_.get_executor()),
        port_(acceptor_.local_endpoint().port()),
        take_(std::move(take)) {
    next();
  }
  ~Accepting() { *is_alive_ = false; }
  Accepting(const Accepting&) = delete;
  Accepting& operator=(const Accepting&) = delete;
  [[nodiscard]] std::uint16_t port() const { return port_; }
  /// While it is not open, the kernel keeps those that come, up to its own bound: they are taken afterwards.
  void setOpen(bool is_open) {
    if (std::exchange(is_open_, is_open) == is_open) return;
    boost::system::error_code ignored;
    is_open ? next() : static_cast<void>(acceptor_.cancel(ignored));
  }

 private:
  void next() {
    if (!is_open_) return;
    acceptor_.async_accept(
        [this, alive = is_alive_](boost::system::error_code error, boost::asio::ip::tcp::socket socket) {
          if (!*alive || error == boost::asio::error::operation_aborted) return;
          if (!is_open_) return;  // it came just before
          struct GoOn {  // also where taking it throws
            Accepting& accepting;
            bool has_failed;
            ~GoOn() { has_failed ? accepting.nextAfterAWhile() : accepting.next(); }
          } const go_on{*this, static_cast<bool>(error)};
          boost::system::error_code is_gone;
          if (!error && allowed_.admit(socket.remote_endpoint(is_gone).address())) take_(std::move(socket));
        });
  }
  void nextAfterAWhile() {
    pause_.expires_after(std::chrono::milliseconds{100});
    pause_.async_wait([this, alive = is_alive_](boost::system::error_code cancelled) {
      if (!cancelled && *alive) next();
    });
  }

  boost::asio::ip::tcp::acceptor acceptor_;
  const Networks allowed_;
  boost::asio::steady_timer pause_;
  const std::uint16_t port_;
  bool is_open_ = true;
  const std::function<void(boost::asio::ip::tcp::socket)> take_;
  const std::shared_ptr<bool> is_alive_ =
      std::make_shared<bool>(true);  // shared with handlers that come later
};

}  // namespace toftwin::daemon
