// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "calib/plan/check.h"

namespace toftwin::plan {

inline Plan planOf(const std::string& toml) {
  auto plan = parsePlan(toml, "test.toml");
  EXPECT_TRUE(plan.ok()) << plan.error().message;
  return plan ? *std::move(plan) : Plan{};
}

inline Schedule scheduleOfText(const std::string& toml) {
  auto schedule = scheduleOf(planOf(toml));
  EXPECT_TRUE(schedule.ok()) << schedule.error().message;
  return schedule ? *std::move(schedule) : Schedule{};
}

inline Check checkOf(const std::string& toml) {
  const Plan plan = planOf(toml);
  const auto schedule = scheduleOf(plan);
  EXPECT_TRUE(schedule.ok());
  return check(plan, *schedule);
}

/// The remarks that refuse, one a line, each with how to mend it.
inline std::string refusals(const Check& check) {
  std::string text;
  for (const Remark& one : check.remarks) {
    if (one.refuses) text += one.what + " | " + one.mend + "\n";
  }
  return text;
}

}  // namespace toftwin::plan
