// SPDX-License-Identifier: Apache-2.0
// What one camera lacks at a single condition of many.
#include "calib/plan/missing.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>

#include "calib/plan/run_report.h"
#include "calib/plan/run_traits.h"

namespace toftwin::plan {
namespace {

/// 20 × 20 pixels that both see alike.
ComparedCapture seenByBoth(std::size_t condition) {
  ComparedCapture one;
  one.record.block = one.record.kind = "distance", one.record.condition = condition;
  one.record.name = fmt::format("distance: {} m", condition + 1);
  one.record.a.source = "cam", one.record.b.source = "twin";
  one.pixels = 400;
  auto& image = one.thinned;
  image.range_a_mm = Image<float>(20, 20, 3000.0F), image.difference_mm = Image<float>(20, 20, 0.1F);
  image.noise_a_mm = image.noise_b_mm = Image<float>(20, 20, 5.0F);
  image.valid_a = image.valid_b = Image<float>(20, 20, 1.0F);
  image.edge = image.flying_a = image.flying_b = Image<std::uint8_t>(20, 20);
  return one;
}

/// Two captures of each of 50 conditions.
ComparedRun seenTwice() {
  ComparedRun run;
  for (std::size_t i = 0; i < 100; ++i) run.captures.push_back(seenByBoth(i / 2));
  return run;
}

void loseFirst(Image<float>& valid, std::size_t pixels) {
  std::fill_n(valid.pixels().begin(), pixels, 0.0F);
}

TEST(Missing, IsToldFirstThoughItIsOfOneConditionOfFifty) {
  ComparedRun run = seenTwice();
  EXPECT_TRUE(missingOf(run).empty());
  for (const std::size_t i : {std::size_t{6}, std::size_t{7}}) {
    loseFirst(run.captures[i].thinned.valid_a, 400);
    run.captures[i].pixels = 0;
  }
  const auto missing = missingOf(run);
  ASSERT_EQ(missing.size(), 1u);
  EXPECT_EQ(missing.front().of, "A");
  EXPECT_EQ(missing.front().share, 1.0);
  const auto finding = judgeRun(run);
  ASSERT_TRUE(finding) << finding.error().message;
  EXPECT_THAT(finding->headline,
              testing::StartsWith("At \"distance: 4 m\" A gives no range at 100 % of the pixels that are seen there, "
                                  "at which B has one in all 2 captures. twin (B) is within"));
  EXPECT_NE(finding->section.tone, compare::Tone::Good);
}

/// In one of its two captures, 5 % of what is seen, or as many as the other lacks of it: noise does it.
TEST(Missing, IsNoNoise) {
  ComparedRun run = seenTwice();
  loseFirst(run.captures[6].thinned.valid_a, 400);
  for (const std::size_t i : {std::size_t{8}, std::size_t{9}}) loseFirst(run.captures[i].thinned.valid_b, 20);
  for (const std::size_t i : {std::size_t{10}, std::size_t{11}}) {
    loseFirst(run.captures[i].thinned.valid_b, 60);
    std::fill_n(run.captures[i].thinned.valid_a.pixels().rbegin(), 40, 0.0F);
  }
  EXPECT_TRUE(missingOf(run).empty());
  for (const std::size_t i : {std::size_t{8}, std::size_t{9}}) loseFirst(run.captures[i].thinned.valid_b, 21);
  ASSERT_EQ(missingOf(run).size(), 1u);
  EXPECT_EQ(missingOf(run).front().of, "B");
}

/// What is read with the lens covered is noise.
TEST(Missing, IsNothingInTheDark) {
  ComparedRun run = seenTwice();
  for (ComparedCapture& one : run.captures) {
    one.record.kind = "dark";
    loseFirst(one.thinned.valid_b, 400);
  }
  EXPECT_TRUE(missingOf(run).empty());
}

}  // namespace
}  // namespace toftwin::plan
