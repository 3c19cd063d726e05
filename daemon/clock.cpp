// SPDX-License-Identifier: Apache-2.0
#include "daemon/clock.h"

namespace toftwin::daemon {
namespace {

class SystemClock final : public Clock {
 public:
  [[nodiscard]] HostTime wall() const override {
    const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
    return {std::chrono::duration_cast<std::chrono::nanoseconds>(since_epoch).count()};
  }
  [[nodiscard]] SteadyTime steady() const override { return std::chrono::steady_clock::now(); }
};

}  // namespace

const Clock& systemClock() {
  static const SystemClock clock;
  return clock;
}

}  // namespace toftwin::daemon
