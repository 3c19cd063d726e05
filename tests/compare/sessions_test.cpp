// SPDX-License-Identifier: Apache-2.0
// Rows of two sessions that nothing in the table tells apart.
#include <gmock/gmock.h>

#include <cmath>

#include "calib/compare/traits/sessions.h"
#include "planted.h"

namespace toftwin::compare {
namespace {

using testing::HasSubstr;

/// A line through rows with errors of 1, the second session off by `offset`; whose a row is.
std::string doubtOf(unsigned seed, double offset, const std::function<bool(int row, Noise&)>& is_second, int rows = 120) {
  Noise noise{seed};
  Columns x, y;
  for (int i = 0; i < rows; ++i) {
    x.push_back(0.1 * i);
    y.push_back(2.0 + 0.5 * x.back() + (is_second(i, noise) ? offset : 0.0) + noise(1.0));
  }
  const Model line = [&](std::span<const double> p, std::size_t i) { return p[0] + p[1] * x[i]; };
  const auto fit = fitBesideSessions(line, y, {0.0, 0.0}, x, {});
  return fit ? fit->doubt : "there is no fit";
}

double widthOf(const Trait& one) { return one.high - one.low; }

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

/// The last of 240 rows is off by 10 σ: a step before the last five is seen in 1 % of runs at most, as in rows that are not
/// odd. Of 100, 99.9 % of all draws are 5 or fewer then (binomial).
TEST(Sessions, AreNotSeenInOneOddRowAtTheEnd) {
  int steps = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const auto doubt = doubtOf(seed, 10.0, [](int row, Noise&) { return row == 239; }, 240);
    steps += doubt.find("there is a step") != std::string::npos;
  }
  EXPECT_LE(steps, 5);
}

/// Ten rows at an end, without the oddest of them still nine, are seen in 95 % of runs at least: 99.7 % of draws of 40 are
/// 34 or more then.
TEST(Sessions, OfFewRowsAtAnEndAreSaid) {
  int said = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    said += !doubtOf(seed, 6.0, [](int row, Noise&) { return row >= 110; }).empty();
    said += !doubtOf(seed, 6.0, [](int row, Noise&) { return row < 10; }).empty();
  }
  EXPECT_GE(said, 34);
}

/// Three sessions one after the other from a corner's edge on, which differ by more than what falls from there: whatever
/// offsets they have, the same is told.
TEST(Sessions, AreNoPartOfWhereACornersFitBegins) {
  const auto cornerOf = [](Noise noise, double offset_mm) {
    Columns x = evenly(0.0, 1.2, 150), session, error;
    const Columns offset{noise(offset_mm), noise(offset_mm), noise(offset_mm)};
    for (std::size_t i = 0; i < x.size(); ++i) {
      session.push_back(static_cast<double>(i / 50));
      error.push_back(40.0 * std::exp(-x[i] / 0.25) + offset[i / 50] + noise(1.0));
    }
    return cornerTraits(x, error, session);
  };
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const auto with = cornerOf(Noise{seed}, 100.0), without = cornerOf(Noise{seed}, 0.0);
    ASSERT_TRUE(with && without) << seed;
    const Trait &one = (*with)[1], &other = (*without)[1];
    EXPECT_NEAR(one.value, other.value, 0.01 * widthOf(other)) << "reach";
  }
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

/// Ten readings at each of so many speeds, which share what they are off by there.
AtPlaceOfSession atSpeeds(int speeds, const std::function<double(int speed, int reading)>& session) {
  Noise noise{1};
  AtPlaceOfSession rows;
  for (int i = 0; i < speeds; ++i) {
    const double off = noise(1.0);
    for (int k = 0; k < 10; ++k) {
      rows.x.push_back(0.2 * i), rows.session.push_back(session(i, k));
      rows.y.push_back(7.5 * rows.x.back() + 3.0 * rows.session.back() + off + noise(0.3));
    }
  }
  return rows;
}

/// Six speeds tell a slope by how they differ, be there a column of sessions or not. Errors are the same, but for the
/// sessions': what differs is how the two fits count degrees of freedom, and what they make of the own errors of rows.
TEST(Sessions, LeaveRowsOfOnePlaceTogether) {
  const auto of_two = atSpeeds(6, [](int, int reading) { return reading % 2; }),
             of_one = atSpeeds(6, [](int, int) { return 0.0; });
  const auto told = motionTraits(of_two.x, of_two.y, of_two.session), without = motionTraits(of_one.x, of_one.y);
  ASSERT_TRUE(told && without);
  EXPECT_NEAR(widthOf(told->front()), widthOf(without->front()), 0.2 * widthOf(without->front()))
      << "each session has as many rows of each speed, of the same errors";
  EXPECT_NEAR(told->front().value, without->front().value, 0.01 * widthOf(without->front()));
}

TEST(Sessions, ThatHaveAllPlacesOfTheirOwnLeaveTooFew) {
  const auto doubt = [](int speeds) {
    const auto rows = atSpeeds(speeds, [=](int speed, int) { return 2 * speed / speeds; });
    const auto told = motionTraits(rows.x, rows.y, rows.session);
    return told ? told->front().doubt : "not told";
  };
  EXPECT_THAT(doubt(4), HasSubstr("its 40 rows have 4 different values")) << "two of a line and one of the sessions";
  EXPECT_EQ(doubt(6), "");
}

/// Rows of the second session have no error: the rest is told as without the column.
TEST(Sessions, OfWhichOneIsLeftAreNone) {
  auto rows = atSpeeds(6, [](int, int reading) { return reading % 2; });
  for (std::size_t i = 1; i < rows.y.size(); i += 2) rows.y[i] = std::nan("");
  const auto told = motionTraits(rows.x, rows.y, rows.session), without = motionTraits(rows.x, rows.y);
  ASSERT_TRUE(told && without);
  EXPECT_EQ(told->front().low, without->front().low);
  EXPECT_EQ(told->front().high, without->front().high);
  EXPECT_EQ(told->front().n, 6u);
}

}  // namespace
}  // namespace toftwin::compare
