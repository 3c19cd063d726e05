// SPDX-License-Identifier: Apache-2.0
// A daemon with one driver, the reference device. It defines the table of drivers itself, so that no other
// driver, the simulator least of all, is linked into it.
#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <array>
#include <exception>
#include <string_view>

#include "daemon/daemon.h"
#include "tests/reference_device/device/hidden.h"
#include "tests/reference_device/play/reference_source.h"

namespace toftwin::drivers {

std::span<const Driver> allDrivers() {
  static const std::array rows{reference::sourceRow()};
  return rows;
}

}  // namespace toftwin::drivers

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view{argv[1]} == "--document") {
    fmt::print("{}", toftwin::reference::documentHidden());
    return 0;
  }
  if (argc != 2 || argv[1][0] == '-') {
    fmt::print(stderr,
               "usage: reference_device CONFIGURATION      as for toftwind, with driver = \"reference\"\n");
    return 2;
  }
  try {
    auto log = spdlog::stderr_logger_mt("reference_device");
    log->set_pattern("%l: %v");
    log->set_level(spdlog::level::warn);
    spdlog::set_default_logger(std::move(log));
    auto started =
        toftwin::daemon::Daemon::start({.config = argv[1], .port = {}, .socket = {}, .handle_signals = true});
    if (!started) {
      fmt::print(stderr, "reference_device: {}\n", started.error().message);
      return 2;
    }
    (*started)->run();
    return 0;
  } catch (const std::exception& e) {
    fmt::print(stderr, "reference_device: {}\n", e.what());
    return 1;
  }
}
