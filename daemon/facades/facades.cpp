// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/facades.h"

#include <boost/asio/ip/address.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <utility>

#include "daemon/listen.h"
#include "daemon/thrown.h"
#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

constexpr std::chrono::seconds kStartPause{1};

std::string nameOf(const FacadeKeys& keys) { return fmt::format("facade {} of {}", keys.kind, keys.source); }

void warnIfRemote(const FacadeKeys& keys) {
  boost::system::error_code is_none;
  const auto address = boost::asio::ip::make_address(keys.address, is_none);
  if (is_none || address.is_loopback()) return;
  logging::warn(
      "{} listens on {}, which other machines reach: everyone there can see the camera and set it, because "
      "its language has no encryption and at most a password in clear text",
      nameOf(keys), keys.address);
}

}  // namespace

Result<boost::asio::ip::tcp::acceptor> listenFor(boost::asio::io_context& io, const FacadeKeys& keys,
                                                 std::uint16_t port, std::string_view key) {
  return listenTcp(io, keys.address, port, fmt::format("the facade's {}", key));
}

void Facades::apply(std::vector<ConfiguredFacade> configured) {
  std::vector<Running> before = std::exchange(running_, {});
  std::vector<Running> wanted;
  for (ConfiguredFacade& one : configured) {
    const auto same = std::ranges::find_if(
        before, [&](const Running& running) { return running.configured.fingerprint == one.fingerprint; });
    if (same != before.end()) {
      wanted.push_back(std::move(*same));
      before.erase(same);
    } else {
      if (!one.start) logging::error("{} is not there: {}", nameOf(one.keys), one.not_built);
      std::string why = one.not_built;
      wanted.push_back({std::move(one), nullptr, std::move(why)});
    }
  }
  before.clear();  // their ports are free before the new ones want them
  running_ = std::move(wanted);
  startThoseThatAreNot();
}

void Facades::stop() {
  pause_.cancel();
  running_.clear();
}

void Facades::start(Running& one) {
  const FacadeKeys& keys = one.configured.keys;
  Result<std::unique_ptr<Facade>> started = Error{};
  try {
    started = one.configured.start({keys, hub_, clock_});
  } catch (...) {
    started = thrownError("starting it");
  }
  if (started) {
    one.facade = *std::move(started);
    one.last_error.clear();
    warnIfRemote(keys);
    logging::info("{}: {}", nameOf(keys), one.facade->where());
  } else if (started.error().message != one.last_error) {
    one.last_error = started.error().message;
    logging::error("{} is not there, and is tried again: {}", nameOf(keys), one.last_error);
  }
}

void Facades::startThoseThatAreNot() {
  bool is_one_missing = false;
  for (Running& one : running_) {
    if (one.facade || !one.configured.start) continue;
    start(one);
    is_one_missing |= !one.facade;
  }
  tellHealth();
  if (!is_one_missing) return;
  pause_.expires_after(kStartPause);
  pause_.async_wait([this](boost::system::error_code cancelled) {
    if (!cancelled) startThoseThatAreNot();
  });
}

void Facades::tellHealth() {
  std::map<std::string, std::string> problem_of;
  for (const Running& one : running_) {
    if (one.facade) continue;
    std::string& told = problem_of[one.configured.keys.source];
    told +=
        fmt::format("{}facade {}: {}", told.empty() ? "" : "; ", one.configured.keys.kind, one.last_error);
  }
  hub_.setFacadeProblems(std::move(problem_of));
}

}  // namespace toftwin::daemon
