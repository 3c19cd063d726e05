// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace toftwin::drivers::openni2 {

/// Puts the images of several streams, whose device clock is one, together: each depth image with
/// the nearest in time of every other stream. One that finds none within `most_apart` is counted as
/// lost rather than given with an image of another time.
template <class Item>
class Pairing {
 public:
  struct Options {
    std::size_t companions = 0;
    std::int64_t interval_us = 33'333;  ///< of the depth images
    std::int64_t most_apart_us = 33'333;
  };
  struct Set {
    Item depth;
    std::vector<Item*> companions;  ///< good until the next call
  };
  explicit Pairing(Options options) : options_(options), companions_(options.companions) {}

  void clear() {
    depths_.clear();
    for (auto& queue : companions_) queue.clear();
  }
  void addDepth(std::int64_t time_us, Item item) {
    if (!depths_.empty() && time_us <= depths_.back().time_us) {  // the clock was set
      lost_ += depths_.size();
      depths_.clear();
    }
    depths_.push_back({time_us, std::move(item)});
  }
  void addCompanion(std::size_t index, std::int64_t time_us, Item item) {
    auto& queue = companions_[index];
    if (!queue.empty() && time_us <= queue.back().time_us) queue.clear();
    queue.push_back({time_us, std::move(item)});
    if (queue.size() > kMostKept) queue.pop_front();
  }

  /// The next set that is complete.
  std::optional<Set> take() {
    while (!depths_.empty()) {
      const std::int64_t time_us = depths_.front().time_us;
      const bool must_decide = depths_.size() > kMostWaiting;
      Set set;
      for (auto& queue : companions_) {
        // What comes later is farther away, once the newest is less than half an interval before.
        const bool is_decided =
            !queue.empty() && queue.back().time_us >= time_us - options_.interval_us / 2;
        if (!is_decided && !must_decide) return std::nullopt;
        set.companions.push_back(nearest(queue, time_us));
      }
      set.depth = std::move(depths_.front().item);
      depths_.pop_front();
      bool is_complete = true;
      for (const Item* item : set.companions) is_complete = is_complete && item != nullptr;
      if (is_complete) return set;
      ++lost_;
    }
    return std::nullopt;
  }

  /// How many depth images found no company since this was asked last.
  std::uint64_t takeLost() { return std::exchange(lost_, 0); }

 private:
  static constexpr std::size_t kMostKept = 4, kMostWaiting = 2;
  struct Stamped {
    std::int64_t time_us;
    Item item;
  };
  Item* nearest(std::deque<Stamped>& queue, std::int64_t time_us) {
    Item* best = nullptr;
    std::int64_t apart = options_.most_apart_us;
    for (Stamped& one : queue) {
      if (std::abs(one.time_us - time_us) > apart) continue;
      apart = std::abs(one.time_us - time_us);
      best = &one.item;
    }
    return best;
  }

  Options options_;
  std::deque<Stamped> depths_;
  std::vector<std::deque<Stamped>> companions_;
  std::uint64_t lost_ = 0;
};

}  // namespace toftwin::drivers::openni2
