// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "daemon/clock.h"
#include "daemon/config.h"
#include "daemon/facades/facades.h"
#include "daemon/hub.h"
#include "daemon/server.h"
#include "drivers/source.h"

namespace toftwin::daemon {

/// The whole daemon: reads its configuration, opens its sources, listens, and runs until it is told
/// to stop.
class Daemon {
 public:
  struct Options {
    std::filesystem::path config;
    std::optional<int> port;            ///< instead of listen.port
    std::optional<std::string> socket;  ///< instead of listen.socket
    bool handle_signals = false;        ///< SIGTERM and SIGINT stop the daemon, SIGHUP reloads it
    std::span<const drivers::Driver> drivers = drivers::allDrivers();
    const Clock* clock = &systemClock();
  };

  static Result<std::unique_ptr<Daemon>> start(Options options);
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  /// Serves until `stop`, then closes recordings and clients.
  void run();

  // From any thread:
  void stop();
  /// Reads the configuration again. Sources that are configured as before run on; if anything is
  /// wrong with the new one, all stays as it is and the log says why.
  void reload();

  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  [[nodiscard]] std::string socketPath() const { return server_.socketPath(); }
  [[nodiscard]] Hub& hub() { return hub_; }

 private:
  struct Running {
    std::string name;
    std::string fingerprint;
  };

  Daemon(Options options, const Config& config);
  Result<> listen(ListenKeys keys);
  Result<> listenUnix(const ListenKeys& keys);
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
  Facades facades_;
  boost::asio::signal_set signals_;
  boost::asio::steady_timer watchdog_;
  ListenKeys listen_;
  Duration source_stuck_;
  std::vector<Running> running_;
  std::optional<Result<Config>> loaded_;  ///< by the reload under way, which `reload_` ends
  std::future<void> reload_;
  bool reload_again_ = false;
  bool is_stopping_ = false;
  bool is_waiting_for_signal_ = false;
  bool is_watching_ = false;
  std::vector<std::future<void>> discarded_;
};

}  // namespace toftwin::daemon
