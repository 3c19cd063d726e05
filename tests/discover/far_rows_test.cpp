// SPDX-License-Identifier: Apache-2.0
// Gross errors of few rows are set aside, and no effect however steep.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>

#include <fmt/format.h>

#include "calib/discover/table_data.h"

namespace toftwin::discover {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

/// Ranges of 0.5 to 7 m in random order, noise of 1.5 mm, a place from 0 to 1, exposures of which one is rare.
struct Shot {
  int number;
  double place, exposure;
};
using ErrorOf = std::function<double(const Shot&)>;

std::string tableOf(unsigned seed, const ErrorOf& error, bool has_locked = false) {
  constexpr int kShots = 200;
  std::mt19937 random{seed};
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  std::string text = fmt::format("measured_mm,reference_mm,t_s,place,exposure_us{}\n", has_locked ? ",locked" : "");
  for (int i = 0; i < kShots; ++i) {
    const Shot shot{i, uniform(random), i % 50 == 17 ? 8000.0 : 500.0};
    const double reference = 500.0 + 6500.0 * uniform(random);
    text += fmt::format("{:.2f},{:.2f},{},{},{}{}\n", reference + 5.0 + 1.5 * normal(random) + error(shot), reference,
                        10 * i, shot.place, shot.exposure, has_locked ? i % 4 == 0 ? ",1" : ",0" : "");
  }
  return text;
}

TableData tableIn(const std::string& text) {
  const auto table = parseCsv(text, "t.csv");
  auto data = readTable(*table, {}, "t.csv");
  EXPECT_TRUE(data) << data.error().message;
  return data ? *std::move(data) : TableData{};
}

TEST(FarRows, AreSetAsideWithTheirLinesAndSizes) {
  const std::map<int, double> off{{20, 3000.0}, {77, -2500.0}, {111, 5200.0}, {150, 41.0}};
  for (const std::size_t count : {1u, 2u, 4u}) {
    const std::map<int, double> those(off.begin(), std::next(off.begin(), static_cast<std::ptrdiff_t>(count)));
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const TableData data = tableIn(
          tableOf(seed, [&](const Shot& shot) { return those.contains(shot.number) ? those.at(shot.number) : 0.0; }));
      EXPECT_EQ(data.rows(), 200u - count) << "seed " << seed;
      EXPECT_THAT(data.line, testing::Not(Contains(22u)));
      EXPECT_THAT(data.doubts, Contains(AllOf(HasSubstr("far from all others"),
                                              testing::ContainsRegex("line 22 by (299|300)[0-9.]+ mm"))));
    }
  }
}

/// Whatever is steep stays: beginnings, jumps of few rows, a corner, what grows without bound, a bumped capture.
TEST(FarRows, AreNoneOfAnEffect) {
  const std::map<std::string, ErrorOf> shapes{
      {"start", [](const Shot& r) { return 3000.0 * std::exp(-r.number / 3.0); }},
      {"end", [](const Shot& r) { return r.number >= 196 ? 500.0 : 0.0; }},
      {"corner", [](const Shot& r) { return 2000.0 * std::exp(-std::abs(r.place - 0.4) / 0.01); }},
      {"inverse", [](const Shot& r) { return 3.0 / r.place; }},
      {"inverse square", [](const Shot& r) { return 0.3 / (r.place * r.place); }},
      {"bumped", [](const Shot& r) { return r.number >= 90 && r.number < 94 ? -800.0 : 0.0; }},
      {"rare exposure", [](const Shot& r) { return r.exposure > 1000.0 ? 1000.0 : 0.0; }},
      {"edge of the place", [](const Shot& r) { return r.place > 0.96 ? 3000.0 : 0.0; }}};
  for (const auto& [name, error] : shapes)
    for (unsigned seed = 1; seed <= 10; ++seed)
      EXPECT_EQ(tableIn(tableOf(seed, error)).rows(), 200u) << name << ", seed " << seed;
}

TEST(FarRows, AreSetAsideBesideALargeEffect) {
  const TableData data = tableIn(tableOf(3, [](const Shot& shot) {
    return 300.0 * std::exp(-shot.number / 40.0) + (shot.number == 120 || shot.number == 160 ? 4000.0 : 0.0);
  }));
  EXPECT_EQ(data.rows(), 198u);
}

/// Student's t with three degrees of freedom: of 5000 rows one is beyond 20 robust deviations.
TEST(FarRows, AreNoneOfAHeavyTail) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    std::mt19937 random{seed};
    std::student_t_distribution<double> tail{3.0};
    std::uniform_real_distribution<double> uniform;
    std::string text = "error_mm,temperature_c\n";
    for (int i = 0; i < 5000; ++i) text += fmt::format("{:.3f},{:.3f}\n", tail(random), 20.0 + uniform(random));
    EXPECT_EQ(tableIn(text).rows(), 5000u) << "seed " << seed;
  }
}

/// What is found must not hang on them.
TEST(FarRows, AreNotLookedForAmongThoseThatAColumnLocks) {
  const TableData data = tableIn(
      tableOf(4, [](const Shot& shot) { return shot.number == 20 || shot.number == 21 ? 3000.0 : 0.0; }, true));
  EXPECT_EQ(data.rows(), 199u);
  EXPECT_THAT(data.line, Contains(22u)) << "locked";
}

/// Rounded to 10 mm most errors are the same, and the others no gross ones.
TEST(FarRows, AreNoneWhereErrorsAreRounded) {
  std::string text = "error_mm,t_s\n";
  for (int i = 0; i < 200; ++i) text += fmt::format("{},{}\n", i % 61 == 7 ? 30 : 20, i);
  EXPECT_EQ(tableIn(text).rows(), 200u);
}

}  // namespace
}  // namespace toftwin::discover
