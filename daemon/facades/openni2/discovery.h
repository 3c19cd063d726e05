// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openni2/OniCTypes.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include <toftwin/client.h>

#include "daemon/facades/openni2/uri.h"
#include "daemon/facades/openni2/worker.h"

namespace toftwin::openni2 {

/// Which sources are there: asks the daemons every half second, and tells of what came and went. Nothing is locked
/// while it tells.
class Discovery {
 public:
  struct Events {
    std::function<void(const OniDeviceInfo&)> connected, disconnected;
    std::function<void(const OniDeviceInfo&, OniDeviceState)> state;
  };
  /// Looks once, and tells, before it returns.
  Discovery(const std::vector<std::string>& addresses, Events events);

  /// Looks for one source that a program names, on the program's thread, and keeps an eye on it from then on.
  Result<> find(const std::string& uri);
  /// Tells of a device's state on our own thread, where the program may close that device. It may be called for as
  /// long as it is kept.
  [[nodiscard]] std::function<void(const std::string& uri, OniDeviceState state)> poster() const;

  /// False: the thread is left behind (Worker). It tells of nothing that it was not telling of already.
  bool finish();

 private:
  struct Daemon {
    std::string address;
    bool is_listed = true;        ///< all its sources are devices, not only those that were named
    std::set<std::string> named{};  ///< by a program
    std::optional<Client> client{};
    std::map<std::string, OniDeviceInfo> there{};  ///< by URI
  };
  struct Change {
    OniDeviceInfo info;
    bool has_come;
  };
  struct State {
    std::string first_address;
    Events events;
    std::mutex mutex;
    std::list<Daemon> daemons;

    std::mutex posted_mutex;
    std::condition_variable_any posted_changed;
    std::deque<std::pair<std::string, OniDeviceState>> posted;

    void run(const std::stop_token& stop);
    Result<std::vector<Change>> look(Daemon& daemon) const;
    std::vector<Change> lookEverywhere(const std::stop_token& stop);
    void tell(const std::vector<Change>& changes, const std::stop_token& stop) const;
    void tellPosted(const std::stop_token& stop);
    std::optional<OniDeviceInfo> infoOf(const std::string& uri);
  };

  std::shared_ptr<State> state_;  // shared with the thread
  Worker worker_;
};

}  // namespace toftwin::openni2
