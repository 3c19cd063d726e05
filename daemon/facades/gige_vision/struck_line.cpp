// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/struck_line.h"

#include <algorithm>
#include <iterator>

namespace toftwin::daemon::gige_vision {
namespace {

constexpr std::size_t kMostDelayed = 4096;

}  // namespace

void StruckLine::strike(Bytes packet, std::string what) {
  const auto fate = faults_.next();
  if (fate.is_lost) return faults_.note(fate.packet, LineFaults::Kind::Loss, what);
  if (fate.is_late && !late_) {
    late_ = Late{std::move(packet), std::move(what), fate};
    return;
  }
  leave(std::move(packet), what, fate);
  if (!late_) return;
  const Late late = *std::exchange(late_, std::nullopt);
  faults_.note(late.fate.packet, LineFaults::Kind::Reorder, late.what);
  leave(late.packet, late.what, late.fate);
}

void StruckLine::leave(Bytes packet, const std::string& what, const LineFaults::Fate& fate) {
  if (fate.is_corrupted) {
    faults_.note(fate.packet, LineFaults::Kind::Corruption, what);
    LineFaults::corrupt(packet, fate.noise);
  }
  if (fate.is_doubled) faults_.note(fate.packet, LineFaults::Kind::Duplicate, what);
  std::vector<Bytes> packets(fate.is_doubled ? 2 : 1, packet);
  if (fate.is_delayed && delayed_.size() < kMostDelayed) {
    delayed_.push_back({std::chrono::steady_clock::now() + delay_, std::move(packets), what, fate.packet});
  } else {
    std::ranges::move(packets, std::back_inserter(out_));
  }
}

bool StruckLine::flush() {
  while (!delayed_.empty() && delayed_.front().due <= std::chrono::steady_clock::now()) {
    Delayed& late = delayed_.front();
    faults_.note(late.number, LineFaults::Kind::Delay, late.what);
    std::ranges::move(late.packets, std::back_inserter(out_));
    delayed_.pop_front();
  }
  for (; !out_.empty(); out_.pop_front()) {
    if (!put_(out_.front())) return false;
  }
  return true;
}

bool StruckLine::finish() {
  if (late_) {  // nothing came that it could have left after
    const Late late = *std::exchange(late_, std::nullopt);
    leave(late.packet, late.what, late.fate);
  }
  return flush() && delayed_.empty();
}

void StruckLine::clear() {
  out_.clear();
  delayed_.clear();
  late_.reset();
}

}  // namespace toftwin::daemon::gige_vision
