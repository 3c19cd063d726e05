// SPDX-License-Identifier: Apache-2.0
// Captures that are too few for signs have an offset each, and what changes within them is tested.
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include <fmt/format.h>

#include "discovered.h"
#include "planted.h"

namespace toftwin::discover {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// 200 rows whose temperature changes within captures and whose lamp only between them.
struct FewCaptures {
  int captures = 5;
  double per_kelvin = 0.6, capture_mm = 2.0;
  double wander_mm = 0.0;  ///< of an AR(1) process within captures, correlation 0.95
};
std::string tableOf(const FewCaptures& wanted, unsigned seed) {
  constexpr int kRows = 200;
  std::mt19937 random{seed};
  std::normal_distribution<double> normal;
  std::string text = "capture,reference_mm,measured_mm,temp_C,lamp_V\n";
  double offset = 0.0, lamp = 0.0, wander = 0.0;
  for (int i = 0, last = -1; i < kRows; ++i) {
    const int capture = i * wanted.captures / kRows;
    if (capture != last) {
      offset = wanted.capture_mm * normal(random), lamp = 230.0 + normal(random);
      wander = normal(random), last = capture;
    }
    wander = 0.95 * wander + std::sqrt(1.0 - 0.95 * 0.95) * normal(random);
    const double reference = 500.0 + 30.0 * ((i * 77) % kRows), warmer = 3.0 * normal(random);
    const double error =
        5.0 + offset + wanted.wander_mm * wander + wanted.per_kelvin * warmer + 1.5 * normal(random);
    text += fmt::format("{},{:.2f},{:.2f},{:.2f},{:.2f}\n", capture, reference, reference + error, 25.0 + warmer, lamp);
  }
  return text;
}

/// By signs p was 0.30, 0.16, 0.08 and 0.04 of 4 to 7 captures, however large the effect.
TEST(FewCaptures, ShowWhatChangesWithinThem) {
  for (const int captures : {2, 3, 4, 5, 7, 10}) {
    const TableDiscovery d = discovered(tableOf({.captures = captures}, 1));
    ASSERT_EQ(d.finding.effects.size(), 1u) << captures << ": " << verdictOf(d);
    EXPECT_EQ(d.finding.effects[0].name, "temp_C") << captures;
    EXPECT_NEAR(d.finding.effects[0].numbers[0].value, 0.6, 4.0 * d.finding.effects[0].numbers[0].error) << captures;
    EXPECT_LT(d.judged.after.rms, d.judged.before.rms) << captures << ": locked captures have offsets of their own";
    EXPECT_LT(d.judged.after.rms, 2.0) << captures;
  }
}

TEST(FewCaptures, DoNotSayThatWhatChangesOnlyBetweenThemIsNothing) {
  const TableDiscovery d = discovered(tableOf({.per_kelvin = 0.0}, 2));
  EXPECT_THAT(verdictOf(d), HasSubstr("hold no effect that these columns could show within a capture"));
  EXPECT_THAT(verdictOf(d), HasSubstr("Not tested: lamp_V changes only from capture to capture"));
  EXPECT_THAT(d.open.doubts, Contains(HasSubstr("lamp_V changes only from capture to capture")));
  EXPECT_THAT(d.open.doubts, Contains(HasSubstr("only 4 captures are open")));
  EXPECT_THAT(namedNuisances(d)[1].name, HasSubstr("offset of capture from line"));
}

TEST(FewCaptures, CannotTestAnythingIfNothingChangesWithinThem) {
  std::string text = "capture,error_mm,lamp_V\n";
  for (int i = 0; i < 100; ++i) text += fmt::format("{},{},{}\n", i / 20, (i * 37) % 11, i / 20 % 4);
  EXPECT_THAT(verdictOf(discovered(text)), HasSubstr("Nothing could be tested: lamp_V"));
}

/// More than 3 alarms in 40 tables have probability 0.07 % if α is right. Rates of larger runs: docs/discover.md.
TEST(FewCaptures, WithNothingInThemAreSilent) {
  for (const double wander : {0.0, 1.5}) {
    int alarms = 0;
    for (unsigned seed = 0; seed < 40; ++seed)
      alarms += discovered(tableOf({4 + static_cast<int>(seed % 7), 0.0, 2.0, wander}, seed)).finding.first_p <= 0.01;
    EXPECT_LE(alarms, 3) << "wander " << wander;
  }
}

}  // namespace
}  // namespace toftwin::discover
