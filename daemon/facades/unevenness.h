// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

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

/// Frames on their way to a facade's clients, each held back until a real camera's would leave: by the
/// latency, and as unevenly. What comes when so much waits is lost, and the log says so once. Used on the
/// thread of the io_context.
class UnevenFrames {
 public:
  static constexpr std::uint64_t kMostHeldBytes = 512ULL << 20U;
  using Put = std::function<void(const Frame&)>;
  /// `name` of the facade, for the log.
  UnevenFrames(boost::asio::io_context& io, std::string name, Unevenness unevenness, Duration latency,
               Put put);
  void take(const Frame& frame);

 private:
  void wait();
  void noteLost();
  struct Held {
    std::chrono::steady_clock::time_point leaves;
    Frame frame;
  };
  const std::string name_;
  const Unevenness unevenness_;
  const std::chrono::nanoseconds latency_;
  const Put put_;
  boost::asio::steady_timer timer_;
  std::deque<Held> held_;
  std::uint64_t held_bytes_ = 0, taken_ = 0, lost_ = 0;
};

}  // namespace toftwin::daemon
