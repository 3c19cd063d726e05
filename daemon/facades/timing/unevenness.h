// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "protocol/settings/settings.h"

namespace toftwin::daemon {

/// By how much each frame of a real camera left later than evenly spaced ones would have, over and over.
/// Frames that come evenly and are held back by that leave at the real one's intervals.
class Unevenness {
 public:
  using Time = std::chrono::nanoseconds;
  Unevenness() = default;
  /// From the intervals between its frames.
  explicit Unevenness(const std::vector<Time>& intervals);
  /// Of a file with one interval in milliseconds per line.
  static Result<Unevenness> load(const std::filesystem::path& file);
  /// Of the file that a facade's key `intervals` names, if it names one; what is wrong with it is told to the
  /// table.
  static Unevenness read(settings::Table& table, const std::string& intervals);

  [[nodiscard]] bool isNone() const { return delays_.empty(); }
  /// Of frame `index`; never negative.
  [[nodiscard]] Time delay(std::uint64_t index) const {
    return delays_.empty() ? Time{0} : delays_[index % delays_.size()];
  }

 private:
  std::vector<Time> delays_;
};

}  // namespace toftwin::daemon
