// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/openni2/discovery.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <utility>

#include "daemon/facades/openni2/camera_link.h"

namespace toftwin::openni2 {
namespace {

constexpr std::chrono::milliseconds kInterval{500};

template <std::size_t N>
void copyText(char (&to)[N], const std::string& text) {
  const std::size_t size = std::min(text.size(), N - 1);
  std::memcpy(to, text.data(), size);
  to[size] = '\0';
}

OniDeviceInfo infoFor(const std::string& uri, const SourceEntry& source) {
  OniDeviceInfo info{};
  copyText(info.uri, uri);
  copyText(info.vendor, "toftwin");
  copyText(info.name, source.model.empty() ? source.name : source.model);
  return info;
}

}  // namespace

// ---- looking ---------------------------------------------------------------------------------

Result<std::vector<Discovery::Change>> Discovery::State::look(Daemon& daemon) const {
  std::map<std::string, OniDeviceInfo> now;
  std::optional<Error> problem;
  if (!daemon.client) {
    auto client = connectTo(daemon.address);
    if (client) daemon.client.emplace(*std::move(client));
    if (!client) problem = client.error();
  }
  if (daemon.client) {
    const auto sources = daemon.client->sources();
    if (!sources) {
      daemon.client.reset();
      problem = sources.error();
    } else {
      for (const SourceEntry& source : *sources) {
        const bool is_meant = daemon.is_listed || daemon.named.contains(source.name);
        if (!is_meant || !source.problem.empty()) continue;
        const std::string uri = uriOf({daemon.address, source.name}, first_address);
        if (uri.size() < ONI_MAX_STR) now.emplace(uri, infoFor(uri, source));
      }
    }
  }
  std::vector<Change> changes;
  for (const auto& [uri, info] : daemon.there) {
    if (!now.contains(uri)) changes.push_back({info, false});
  }
  for (const auto& [uri, info] : now) {
    if (!daemon.there.contains(uri)) changes.push_back({info, true});
  }
  daemon.there = std::move(now);
  if (problem && changes.empty()) return *problem;
  return changes;
}

std::vector<Discovery::Change> Discovery::State::lookEverywhere(const std::stop_token& stop) {
  const std::scoped_lock lock{mutex};
  std::vector<Change> all;
  for (Daemon& daemon : daemons) {
    if (stop.stop_requested()) break;
    if (auto changes = look(daemon)) all.insert(all.end(), changes->begin(), changes->end());
  }
  return all;
}

/// What is told may end us: then nobody is there for the rest.
void Discovery::State::tell(const std::vector<Change>& changes, const std::stop_token& stop) const {
  for (const Change& change : changes) {
    if (stop.stop_requested()) return;
    (change.has_come ? events.connected : events.disconnected)(change.info);
  }
}

void Discovery::State::tellPosted(const std::stop_token& stop) {
  decltype(posted) news;
  {
    std::unique_lock lock{posted_mutex};
    posted_changed.wait_for(lock, stop, kInterval, [&] { return !posted.empty(); });
    news.swap(posted);
  }
  for (const auto& [uri, state] : news) {
    const auto info = infoOf(uri);
    if (stop.stop_requested()) return;
    if (info) events.state(*info, state);
  }
}

std::optional<OniDeviceInfo> Discovery::State::infoOf(const std::string& uri) {
  const std::scoped_lock lock{mutex};
  for (const Daemon& daemon : daemons) {
    if (const auto one = daemon.there.find(uri); one != daemon.there.end()) return one->second;
  }
  return std::nullopt;
}

// ---- the thread --------------------------------------------------------------------------------

void Discovery::State::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    try {
      tellPosted(stop);
      tell(lookEverywhere(stop), stop);
    } catch (...) {  // NOLINT(bugprone-empty-catch): no memory now; perhaps at the next look
    }
  }
}

// ---- any thread --------------------------------------------------------------------------------

Discovery::Discovery(const std::vector<std::string>& addresses, Events events)
    : state_([&] {
        auto state = std::make_shared<State>();
        state->first_address = addresses.empty() ? std::string{} : addresses.front();
        state->events = std::move(events);
        if (addresses.empty()) state->daemons.emplace_back();
        for (const std::string& address : addresses) state->daemons.push_back({.address = address});
        state->tell(state->lookEverywhere({}), {});
        return state;
      }()),
      worker_([shared = state_](const std::stop_token& stop) { shared->run(stop); }) {}

Result<> Discovery::find(const std::string& uri) {
  const auto place = placeOf(uri, state_->first_address);
  if (!place) return place.error();
  // As it is listed: a port that is left out and one that is written are one place only if written alike.
  std::vector<Change> changes;
  Error problem{Error::Code::NotFound, "toftwin: the daemon has no source \"" + place->source +
                                           "\", or its camera is not there now (toftwin list)"};
  bool is_there = false;
  {
    const std::scoped_lock lock{state_->mutex};
    auto& daemons = state_->daemons;
    auto daemon = std::ranges::find(daemons, place->address, &Daemon::address);
    const bool is_new = daemon == daemons.end();
    if (is_new) daemon = daemons.insert(daemons.end(), Daemon{.address = place->address, .is_listed = false});
    daemon->named.insert(place->source);
    auto looked_now = state_->look(*daemon);
    if (looked_now) {
      changes = *std::move(looked_now);
    } else {
      problem = looked_now.error();
    }
    is_there = daemon->there.contains(uri);
    if (!is_there) daemon->named.erase(place->source);
    if (is_new && !is_there) daemons.erase(daemon);
  }
  state_->tell(changes, {});
  if (!is_there) return problem;
  return {};
}

std::function<void(const std::string&, OniDeviceState)> Discovery::poster() const {
  return [shared = state_](const std::string& uri, OniDeviceState state) {
    {
      const std::scoped_lock lock{shared->posted_mutex};
      shared->posted.emplace_back(uri, state);
    }
    shared->posted_changed.notify_all();
  };
}

bool Discovery::finish() { return worker_.finish(); }

}  // namespace toftwin::openni2
