// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/prompter.h"

#include <fmt/format.h>

#include "protocol/types/counted.h"

namespace toftwin::cli {

void Prompter::tell(const intrinsics::Guidance& guidance) {
  std::string text = fmt::format("{}, {} % of the image", counted(guidance.views, "view"),
                                 intrinsics::wholePercent(guidance.covered));
  if (guidance.worst_error_px) text += fmt::format(", lens known to {:.2f} px", *guidance.worst_error_px);
  text += guidance.isEnough() ? "\n  enough: Ctrl-C, or wait\n" : "\n";
  for (const std::string& missing : guidance.missing) text += "  " + missing + "\n";
  sayOnce(text);
}

void Prompter::sayOnce(const std::string& text) {
  why_.clear(), why_said_.clear();
  if (text == said_) return;
  say_(text);
  said_ = text;
}

void Prompter::whyNot(const std::string& why) {
  constexpr std::chrono::seconds kWhile{1};
  const auto now = now_();
  if (why != why_) why_ = why, since_ = now;
  if (why == why_said_ || now - since_ < kWhile) return;
  say_(fmt::format("  not taken: {}\n", why));
  why_said_ = why;
}

bool Searches::add(const intrinsics::Sighting& sighting) {
  const bool was_thorough = isThorough(), is_miss = sighting.rejection == intrinsics::Rejection::NotFound;
  if (was_thorough) has_missed_ = is_miss;
  if (!sighting.isUsed()) misses_ = was_thorough ? 0 : misses_ + 1;
  return !is_miss || has_missed_;
}

}  // namespace toftwin::cli
