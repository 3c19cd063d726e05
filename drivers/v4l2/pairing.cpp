// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/pairing.h"

#include <cstdlib>
#include <utility>

namespace toftwin::drivers::v4l2 {
namespace {

void dropFirst(std::deque<Stream::Picture>& from, std::vector<Stream::Picture>& to) {
  to.push_back(from.front());
  from.pop_front();
}

}  // namespace

std::optional<Pairing::Pair> Pairing::take() {
  while (!depth_.empty() && !infrared_.empty()) {
    const auto apart = [&](const Stream::Picture& infrared) {
      return infrared.stamp_ns - depth_.front().stamp_ns;
    };
    // The next infrared picture may be nearer.
    if (infrared_.size() > 1 && std::abs(apart(infrared_[1])) < std::abs(apart(infrared_[0]))) {
      dropFirst(infrared_, lonely_infrared_);
    } else if (std::abs(apart(infrared_[0])) <= tolerance_ns_) {
      const Pair pair{depth_.front(), infrared_.front()};
      depth_.pop_front();
      infrared_.pop_front();
      return pair;
    } else if (apart(infrared_[0]) > 0) {
      dropFirst(depth_, lonely_depth_);
    } else {
      dropFirst(infrared_, lonely_infrared_);
    }
  }
  while (depth_.size() > kMostWaiting) dropFirst(depth_, lonely_depth_);
  while (infrared_.size() > kMostWaiting) dropFirst(infrared_, lonely_infrared_);
  return std::nullopt;
}

}  // namespace toftwin::drivers::v4l2
