// SPDX-License-Identifier: Apache-2.0
#include "daemon/subscriber.h"

#include <algorithm>
#include <cstddef>

#include "protocol/transport/memfd.h"

namespace toftwin::daemon {
namespace {

/// Smaller bodies go through the socket faster than through a file descriptor and a mapping.
constexpr std::uint64_t kSmallestSharedBody = 64 * 1024;

Result<PreparedFramePtr> prepare(const Frame& frame, const Selection& selection, bool share) {
  Result<Frame> selected = select(frame, selection);
  if (!selected) return selected.error();
  auto prepared = std::make_shared<PreparedFrame>();
  prepared->frame = *std::move(selected);
  prepared->body = wire::encodeBody(prepared->frame.planes);
  if (share && prepared->body.bytes >= kSmallestSharedBody) {
    // Where there is no shared memory to be had, the body goes through the socket.
    if (auto shared = transport::SharedBody::create(prepared->body))
      prepared->shared_body = *shared;
  }
  return PreparedFramePtr{std::move(prepared)};
}

}  // namespace

void fanOut(const Frame& frame, const std::vector<SubscriberPtr>& takers) {
  std::vector<bool> is_served(takers.size(), false);
  for (std::size_t first = 0; first < takers.size(); ++first) {
    if (is_served[first]) continue;
    const Selection& wanted = takers[first]->wish.selection;
    std::vector<SubscriberPtr> equals;
    for (std::size_t i = first; i < takers.size(); ++i) {
      if (is_served[i] || takers[i]->wish.selection != wanted) continue;
      is_served[i] = true;
      equals.push_back(takers[i]);
    }
    const bool share = std::ranges::any_of(
        equals, [](const SubscriberPtr& taker) { return taker->wish.in_shared_memory; });
    const Result<PreparedFramePtr> prepared = prepare(frame, wanted, share);
    for (const SubscriberPtr& taker : equals) {
      if (prepared) {
        taker->queue.push(*prepared);
      } else {
        taker->queue.end(prepared.error());
      }
    }
  }
}

}  // namespace toftwin::daemon
