// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/facades.h"

#include <boost/asio/ip/address.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include "daemon/facades/listen_for.h"
#include "daemon/listen.h"
#include "daemon/thrown.h"
#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::seconds kStartPause{1};

std::chrono::nanoseconds bootTimeOf(const FacadeKeys& keys) {
  return std::chrono::nanoseconds{std::llround(keys.boot_time.in(nanosecond))};
}

std::string nameOf(const FacadeKeys& keys) { return fmt::format("facade {} of {}", keys.kind, keys.source); }

void warnIfRemote(const FacadeKeys& keys) {
  boost::system::error_code is_none;
  const auto address = boost::asio::ip::make_address(keys.address, is_none);
  if (is_none || address.is_loopback()) return;
  logging::warn(
      "{} listens on {}, which other machines reach: {} can see the camera and set it, because "
      "its language has no encryption and at most a password in clear text",
      nameOf(keys), keys.address, keys.allow.empty() ? "everyone there" : "whoever has an address that `allow` names");
}

}  // namespace

Result<Listening> listenFor(boost::asio::io_context& io, const FacadeKeys& keys, std::uint16_t port,
                            std::string_view key) {
  auto allowed = Networks::read(keys.allow);
  if (!allowed) return allowed.error();
  auto acceptor = listenTcp(io, keys.address, port, fmt::format("the facade's {}", key));
  if (!acceptor) return acceptor.error();
  return Listening{*std::move(acceptor), *std::move(allowed)};
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
      const auto boots_until = steady_clock::now() + bootTimeOf(one.keys);
      wanted.push_back({std::move(one), boots_until, nullptr, std::move(why)});
    }
  }
  before.clear();  // their ports are free before the new ones want them
  running_ = std::move(wanted);
  startThoseThatAreNot();
}

void Facades::stop() {
  pause_.cancel();
  running_.clear();
  tellHealth();
}

void Facades::start(Running& one) {
  const FacadeKeys& keys = one.configured.keys;
  Result<std::unique_ptr<Facade>> started = Error{};
  try {
    started = one.configured.start({keys, hub_, clock_, one.configured.unevenness});
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
  const auto now = steady_clock::now();
  std::optional<steady_clock::time_point> next;
  for (Running& one : running_) {
    if (one.facade || !one.configured.start) continue;
    const bool boots = now < one.boots_until;
    if (!boots) start(one);
    if (one.facade) continue;
    const auto again = boots ? one.boots_until : now + kStartPause;
    next = next ? std::min(*next, again) : again;
  }
  tellHealth();
  if (!next) return;
  pause_.expires_at(*next);
  pause_.async_wait([this](boost::system::error_code cancelled) {
    if (!cancelled) startThoseThatAreNot();
  });
}

void Facades::tellHealth() {
  std::vector<ToldFacade> told;
  for (const Running& one : running_) {
    const FacadeKeys& keys = one.configured.keys;
    ToldFacade facade{{.kind = keys.kind, .source = keys.source, .place = {}}, nullptr, nullptr};
    if (one.facade) {
      facade.clients = one.facade->clients();
      facade.booting = one.facade->booting();
      facade.health.place = one.facade->where();
      facade.health.state = FacadeState::Running;
    } else {
      facade.health.state = one.last_error.empty() ? FacadeState::Booting : FacadeState::NotThere;
      facade.health.problem = one.last_error;
    }
    told.push_back(std::move(facade));
  }
  hub_.setFacades(std::move(told));
}

}  // namespace toftwin::daemon
