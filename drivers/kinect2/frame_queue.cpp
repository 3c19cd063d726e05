// SPDX-License-Identifier: Apache-2.0
#include "drivers/kinect2/frame_queue.h"

#include <chrono>
#include <utility>

namespace toftwin::drivers::kinect2 {
namespace {

constexpr std::size_t kMostFrames = 2;

}  // namespace

void FrameQueue::packet(std::span<const std::byte> bytes) {
  const std::scoped_lock lock{mutex_};
  assembler_.packet(bytes, std::chrono::steady_clock::now());
  auto frame = assembler_.take();
  if (!frame) return;
  if (frames_.size() == kMostFrames) {
    frames_.pop_front();
    ++late_;
  }
  frame->losses = assembler_.losses();
  frames_.push_back(*std::move(frame));
  changed_.notify_one();
}

void FrameQueue::missed() {
  const std::scoped_lock lock{mutex_};
  assembler_.missed();
}

void FrameQueue::lost(Error why) {
  const std::scoped_lock lock{mutex_};
  if (!end_) end_ = std::move(why);
  changed_.notify_one();
}

void FrameQueue::clear() {
  const std::scoped_lock lock{mutex_};
  assembler_ = Assembler{};
  frames_.clear();
  late_ = 0;
  end_.reset();
}

Result<RawFrame> FrameQueue::next(const std::stop_token& stop, SteadyTime until) {
  std::unique_lock lock{mutex_};
  changed_.wait_until(lock, stop, until, [this] { return !frames_.empty() || end_; });
  if (stop.stop_requested()) return Error{Error::Code::Stopped, "asked to stop"};
  if (!frames_.empty()) {
    RawFrame frame = std::move(frames_.front());
    frames_.pop_front();
    frame.losses.late += late_;  // all of them were before it
    return frame;
  }
  if (end_) return *end_;
  return Error{Error::Code::Timeout, "no frame within a second"};
}

Losses FrameQueue::losses() const {
  const std::scoped_lock lock{mutex_};
  Losses losses = assembler_.losses();
  losses.late += late_;
  return losses;
}

}  // namespace toftwin::drivers::kinect2
