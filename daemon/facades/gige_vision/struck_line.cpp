// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/struck_line.h"

namespace toftwin::daemon::gige_vision {

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
  if (fate.is_doubled) {
    faults_.note(fate.packet, LineFaults::Kind::Duplicate, what);
    out_.push_back(packet);
  }
  out_.push_back(std::move(packet));
}

bool StruckLine::flush() {
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
  return flush();
}

void StruckLine::clear() {
  out_.clear();
  late_.reset();
}

}  // namespace toftwin::daemon::gige_vision
