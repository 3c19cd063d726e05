// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>

#include <cstdint>
#include <string_view>

#include <toftwin/result.h>

#include "daemon/facades/accepting.h"
#include "daemon/facades/facade.h"

namespace toftwin::daemon {

/// A TCP listener of a facade, for those whom its `allow` names; `key` is what sets the port.
Result<Listening> listenFor(boost::asio::io_context& io, const FacadeKeys& keys, std::uint16_t port,
                            std::string_view key);

}  // namespace toftwin::daemon
