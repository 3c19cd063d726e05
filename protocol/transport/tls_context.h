// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ssl/context.hpp>

#include "protocol/transport/tls.h"

namespace toftwin::transport {

/// OpenSSL's part of it, which only this library's files see.
struct TlsContext::State {
  explicit State(boost::asio::ssl::context::method method) : context(method) {}
  boost::asio::ssl::context context;
  bool is_server = false;
};

}  // namespace toftwin::transport
