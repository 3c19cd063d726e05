// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/bag/pending.h"

#include <algorithm>

namespace toftwin::cli {

bool PendingFrames::add(const std::string& camera, std::int64_t stamp_ns, std::int64_t received_ns, TakenPlane plane) {
  std::deque<PendingFrame>& frames = of_camera_[camera];
  const auto isOfThatTime = [&](const PendingFrame& one) { return one.stamp_ns == stamp_ns; };
  const auto latest = std::find_if(frames.rbegin(), frames.rend(), isOfThatTime);
  const auto isSameTopic = [&](const TakenPlane& other) { return other.topic == plane.topic && other.plane.kind == plane.plane.kind; };
  // The same topic again is another frame, of a camera whose stamps stand still.
  const bool is_new = latest == frames.rend() || std::ranges::any_of(latest->planes, isSameTopic);
  if (is_new) frames.push_back({camera, stamp_ns, received_ns, {}});
  const auto frame = is_new ? std::prev(frames.end()) : std::prev(latest.base());
  const auto isSame = [&](const TakenPlane& other) { return other.plane.kind == plane.plane.kind; };
  if (std::ranges::any_of(frame->planes, isSame)) return false;
  bytes_ += plane.plane.data.size();
  frame->planes.push_back(std::move(plane));
  frame->received_ns = std::max(frame->received_ns, received_ns);
  return true;
}

std::optional<PendingFrame> PendingFrames::take(bool is_end) {
  std::deque<PendingFrame>* first = nullptr;
  for (auto& [camera, frames] : of_camera_) {
    const bool is_ready = frames.size() > kLater || (!frames.empty() && (is_end || bytes_ > kMostBytes));
    if (is_ready && (first == nullptr || frames.front().received_ns < first->front().received_ns)) first = &frames;
  }
  if (first == nullptr) return std::nullopt;
  PendingFrame frame = std::move(first->front());
  first->pop_front();
  for (const TakenPlane& plane : frame.planes) bytes_ -= plane.plane.data.size();
  return frame;
}

}  // namespace toftwin::cli
