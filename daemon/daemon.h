// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <toftwin/result.h>

#include "daemon/clock.h"
#include "daemon/hub.h"
#include "drivers/source.h"

namespace toftwin::daemon {

/// The whole daemon: reads its configuration, opens its sources, listens, and runs until it is told
/// to stop. Without Asio, which would cost whoever starts one a second of compiling.
class Daemon {
 public:
  struct Options {
    std::filesystem::path config;
    std::optional<int> port;            ///< instead of listen.port
    std::optional<std::string> socket;  ///< instead of listen.socket
    bool handle_signals = false;        ///< SIGTERM and SIGINT stop the daemon, SIGHUP reloads it
    std::span<const drivers::Driver> drivers = drivers::allDrivers();
    const Clock* clock = &systemClock();
    std::function<std::uint64_t()> log_lines_lost = [] { return std::uint64_t{0}; };  ///< for the metrics
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

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::string socketPath() const;
  [[nodiscard]] Hub& hub();

 private:
  class Loop;
  explicit Daemon(std::unique_ptr<Loop> loop);
  std::unique_ptr<Loop> loop_;
};

}  // namespace toftwin::daemon
