// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace toftwin::sim {
namespace {

double normalDistribution(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

TEST(Random, NormalIsTheInverseDistributionOfItsBits) {
  // Φ(normal(bits)) must give the bits' number back; in the tails compare what is left beyond.
  double worst_centre = 0.0, worst_tail = 0.0;
  for (std::uint64_t i = 0; i < (1u << 20); ++i) {
    const auto bits = static_cast<std::uint32_t>(i * 4093 + 17);
    const double u =
        (static_cast<double>(static_cast<std::int32_t>(bits)) + 0.5) * 0x1p-31;  // (−1, 1)
    const auto z = static_cast<double>(Random::normalFromBits(bits));
    worst_centre = std::max(worst_centre, std::abs(2.0 * normalDistribution(z) - 1.0 - u));
    const double beyond = (1.0 - std::abs(u)) / 2.0;
    worst_tail = std::max(worst_tail, std::abs(normalDistribution(-std::abs(z)) / beyond - 1.0));
  }
  EXPECT_LT(worst_centre, 3e-7);  // a few roundings to float
  EXPECT_LT(worst_tail, 1e-4);    // relative error of the tail's probability: 2e-5 sigma at 5 sigma
}

TEST(Random, NormalReachesFarAndStaysFinite) {
  for (std::uint32_t bits : {0u, 0x7FFFFFFFu, 0x80000000u, 0xFFFFFFFFu}) {
    EXPECT_TRUE(std::isfinite(Random::normalFromBits(bits))) << bits;
  }
  EXPECT_GT(Random::normalFromBits(0x7FFFFFFFu), 6.0F);
  EXPECT_LT(Random::normalFromBits(0x80000000u), -6.0F);
  EXPECT_EQ(Random::normalFromBits(5u), -Random::normalFromBits(~5u));
}

// The image kernel is compiled for several instruction sets; whichever runs must give the same
// bits.
TEST(Random, WholeRowsAreTheSameBitsAsSinglePixels) {
  const Random::Draw draw = Random{3, 1, 4}.draw(1);
  std::vector<float> row(10007);  // some 34 of them in the tails
  fillNormals(draw, 77, row);
  for (std::uint32_t i = 0; i < row.size(); ++i) ASSERT_EQ(row[i], draw.normal(77 + i)) << i;
}

/// √n D of Kolmogorov and Smirnov, n = 1e6, against the normal distribution: false alarm 1e-6 above 2.69.
double deviationFromNormal(std::vector<float> z) {
  std::sort(z.begin(), z.end());
  double largest = 0.0;
  const double n = static_cast<double>(z.size());
  for (std::size_t i = 0; i < z.size(); ++i) {
    const double expected = normalDistribution(static_cast<double>(z[i]));
    largest = std::max({largest, std::abs(expected - static_cast<double>(i) / n),
                        std::abs(expected - static_cast<double>(i + 1) / n)});
  }
  return largest * std::sqrt(n);
}

TEST(Random, NormalsOfAnImagePassKolmogorovSmirnov) {
  for (std::uint64_t seed : {1u, 2u, 3u}) {
    const Random::Draw draw = Random{seed, 7, 9}.draw(0);
    std::vector<float> z(1'000'000);
    for (std::uint32_t i = 0; i < z.size(); ++i) z[i] = draw.normal(i);
    EXPECT_LT(deviationFromNormal(std::move(z)), 2.69) << "seed " << seed;
  }
}

/// The second number, the sum and the difference of both, too: in all directions alike, as only independent
/// normals are.
TEST(Random, BothOfTwoPassKolmogorovSmirnovInEveryDirection) {
  for (std::uint64_t seed : {1u, 2u, 3u}) {
    const Random::Draw draw = Random{seed, 7, 9}.draw(0);
    std::array<std::vector<float>, 4> z;
    for (std::uint32_t i = 0; i < 1'000'000; ++i) {
      const Random::Two two = draw.two(i);
      z[0].push_back(two.first);
      z[1].push_back(two.second);
      z[2].push_back((two.first + two.second) * 0.70710678F);
      z[3].push_back((two.first - two.second) * 0.70710678F);
    }
    for (std::size_t i = 0; i < z.size(); ++i)
      EXPECT_LT(deviationFromNormal(std::move(z[i])), 2.69) << "seed " << seed << ", direction " << i;
  }
}

/// r² / 2 of bits is −ln u, to what the polynomials promise, and the angle is that of its bits.
TEST(Random, TwoLieOnTheCircleOfTheirBits) {
  for (std::uint64_t i = 0; i < (1u << 18); ++i) {
    const auto bits = static_cast<std::uint32_t>(i * 16381 + 3);
    const Random::Two z = Random::twoFromBits(bits, static_cast<std::uint32_t>(i * 40503 * 65537));
    const double r2 = std::pow(static_cast<double>(z.first), 2) + std::pow(static_cast<double>(z.second), 2);
    const double u = (static_cast<double>(bits >> 1) + 0.5) * 0x1p-31;
    ASSERT_NEAR(r2, -2.0 * std::log(u), 1e-5 + 4e-6 * r2) << bits;
  }
  EXPECT_GT(Random::twoFromBits(0, 0).first, 6.6F);
  EXPECT_TRUE(std::isfinite(Random::twoFromBits(0xFFFFFFFFu, 0xFFFFFFFFu).second));
}

/// Correlation of n pairs; with independent normals its standard deviation is 1/√n.
template <class First, class Second>
double correlation(std::uint32_t n, const First& first, const Second& second) {
  double sum = 0.0;
  for (std::uint32_t i = 0; i < n; ++i)
    sum += static_cast<double>(first(i)) * static_cast<double>(second(i));
  return sum / n;
}

// Every part of the key must matter, and neighbours must not be alike: 5 standard errors, 6e-7
// each.
TEST(Random, NeighboursFramesEffectsSeedsAndDrawsAreIndependent) {
  constexpr std::uint32_t kPixels = 400'000;
  const double bound = 5.0 / std::sqrt(static_cast<double>(kPixels));
  const Random::Draw base = Random{1, 1, 1}.draw(0);
  const auto of = [](const Random::Draw& draw) {
    return [draw](std::uint32_t i) { return draw.normal(i); };
  };
  EXPECT_LT(std::abs(correlation(kPixels, of(base), of(Random{2, 1, 1}.draw(0)))), bound) << "seed";
  EXPECT_LT(std::abs(correlation(kPixels, of(base), of(Random{1, 2, 1}.draw(0)))), bound)
      << "frame";
  EXPECT_LT(std::abs(correlation(kPixels, of(base), of(Random{1, 1, 2}.draw(0)))), bound)
      << "effect";
  EXPECT_LT(std::abs(correlation(kPixels, of(base), of(Random{1, 1, 1}.draw(1)))), bound) << "draw";
  for (std::uint32_t step : {1u, 2u, 352u, 512u, 65536u}) {
    EXPECT_LT(std::abs(correlation(kPixels, of(base),
                                   [&](std::uint32_t i) { return base.normal(i + step); })),
              bound)
        << step << " pixels on";
  }
}

/// Of products of standard normals: 5 standard errors, 6e-7 each. The squares' correlation has (z² − 1)/√2.
TEST(Random, TwoAreIndependentOfEachOtherOfTheirNeighboursAndOfOtherDraws) {
  constexpr std::uint32_t kPixels = 1'000'000;
  const double bound = 5.0 / std::sqrt(static_cast<double>(kPixels));
  const Random::Draw base = Random{1, 1, 1}.draw(0), other = Random{1, 2, 1}.draw(0);
  const auto first = [&](std::uint32_t i) { return base.two(i).first; };
  const auto second = [&](std::uint32_t i) { return base.two(i).second; };
  const auto squared = [](const auto& of) {
    return [of](std::uint32_t i) { return (of(i) * of(i) - 1.0F) * 0.70710678F; };
  };
  const auto correlates = [&](const auto& a, const auto& b) { return std::abs(correlation(kPixels, a, b)); };
  EXPECT_LT(correlates(first, second), bound);
  EXPECT_LT(correlates(squared(first), squared(second)), bound);
  EXPECT_LT(correlates(first, squared(second)), bound);
  EXPECT_LT(correlates(first, [&](std::uint32_t i) { return base.normal(i); }), bound);
  EXPECT_LT(correlates(first, [&](std::uint32_t i) { return other.two(i).first; }), bound);
  EXPECT_LT(correlates(second, [&](std::uint32_t i) { return other.two(i).second; }), bound);
  for (std::uint32_t step : {1u, 2u, 512u}) {
    const auto first_there = [&](std::uint32_t i) { return base.two(i + step).first; };
    const auto second_there = [&](std::uint32_t i) { return base.two(i + step).second; };
    EXPECT_LT(correlates(first, first_there), bound) << step << " pixels on";
    EXPECT_LT(correlates(second, second_there), bound) << step << " pixels on";
    EXPECT_LT(correlates(first, second_there), bound) << step << " pixels on";
    EXPECT_LT(correlates(squared(first), squared(first_there)), bound) << step << " pixels on";
  }
}

TEST(Random, SwappingSeedAndFrameIsAnotherDraw) {
  EXPECT_NE((Random{1, 2, 3}.draw(0).bits(0)), (Random{2, 1, 3}.draw(0).bits(0)));
  EXPECT_NE((Random{1, 2, 3}.draw(0).bits(0)), (Random{1, 3, 2}.draw(0).bits(0)));
}

TEST(Random, EffectsOfAModelHaveDifferentKeys) {
  EXPECT_NE(effectKey("read_noise", 0), effectKey("read_noise", 1));
  EXPECT_NE(effectKey("read_noise", 1), effectKey("shot_noise", 1));
}

struct Moments {
  double mean = 0.0, variance = 0.0;
};

Moments poissonMoments(float mean, std::uint32_t count) {
  std::vector<float> draws(count, mean);
  poisson(Random{11, 0, 0}.draw(0), 0, draws);
  Moments moments;
  for (float draw : draws) moments.mean += static_cast<double>(draw) / count;
  for (float draw : draws)
    moments.variance += std::pow(static_cast<double>(draw) - moments.mean, 2) / count;
  return moments;
}

// Mean and variance within 5 standard errors (variance of a Poisson sample variance: (λ + 2λ²)/n),
// seed 11.
TEST(Poisson, HasItsMeanAsVarianceAtEveryMean) {
  constexpr std::uint32_t kCount = 400'000;
  for (float lambda : {0.01F, 0.5F, 3.0F, 31.9F, 32.1F, 500.0F, 1e5F, 1e7F}) {
    const double mean = static_cast<double>(lambda);
    const Moments moments = poissonMoments(lambda, kCount);
    EXPECT_NEAR(moments.mean, mean, 5.0 * std::sqrt(mean / kCount)) << lambda;
    EXPECT_NEAR(moments.variance, mean, 5.0 * std::sqrt((mean + 2.0 * mean * mean) / kCount) + 0.1)
        << lambda;
  }
}

/// Largest difference of the empirical and the Poisson distribution function.
double distanceFromPoisson(float lambda, std::uint32_t count) {
  std::vector<float> draws(count, lambda);
  poisson(Random{12, 0, 0}.draw(0), 0, draws);
  std::vector<double> histogram(400, 0.0);
  for (float draw : draws) histogram[static_cast<std::size_t>(draw)] += 1.0 / count;
  double probability = std::exp(-static_cast<double>(lambda)), expected = probability,
         seen = histogram[0], worst = 0.0;
  for (std::size_t k = 1;; ++k) {
    worst = std::max(worst, std::abs(seen - expected));
    if (k == histogram.size()) return worst;
    probability *= static_cast<double>(lambda) / static_cast<double>(k);
    expected += probability;
    seen += histogram[k];
  }
}

// √n D < 2.69 with n = 1e6 is false in fewer than 1 of 1e6 (less for a discrete distribution).
// Seed 12.
TEST(Poisson, IsExactBelowTheThreshold) {
  for (float lambda : {0.1F, 1.0F, 8.0F, 31.9F}) {
    EXPECT_LT(1e3 * distanceFromPoisson(lambda, 1'000'000), 2.69) << lambda;
  }
}

TEST(Poisson, IsWithinTheStatedErrorAboveTheThreshold) {
  for (float lambda : {32.0F, 50.0F, 200.0F}) {
    EXPECT_LT(distanceFromPoisson(lambda, 1'000'000), 1.5e-3 + 2.69e-3) << lambda;
  }
}

TEST(Poisson, KeepsWhatIsNoNumberAndGivesNothingForNothing) {
  std::vector<float> means{std::numeric_limits<float>::quiet_NaN(), 0.0F, -3.0F, 1e20F};
  poisson(Random{1, 1, 1}.draw(0), 0, means);
  EXPECT_TRUE(std::isnan(means[0]));
  EXPECT_EQ(means[1], 0.0F);
  EXPECT_EQ(means[2], 0.0F);
  EXPECT_NEAR(means[3], 1e20F, 1e11F);
}

TEST(Poisson, DoesNotDependOnHowAnImageIsCutIntoPieces) {
  std::vector<float> whole(1000), first(300), second(700);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    whole[i] = static_cast<float>(i % 70);
    (i < 300 ? first[i] : second[i - 300]) = whole[i];
  }
  const Random::Draw draw = Random{5, 6, 7}.draw(8);
  poisson(draw, 0, whole);
  poisson(draw, 0, first);
  poisson(draw, 300, second);
  for (std::size_t i = 0; i < whole.size(); ++i)
    EXPECT_EQ(whole[i], i < 300 ? first[i] : second[i - 300]) << i;
}

}  // namespace
}  // namespace toftwin::sim
