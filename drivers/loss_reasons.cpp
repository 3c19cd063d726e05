// SPDX-License-Identifier: Apache-2.0
#include "drivers/loss_reasons.h"

#include <fmt/format.h>

#include <algorithm>

namespace toftwin::drivers {
namespace {

/// A damaged frame's text may be another one every time; those beyond this many have one name.
constexpr std::size_t kMostReasons = 8;
constexpr std::string_view kOthers = "other reasons";

}  // namespace

void addLost(Frame& frame, std::uint64_t frames, std::string_view why) {
  LossReasons one;
  one.add(why, frames);
  one.tell(frame);
}

void LossReasons::add(std::string_view why, std::uint64_t frames) {
  if (frames == 0) return;
  const auto known = std::ranges::find(reasons_, why, &std::pair<std::string, std::uint64_t>::first);
  if (known != reasons_.end()) {
    known->second += frames;
  } else if (reasons_.size() < kMostReasons || why == kOthers) {
    reasons_.emplace_back(why, frames);
  } else {
    add(kOthers, frames);
  }
}

void LossReasons::add(const LossReasons& others) {
  for (const auto& [why, frames] : others.reasons_) add(why, frames);
}

void LossReasons::account(std::uint64_t skipped, std::string_view otherwise) {
  if (const std::uint64_t known = frames(); skipped > known) add(otherwise, skipped - known);
}

void LossReasons::tell(Frame& frame) {
  frame.dropped_by_device += frames();
  std::string& because = frame.dropped_because;
  if (!because.empty() && !reasons_.empty()) because += ", ";
  because += text();
  clear();
}

std::uint64_t LossReasons::frames() const {
  std::uint64_t all = 0;
  for (const auto& [why, frames] : reasons_) all += frames;
  return all;
}

std::string LossReasons::text() const {
  std::string all;
  for (const auto& [why, frames] : reasons_) all += fmt::format("{}{} ({})", all.empty() ? "" : ", ", why, frames);
  return all;
}

}  // namespace toftwin::drivers
