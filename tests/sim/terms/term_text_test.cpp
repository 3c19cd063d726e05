// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "sim/terms/term.h"
#include "tests/sim/terms/random_terms.h"

namespace toftwin::terms {
namespace {

using testing::HasSubstr;

/// The error of a text that is no term.
std::string problemOfText(std::string_view text) {
  const auto term = parseTerm(text);
  return term.ok() ? "read as " + toText(*term) : term.error().message;
}

TEST(TermText, OfRandomTermsIsReadBackToTheSameBits) {
  constexpr std::uint64_t kSeed = 20261129;
  RandomTerms random{kSeed};
  for (int i = 0; i < 20'000; ++i) {
    const Term term = random.term(kQuantityWords[static_cast<std::size_t>(i) % kQuantityWords.size()].quantity);
    const std::string text = toText(term);
    const auto again = parseTerm(text);
    ASSERT_TRUE(again.ok()) << again.error().message << " (seed " << kSeed << ", term " << i << ")";
    ASSERT_EQ(*again, term) << text << " (seed " << kSeed << ", term " << i << ")";
    ASSERT_EQ(toText(*again), text);
  }
}

TEST(TermText, IsWrittenAsPeopleWriteIt) {
  for (const char* text : {"range_mm += -5.95 * sine(range_mm, 1250) * decay(time_s, 400)",
                           "range_mm += 12.5 * level(sensor, 'tof0')",
                           "range_mm += 1.5 * class(column + row, 2, 1)",
                           "range_mm += 0.5 * curve(column - 2 * row, 0, 1, 5, -1)",
                           "range_mm += 1 * 'plate (mm)' * hat('it''s', -inf, 2, inf)",
                           "light_percent += 0.5 * square(15)",
                           "light_percent += 0.5 * mirror(3, 1.5, -2)",
                           "range_mm += 0.02 * around() * curve(amplitude_e, 500, 1, 2000, 0.2)",
                           "noise_mm += 3 * power(amplitude_e, -0.5)",
                           "charge_percent += 0.1"}) {
    const auto term = parseTerm(text);
    ASSERT_TRUE(term.ok()) << term.error().message;
    EXPECT_EQ(toText(*term), text);
  }
}

TEST(TermText, MayHaveBlanksAnywhereOrNowhere) {
  EXPECT_EQ(*parseTerm("range_mm+=-2*class(column+row,2,1)"),
            *parseTerm("  range_mm  +=  - 2 * class ( column  + row , 2 , 1 )  "));
}

TEST(TermText, ThatIsNoTermSaysWhatWasExpectedWhere) {
  EXPECT_EQ(problemOfText("range_mm += 3 * wobble(row)"),
            "term \"range_mm += 3 * wobble(row)\", character 17: expected one of power, log, decay, sine, cosine, "
            "sawtooth, step, sigmoid, hinge, bump, hat, curve, class, level, secant, tangent2, square, row_mean, "
            "column_mean, mirror, across, along, around, before, not \"wobble(row)\"");
  EXPECT_THAT(problemOfText("rnge_mm += 3"), HasSubstr("character 1: expected one of value, range_mm, "));
  EXPECT_THAT(problemOfText("range_mm = 3"), HasSubstr("character 10: expected \"+=\", not \"= 3\""));
  EXPECT_THAT(problemOfText("range_mm += row"), HasSubstr("character 13: expected a number, not \"row\""));
  EXPECT_THAT(problemOfText("range_mm += 3 * sine(row, 5"), HasSubstr("character 28: expected \")\", not the end"));
  EXPECT_THAT(problemOfText("range_mm += 3 * 'row"), HasSubstr("expected a closing '"));
  EXPECT_THAT(problemOfText("range_mm += 3 row"), HasSubstr("character 15: expected \"*\" or the end, not \"row\""));
  EXPECT_THAT(problemOfText(""), HasSubstr("not the end"));
  EXPECT_THAT(problemOfText("range_mm += 3 * 5"), HasSubstr("character 17: expected a covariate"));
  EXPECT_THAT(problemOfText("range_mm += 1e999"), HasSubstr("a number that a double can hold"));
}

TEST(TermText, ThatMeansNothingIsRefused) {
  EXPECT_THAT(problemOfText("range_mm += 3 * sine(row, 0)"),
              HasSubstr("character 17: sine needs a period other than 0"));
  EXPECT_THAT(problemOfText("range_mm += 3 * sine(row)"), HasSubstr("sine needs period: 1 number instead of 0"));
  EXPECT_THAT(problemOfText("range_mm += 3 * curve(row, 1, 2, 1, 3)"), HasSubstr("an x that ascends"));
  EXPECT_THAT(problemOfText("range_mm += 3 * class(row, 2, 2)"), HasSubstr("0 <= k < m"));
  EXPECT_THAT(problemOfText("range_mm += 3 * hat(row, 3, 2, 5)"), HasSubstr("a <= b <= c"));
  EXPECT_THAT(problemOfText("range_mm += inf"), HasSubstr("a coefficient must be finite"));
  EXPECT_THAT(problemOfText("range_mm += 3 * square(5)"), HasSubstr("square carries only light_percent"));
  EXPECT_THAT(problemOfText("light_percent += 3 * square(1.5)"), HasSubstr("a reach of whole pixels"));
  EXPECT_THAT(problemOfText("range_mm += 3 * around() * before()"), HasSubstr("one carrier at most"));
  EXPECT_THAT(problemOfText("range_mm += 3 * decay(row, inf)"), HasSubstr("decay needs finite numbers"));
}

TEST(TermText, ThatIsDamagedAnywhereIsATermOrAnError) {
  constexpr std::uint64_t kSeed = 7;
  RandomTerms random{kSeed};
  for (int i = 0; i < 20'000; ++i) {
    std::string text = toText(random.term(Quantity::RangeMm));
    const auto at = static_cast<std::size_t>(random.upTo(static_cast<int>(text.size()) - 1));
    if (random.oneIn(2)) text.erase(at, static_cast<std::size_t>(1 + random.upTo(4)));
    else text[at] = static_cast<char>(random.upTo(255));
    const auto term = parseTerm(text);
    if (term.ok()) EXPECT_TRUE(problemOf(*term).empty()) << text;
    else EXPECT_FALSE(term.error().message.empty());
  }
}

}  // namespace
}  // namespace toftwin::terms
