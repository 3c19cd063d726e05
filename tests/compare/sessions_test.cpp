// SPDX-License-Identifier: Apache-2.0
// Rows of two sessions that nothing in the table tells apart.
#include <gmock/gmock.h>

#include <cmath>

#include "calib/compare/traits/sessions.h"
#include "planted.h"

namespace toftwin::compare {
namespace {

using testing::HasSubstr;

/// A line through 120 rows with errors of 1, the second session off by `offset`; whose a row is.
std::string doubtOf(unsigned seed, double offset, const std::function<bool(int row, Noise&)>& is_second) {
  Noise noise{seed};
  Columns x, y;
  for (int i = 0; i < 120; ++i) {
    x.push_back(0.1 * i);
    y.push_back(2.0 + 0.5 * x.back() + (is_second(i, noise) ? offset : 0.0) + noise(1.0));
  }
  const Model line = [&](std::span<const double> p, std::size_t i) { return p[0] + p[1] * x[i]; };
  const auto fit = fitBesideSessions(line, y, {0.0, 0.0}, x, {});
  return fit ? fit->doubt : "there is no fit";
}

TEST(Sessions, ThatTakeTurnsAreSaid) {
  for (unsigned seed = 1; seed <= 20; ++seed)
    EXPECT_THAT(doubtOf(seed, 3.0, [](int row, Noise&) { return row % 2 == 1; }), HasSubstr("neighbours err oppositely"));
}

TEST(Sessions, OfWhichOneBeginsIsSaid) {
  for (unsigned seed = 1; seed <= 20; ++seed)
    EXPECT_THAT(doubtOf(seed, 5.0, [](int row, Noise&) { return row >= 40; }), HasSubstr("there is a step before row"));
}

/// Mixed by chance, neighbours err oppositely by 3/√n in 0.13 %: in three of 20 runs in 3 · 10⁻⁶.
TEST(Sessions, ThatAreMixedAreSaidWhereTheyAreFarApart) {
  int in_heaps = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const std::string doubt = doubtOf(seed, 6.0, [](int, Noise& noise) { return noise.chance(0.5); });
    EXPECT_THAT(doubt, HasSubstr("rows may be of two sessions")) << seed;
    in_heaps += doubt.find("lies in two heaps") != std::string::npos;
  }
  EXPECT_GE(in_heaps, 18);
}

/// Wrongly in 1 % of runs at most: of 400, 99.9 % of all draws are 11 or fewer then (binomial).
TEST(Sessions, AreNotSeenInOne) {
  int doubted = 0;
  for (unsigned seed = 1; seed <= 400; ++seed) doubted += !doubtOf(seed, 0.0, [](int, Noise&) { return false; }).empty();
  EXPECT_LE(doubted, 11);
  RecordProperty("doubted", doubted);
}

/// 48 rows of eight sessions, with errors of 1 besides their sessions'. s of ν = 48 − 4 − 7 free rows is 1 − 1/4ν on the
/// mean, ± 1/√2ν each: 200 runs lie within three standard errors.
TEST(Sessions, TakeTheirOffsetsFromTheRowsThatTellTheResidual) {
  constexpr double kFree = 37.0, kSeries = 200.0;
  double mean = 0.0;
  for (unsigned seed = 1; seed <= kSeries; ++seed) {
    Noise noise{seed};
    Columns distance, error, session, offset;
    for (int i = 0; i < 8; ++i) offset.push_back(noise(2.0));
    for (int i = 0; i < 48; ++i) {
      distance.push_back(0.5 + 0.125 * i), session.push_back(i % 8);
      error.push_back(offset[static_cast<std::size_t>(i % 8)] + noise(1.0));
    }
    const auto traits = harmonicTraits(distance, error, std::vector{30e6}, std::vector{4}, {.session = session});
    ASSERT_TRUE(traits) << traits.error().message;
    EXPECT_EQ(traits->back().name, "residual");
    mean += traits->back().value / kSeries;
  }
  EXPECT_NEAR(mean, 1.0 - 0.25 / kFree, 3.0 / std::sqrt(2.0 * kFree * kSeries));
}

}  // namespace
}  // namespace toftwin::compare
