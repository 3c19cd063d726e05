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

/// Of sched_setattr(2), for which the C library has no function before 2.41; <linux/sched/types.h> defines a structure again
/// that <sched.h> has.
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

/// Of threads that join this one's work, once each.
class Workers : public tbb::task_scheduler_observer {
 public:
  Workers() { observe(true); }
  ~Workers() override { observe(false); }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  void on_scheduler_entry(bool is_worker) override {
    thread_local bool is_done = false;
    if (!is_worker || is_done) return;
    is_done = true;
    takeLongSlice();
  }
};

}  // namespace

void takeLongSlices() {
  // The library watches who joins the work of the thread that asks for it.
  thread_local const Workers workers;
  takeLongSlice();
}

}  // namespace toftwin::drivers::simulator
