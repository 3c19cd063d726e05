// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/struck_line.h"

namespace toftwin::daemon::gige_vision {

void StruckLine::strike(Bytes packet, const LineFaults::Fate& fate) {
  if (fate.is_lost) return;
  if (fate.is_late && !late_) {
    late_ = std::move(packet);
    return;
  }
  if (fate.is_doubled) out_.push_back(packet);
  out_.push_back(std::move(packet));
  if (late_) out_.push_back(*std::exchange(late_, std::nullopt));
}

bool StruckLine::flush() {
  for (; !out_.empty(); out_.pop_front()) {
    if (!put_(out_.front())) return false;
  }
  return true;
}

bool StruckLine::finish() {
  if (late_) out_.push_back(*std::exchange(late_, std::nullopt));
  return flush();
}

void StruckLine::clear() {
  out_.clear();
  late_.reset();
}

}  // namespace toftwin::daemon::gige_vision
