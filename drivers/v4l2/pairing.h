// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/v4l2/stream.h"

namespace toftwin::drivers::v4l2 {

/// Finds pictures of two nodes of one camera that were taken together: nearest in time, and at most
/// a tolerance apart. Each list of pictures comes in the order taken.
class Pairing {
 public:
  struct Pair {
    Stream::Picture depth, infrared;
  };
  explicit Pairing(std::int64_t tolerance_ns) : tolerance_ns_(tolerance_ns) {}

  void addDepth(const Stream::Picture& picture) { depth_.push_back(picture); }
  void addInfrared(const Stream::Picture& picture) { infrared_.push_back(picture); }
  /// The next pair, if both are there. Whatever cannot be of a pair any more goes to the lists
  /// below.
  std::optional<Pair> take();
  /// Pictures without a partner since it was asked last, to be given back.
  std::vector<Stream::Picture> takeLonelyDepth() { return std::exchange(lonely_depth_, {}); }
  std::vector<Stream::Picture> takeLonelyInfrared() { return std::exchange(lonely_infrared_, {}); }

 private:
  static constexpr std::size_t kMostWaiting = 2;  // each keeps a buffer from the camera

  std::int64_t tolerance_ns_;
  std::deque<Stream::Picture> depth_, infrared_;
  std::vector<Stream::Picture> lonely_depth_, lonely_infrared_;
};

}  // namespace toftwin::drivers::v4l2
