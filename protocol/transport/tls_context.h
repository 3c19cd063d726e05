// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ssl/context.hpp>
#include <boost/asio/thread_pool.hpp>

#include <atomic>
#include <memory>

#include "protocol/transport/tls.h"

namespace toftwin::transport {

/// Where a server's frames are encrypted while several are sent, so that they are at once.
struct EncryptAside {
  explicit EncryptAside(unsigned count) : threads(count) {}
  std::atomic<int> sending{0};  ///< messages of all connections
  boost::asio::thread_pool threads;
};

/// OpenSSL's part of it, which only this library's files see.
struct TlsContext::State {
  explicit State(boost::asio::ssl::context::method method) : context(method) {}
  boost::asio::ssl::context context;
  bool is_server = false;
  std::unique_ptr<EncryptAside> aside{};  ///< null of a client, and where no threads were to be had
};

}  // namespace toftwin::transport
