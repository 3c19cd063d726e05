// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>

#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "daemon/config.h"
#include "daemon/daemon.h"
#include "daemon/facades/facades.h"
#include "daemon/hub.h"
#include "daemon/metrics.h"
#include "daemon/server.h"

namespace toftwin::daemon {

/// What a daemon is: its event loop and all that lives on it.
class Daemon::Loop {
 public:
  Loop(Options options, const Config& config);
  ~Loop();
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  Result<> begin(Config config);
  void run();
  void stop();
  void reload();

  [[nodiscard]] const Server& server() const { return server_; }
  [[nodiscard]] Hub& hub() { return hub_; }

 private:
  struct Running {
    std::string name;
    std::string fingerprint;
  };

  Result<> listen(ListenKeys keys);
  Result<> listenUnix(const ListenKeys& keys);
  Result<> listenForMetrics(int port);
  void openAudit(const std::filesystem::path& file);
  void apply(Config config);
  void applyKeys(const Config& config);
  void run(ConfiguredSource source);
  void beginReload();
  void finishReload();
  void handleSignals();
  void waitForSignal();
  void watch();
  void beginStop();
  void keepGoing();
  void aside(std::function<void()> work);
  void discard(std::vector<std::shared_ptr<void>> things);
  [[nodiscard]] std::vector<std::string> fingerprints() const;
  [[nodiscard]] std::string statusLine() const;

  const Options options_;
  boost::asio::io_context io_{1};
  Hub hub_;
  Server server_;
  std::unique_ptr<MetricsServer> metrics_;  ///< null: not wanted
  Facades facades_;
  boost::asio::signal_set signals_;
  boost::asio::steady_timer watchdog_;
  ListenKeys listen_;
  Duration source_stuck_;
  std::vector<Running> running_;
  std::optional<Result<Config>> loaded_;  ///< by the reload under way, which `reload_` ends
  std::future<void> reload_;
  std::stop_source reload_stop_;  ///< of the reload under way
  bool reload_again_ = false;
  bool is_stopping_ = false;
  bool is_waiting_for_signal_ = false;
  bool is_watching_ = false;
  std::vector<std::future<void>> discarded_;
};

}  // namespace toftwin::daemon
