// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/plan_words.h"

#include <fmt/format.h>

#include <algorithm>

#include "protocol/types/counted.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {

std::string howLong(const plan::Plan& plan, const plan::Schedule& schedule) {
  const auto setups =
      std::ranges::count_if(plan.blocks, [](const auto& block) { return !block.setup.empty(); });
  const auto locked = std::ranges::count_if(schedule.captures, &plan::PlannedCapture::is_locked);
  std::string text =
      fmt::format("{}: {}, {} of them locked; {}", plan.name.empty() ? "plan" : plan.name,
                  counted(schedule.captures.size(), "capture"), locked, timeLeft(schedule.total.in(second)));
  if (setups > 0)
    text += fmt::format(", {} of it to prepare {}", timeLeft(schedule.setups.in(second)), counted(setups, "block"));
  return text + ". What a simulated camera takes to render comes on top.";
}

std::string inWords(const plan::Check& check) {
  std::string text;
  for (const bool refuses : {true, false}) {
    for (const auto& remark : check.remarks) {
      if (remark.refuses != refuses) continue;
      text += fmt::format("{}: {}\n", refuses ? "refused" : "note", remark.what);
      if (!remark.mend.empty()) text += fmt::format("         to mend it: {}\n", remark.mend);
    }
  }
  return text + (check.passes() ? "The plan passes: what it changes can be told apart.\n"
                                : "The plan is refused: mend it as said above.\n");
}

}  // namespace toftwin::cli
