// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/core.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "daemon/clock.h"
#include "drivers/logging.h"

namespace toftwin::daemon {

/// What peers make the log say: of each peer and kind of message a few lines at once, then one every ten seconds, which
/// tells how many it stands for. May be used from any thread.
class PeerLog {
 public:
  static constexpr std::uint32_t kAtOnce = 5;
  static constexpr std::chrono::seconds kPause{10};
  static constexpr std::size_t kMostKinds = 256;  ///< beyond which peers share one

  explicit PeerLog(const Clock& clock = systemClock()) : clock_(clock) {}

  template <class... Values>
  void warn(const std::string& peer, fmt::format_string<Values...> format, Values&&... values) {
    write(logging::Level::Warn, peer, format, fmt::make_format_args(values...));
  }
  template <class... Values>
  void info(const std::string& peer, fmt::format_string<Values...> format, Values&&... values) {
    write(logging::Level::Info, peer, format, fmt::make_format_args(values...));
  }

 private:
  void write(logging::Level level, const std::string& peer, fmt::string_view format, fmt::format_args values);
  struct Kind {
    std::uint32_t told = 0;      ///< in a row, with less than the pause between
    std::uint64_t withheld = 0;  ///< since the last that was told
    SteadyTime last{};           ///< that was told
  };
  Kind& kindOf(const std::string& peer, const char* format);  // with the lock held

  const Clock& clock_;
  std::mutex mutex_;
  std::map<std::pair<std::string, const char*>, Kind> kinds_;
};

}  // namespace toftwin::daemon
