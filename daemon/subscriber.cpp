// SPDX-License-Identifier: Apache-2.0
#include "daemon/subscriber.h"

#include <cstddef>

#include "daemon/thrown.h"

namespace toftwin::daemon {
namespace {

Result<PreparedFramePtr> prepare(const Frame& frame, const Selection& selection) {
  Result<Frame> selected = select(frame, selection);
  if (!selected) return selected.error();
  auto prepared = std::make_shared<PreparedFrame>();
  prepared->frame = *std::move(selected);
  std::uint64_t bytes = 0;
  for (const Plane& plane : prepared->frame.planes) bytes += plane.data.size();
  if (auto fits = checkFrameBytes(bytes); !fits) return fits.error();
  prepared->body = wire::layOutBody(prepared->frame.planes);
  prepared->made_at = std::chrono::steady_clock::now();
  // Once here, so that a frame that cannot be sent says why to its subscribers and costs no connection.
  const auto sendable = wire::encode(wire::FrameMessage{0, prepared->frame}, prepared->body);
  if (!sendable) return Error{Error::Code::Internal, sendable.error().message};
  return PreparedFramePtr{std::move(prepared)};
}

/// Whatever goes wrong with one subscriber is not to end the others, let alone the daemon.
void give(Subscriber& taker, const Result<PreparedFramePtr>& prepared) noexcept {
  try {
    if (prepared) return taker.backlog.push(*prepared);
    taker.backlog.end(prepared.error());
  } catch (...) {
    try {
      taker.backlog.end(thrownError("the subscription"));
    } catch (...) {
      return;  // it has ended, but could not be woken
    }
  }
}

Result<PreparedFramePtr> tryToPrepare(const Frame& frame, const Selection& selection) {
  try {
    return prepare(frame, selection);
  } catch (...) {
    return thrownError("preparing the frame");
  }
}

}  // namespace

void end(Subscriber& subscriber, const Error& reason) noexcept { give(subscriber, reason); }

void fanOut(const Frame& frame, const std::vector<SubscriberPtr>& takers) {
  std::vector<bool> is_served(takers.size(), false);
  std::vector<PreparedFramePtr> given;
  for (std::size_t first = 0; first < takers.size(); ++first) {
    if (is_served[first]) continue;
    const Selection& wanted = takers[first]->wish.selection;
    const Result<PreparedFramePtr> prepared = tryToPrepare(frame, wanted);
    for (std::size_t i = first; i < takers.size(); ++i) {
      if (is_served[i] || takers[i]->wish.selection != wanted) continue;
      is_served[i] = true;
      give(*takers[i], prepared);
    }
    if (prepared) given.push_back(*prepared);
  }
  // While the thread that sends copies them into shared memory.
  for (const PreparedFramePtr& prepared : given) static_cast<void>(prepared->summedBody());
}

}  // namespace toftwin::daemon
