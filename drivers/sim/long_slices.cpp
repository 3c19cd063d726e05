// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/long_slices.h"

#include <sched.h>
#include <sys/syscall.h>
#include <tbb/task_scheduler_observer.h>
#include <unistd.h>

#include <cstdint>

namespace toftwin::drivers::simulator {
namespace {

constexpr std::uint64_t kSlice_ns = 20'000'000;  // usual are 0.7 to 3 ms

/// Of sched_setattr(2), for which the C library has no function yet; <linux/sched/types.h> defines a structure again that
/// <sched.h> has.
struct SchedulingAttributes {
  std::uint32_t size, policy;
  std::uint64_t flags;
  std::int32_t nice;
  std::uint32_t priority;
  std::uint64_t runtime_ns, deadline_ns, period_ns;
};

void takeLongSlice() {
  SchedulingAttributes attributes{};
  if (::syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0) != 0) return;
  if (attributes.policy != SCHED_OTHER) return;
  attributes.size = sizeof attributes;
  attributes.runtime_ns = kSlice_ns;
  ::syscall(SYS_sched_setattr, 0, &attributes, 0);
}

/// Of threads that join others' work, once each.
class Workers : public tbb::task_scheduler_observer {
 public:
  Workers() { observe(true); }
  void on_scheduler_entry(bool is_worker) override {
    thread_local bool is_done = false;
    if (!is_worker || is_done) return;
    is_done = true;
    takeLongSlice();
  }
};

}  // namespace

void takeLongSlices() {
  // Never destroyed: workers may outlive what main() leaves behind.
  static const auto* const workers = new Workers;
  static_cast<void>(workers);
  takeLongSlice();
}

}  // namespace toftwin::drivers::simulator
