// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include <toftwin/result.h>

#include "protocol/transport/address.h"
#include "protocol/transport/framed_socket.h"

namespace toftwin::client {

/// Connects to a daemon, waiting at most `timeout`. Runs `io`, which no other thread may be running.
Result<transport::Socket> dial(boost::asio::io_context& io, const transport::Address& address,
                               std::chrono::milliseconds timeout);

}  // namespace toftwin::client
