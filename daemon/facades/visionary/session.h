// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <variant>

#include "daemon/facades/visionary/device.h"

namespace toftwin::daemon::visionary {

using SteadyTime = std::chrono::steady_clock::time_point;

/// A connection's session, which its client opens, and which ends by itself when nothing is asked for as long
/// as the client said. No sockets here.
class Session {
 public:
  /// `number` of the session that it may open; not 0, which is none.
  explicit Session(std::uint32_t number) : number_(number) {}

  /// What a telegram wants: an answer that is known, or a command for the device.
  using Wanted = std::variant<toftwin::visionary::Telegram, ColaCommand>;
  Wanted take(const toftwin::visionary::Telegram& telegram, SteadyTime now);
  [[nodiscard]] Device::Client& client() { return client_; }
  [[nodiscard]] bool isOpen() const { return timeout_.has_value(); }

 private:
  Wanted open(const toftwin::visionary::Telegram& telegram, const ColaCommand& command, SteadyTime now);

  const std::uint32_t number_;
  std::optional<std::chrono::seconds> timeout_;
  SteadyTime last_{};
  Device::Client client_;
};

}  // namespace toftwin::daemon::visionary
