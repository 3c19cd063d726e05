// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>

namespace toftwin::daemon {

/// How long something took, counted by upper bounds. Any thread may count and read.
class Histogram {
 public:
  static constexpr std::array<double, 12> kBoundsMs{0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000};
  static constexpr std::size_t kBuckets = kBoundsMs.size() + 1;  ///< the last has no bound

  void count(std::chrono::nanoseconds time) {
    const double ms = std::chrono::duration<double, std::milli>{time}.count();
    std::size_t bucket = 0;
    while (bucket < kBoundsMs.size() && ms > kBoundsMs[bucket]) ++bucket;
    ++buckets_[bucket];
    sum_ns_ += static_cast<std::uint64_t>(time.count() > 0 ? time.count() : 0);
  }
  [[nodiscard]] std::uint64_t in(std::size_t bucket) const { return buckets_.at(bucket); }
  [[nodiscard]] double sumSeconds() const { return 1e-9 * static_cast<double>(sum_ns_.load()); }

 private:
  std::array<std::atomic<std::uint64_t>, kBuckets> buckets_{};
  std::atomic<std::uint64_t> sum_ns_{0};
};

/// What went to the daemon's own clients. Any thread may count and read.
struct Traffic {
  std::atomic<std::uint64_t> frames{0};
  std::atomic<std::uint64_t> bytes{0};
  std::atomic<std::uint64_t> dropped{0};  ///< as the clients were too slow
  Histogram latency;                      ///< from a frame's hand-out to its last byte's going into the socket
};

}  // namespace toftwin::daemon
