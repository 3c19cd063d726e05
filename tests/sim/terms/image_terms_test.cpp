// SPDX-License-Identifier: Apache-2.0
#include "sim/terms/image_terms.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include <toftwin/nan.h>

#include "tests/sim/terms/random_terms.h"

namespace toftwin::terms {
namespace {

constexpr int kWidth = 13, kHeight = 9;

double rangeAt(int x, int y) { return x == 4 && y == 3 ? kNaN : 500.0 + 271.3 * x + 17.1 * y; }
double amplitudeAt(int x, int y) { return 3900.0 - 31.7 * x - 340.0 * y; }

/// One covariate of each kind, a category, and one that nobody knows.
Field fieldOf(std::string_view name) {
  if (name == "column") return {Varies::Column, [](int x, int) { return x; }};
  if (name == "row") return {Varies::Row, [](int, int y) { return y; }};
  if (name == "radius") return {Varies::Place, [](int x, int y) { return 400.0 * std::hypot(x, y); }};
  if (name == "range" || name == "amplitude") return {Varies::Pixel, {}};
  return {};
}
Known knownAt(std::string_view name, int x, int y) {
  const Field field = fieldOf(name);
  if (field.at) return {field.at(x, y), {}};
  if (name == "range") return {rangeAt(x, y), {}};
  if (name == "amplitude") return {amplitudeAt(x, y), {}};
  if (name == "time") return {1234.5, {}};
  return name == "sensor" ? Known{kNaN, "tof0"} : Known{kNaN, {}};
}

std::string randomCovariate(RandomTerms& random) {
  const char* const names[] = {"column", "row", "radius", "range", "amplitude", "time", "nobody"};
  return names[random.oneIn(10) ? 6 : random.upTo(5)];
}

Term randomTerm(RandomTerms& random) {
  Term term{.quantity = Quantity::RangeMm, .coefficient = random.between(-20.0, 20.0)};
  for (int count = random.upTo(3); count > 0; --count) {
    const Basis basis = kBasisWords[static_cast<std::size_t>(random.upTo(kBasisWords.size() - 1))].basis;
    Argument of{{{1.0, basis == Basis::Level ? "sensor" : randomCovariate(random)}}};
    if (basis != Basis::Level && random.oneIn(3)) of.parts.push_back({random.weight(), randomCovariate(random)});
    term.factors.push_back(random.factor(basis, std::move(of), random.oneIn(2) ? 0.0 : 500.0, 4000.0));
  }
  return term;
}

double magnitudeAt(const std::vector<Term>& terms, int x, int y) {
  double sum = 0.0;
  for (const Term& term : terms) {
    const double value = valueOf(term, [&](std::string_view name) { return knownAt(name, x, y); });
    if (!std::isnan(value)) sum += std::abs(value);
  }
  return sum;
}

TEST(ImageTerms, OfRandomTermsAreTheSumOfTheTermsInEachPixel) {
  constexpr std::uint64_t kSeed = 45;
  RandomTerms random{kSeed};
  for (int i = 0; i < 3000; ++i) {
    std::vector<Term> terms;
    for (int count = 1 + random.upTo(2); count > 0; --count) terms.push_back(randomTerm(random));
    ImageTerms image{terms, kWidth, kHeight, fieldOf};
    image.setFrame([](std::string_view name) { return knownAt(name, 0, 0); });
    for (int y = 0; y < kHeight; ++y) {
      std::vector<double> sums(kWidth, 0.0);
      image.addRow(y, [&](std::size_t which, std::span<double> row) {
        for (int x = 0; x < kWidth; ++x) row[static_cast<std::size_t>(x)] = knownAt(image.perPixel()[which], x, y).number;
      }, sums);
      const std::vector<int> columns{1, 4, 5, 12};
      std::vector<double> some(columns.size(), 0.0);
      image.addAt(columns, y, [&](std::size_t which, std::span<double> row) {
        for (std::size_t k = 0; k < row.size(); ++k) row[k] = knownAt(image.perPixel()[which], columns[k], y).number;
      }, some);
      for (std::size_t k = 0; k < columns.size(); ++k) ASSERT_EQ(some[k], sums[static_cast<std::size_t>(columns[k])]);
      for (int x = 0; x < kWidth; ++x) {
        const double expected = sumOf(terms, [&](std::string_view name) { return knownAt(name, x, y); });
        ASSERT_NEAR(sums[static_cast<std::size_t>(x)], expected, 1e-14 * magnitudeAt(terms, x, y))
            << toText(terms[0]) << " at " << x << ", " << y << " (seed " << kSeed << ", set " << i << ")";
      }
    }
  }
}

TEST(ImageTerms, OfWhatTheFrameAloneKnowsAskForNoPixel) {
  ImageTerms image{{*parseTerm("range_mm += 2 * time * class(column, 2, 1)")}, kWidth, kHeight, fieldOf};
  EXPECT_TRUE(image.isStill());
  image.setFrame([](std::string_view name) { return knownAt(name, 0, 0); });
  std::vector<double> sums(kWidth, 0.0);
  image.addRow(0, [](std::size_t, std::span<double>) { FAIL(); }, sums);
  EXPECT_EQ(sums[0], 0.0);
  EXPECT_EQ(sums[1], 2469.0);
}

TEST(ImageTerms, FollowTheFrame) {
  ImageTerms image{{*parseTerm("range_mm += 2 * time")}, 1, 1, fieldOf};
  for (double time : {1.0, 5.0}) {
    image.setFrame([&](std::string_view) { return Known{time, {}}; });
    std::vector<double> sums(1, 0.0);
    image.addRow(0, {}, sums);
    EXPECT_EQ(sums[0], 2.0 * time);
  }
}

TEST(BasisOfMany, GivesTheSameBitsAsOne) {
  constexpr std::uint64_t kSeed = 46;
  RandomTerms random{kSeed};
  for (int i = 0; i < 2000; ++i) {
    const Basis basis = kBasisWords[static_cast<std::size_t>(i) % kBasisWords.size()].basis;
    if (basis == Basis::Level) continue;
    const Factor factor = random.factor(basis, {{{1.0, "x"}}}, -100.0, 2000.0);
    std::vector<double> x(101), product(x.size(), 1.0);
    for (double& value : x) value = random.oneIn(20) ? kNaN : random.between(-500.0, 2500.0);
    for (std::size_t k = 0; k < factor.numbers.size() && k < 60; ++k) x[k] = factor.numbers[k];
    BasisOfMany{factor}.multiply(x, product);
    for (std::size_t k = 0; k < x.size(); ++k) {
      const double one = valueOf(factor, x[k]);
      ASSERT_TRUE(product[k] == one || (std::isnan(one) && std::isnan(product[k])))
          << wordOf(basis).word << " at " << x[k] << ": " << product[k] << " instead of " << one << " (seed " << kSeed << ")";
    }
  }
}

}  // namespace
}  // namespace toftwin::terms
