// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace toftwin::test {

/// When a camera's frames leave it: intervals that somebody measured on a real one, over and over.
/// Its clock stamps the evenly spaced times from which those intervals deviate.
class FrameSchedule {
 public:
  using Time = std::chrono::nanoseconds;

  explicit FrameSchedule(Time interval) : FrameSchedule(std::vector<Time>{interval}) {}
  explicit FrameSchedule(std::vector<Time> intervals) : intervals_(std::move(intervals)) {
    Time sum{0};
    for (const Time interval : intervals_) sum += interval;
    round_ = sum;
    // The frame that leaves earliest against even spacing is stamped when it leaves, all others
    // before they do.
    Time leaves{0};
    for (std::size_t i = 0; i < intervals_.size(); ++i) {
      earliest_ = std::min(earliest_, leaves - even(i));
      leaves += intervals_[i];
    }
    Time at{0};
    for (const Time interval : intervals_) {
      leaves_.push_back(at);
      at += interval;
    }
  }
  /// Of a file with one interval in milliseconds per line; nothing if it cannot be read.
  static std::optional<FrameSchedule> fromFile(const std::filesystem::path& file) {
    std::ifstream in{file};
    std::vector<Time> intervals;
    double ms = 0.0;
    while (in >> ms) intervals.emplace_back(static_cast<std::int64_t>(ms * 1e6));
    if (intervals.empty()) return std::nullopt;
    return FrameSchedule{std::move(intervals)};
  }

  /// Of frame `index`, since the first one left.
  [[nodiscard]] Time leaves(std::uint64_t index) const {
    const std::uint64_t n = intervals_.size();
    return static_cast<std::int64_t>(index / n) * round_ + leaves_[index % n];
  }
  /// On the same clock: never after it leaves.
  [[nodiscard]] Time stamped(std::uint64_t index) const {
    const std::uint64_t n = intervals_.size();
    return static_cast<std::int64_t>(index / n) * round_ + even(index % n) + earliest_;
  }

 private:
  [[nodiscard]] Time even(std::uint64_t index) const {
    return round_ * static_cast<std::int64_t>(index) / static_cast<std::int64_t>(intervals_.size());
  }
  std::vector<Time> intervals_, leaves_;
  Time round_{0}, earliest_{0};
};

}  // namespace toftwin::test
