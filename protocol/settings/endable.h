// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stop_token>
#include <utility>

namespace toftwin::settings {

/// While it lives, what this thread reads for a configuration may be ended by its token: a driver opens files that its
/// table names, which may take long, and looks at now(). One within another stands in for it until it is gone.
class EndableReading {
 public:
  explicit EndableReading(std::stop_token stop) : before_(std::exchange(current(), std::move(stop))) {}
  ~EndableReading() { current() = std::move(before_); }
  EndableReading(const EndableReading&) = delete;
  EndableReading& operator=(const EndableReading&) = delete;

  /// This thread's token; one that never asks outside of any reading.
  [[nodiscard]] static std::stop_token now() { return current(); }

 private:
  static std::stop_token& current() {
    thread_local std::stop_token token;
    return token;
  }
  std::stop_token before_;
};

}  // namespace toftwin::settings
