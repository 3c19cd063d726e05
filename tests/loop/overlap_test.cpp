// SPDX-License-Identifier: Apache-2.0
// Series that were measured anew over the same reference, and by how much they differ.
#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <string>

#include <fmt/format.h>

#include "calib/loop/answer.h"
#include "calib/loop/discover.h"

namespace toftwin::loop {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

/// Series one after the other over 500 to 2500 mm, each with slow errors of its own of that deviation, and white noise of 1 mm.
std::string seriesCsv(int series, double own_mm, std::uint64_t seed) {
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal;
  std::string text = "reference_mm,measured_mm\n";
  for (int s = 0; s < series; ++s) {
    // A sum of four long waves of random phases has that deviation over many series.
    double phase[4];
    for (double& p : phase) p = 6.2831853 * std::uniform_real_distribution<double>{}(random);
    for (int i = 0; i < 300; ++i) {
      const double reference = 500.0 + 2000.0 * i / 299.0;
      double own = 0.0;
      for (int k = 0; k < 4; ++k) own += own_mm / std::sqrt(2.0) * std::sin(0.0031415927 * (k + 1) * reference + phase[k]);
      text += fmt::format("{:.3f},{:.3f}\n", reference, reference + 20.0 + own + normal(random));
    }
  }
  return text;
}

Discovery found(const std::string& csv) {
  auto readings = table::parseReadings(csv, {}, "t.csv");
  EXPECT_TRUE(readings) << readings.error().message;
  auto discovery = discover(*std::move(readings), {});
  EXPECT_TRUE(discovery);
  return *std::move(discovery);
}

TEST(Overlap, SaysWhatNoFunctionOfTheColumnsLeavesLessThan) {
  const Discovery d = found(seriesCsv(2, 8.0, 5));
  ASSERT_TRUE(d.overlap);
  EXPECT_GT(d.overlap->rows, 200u) << "but for those that are locked";
  // Two series of four waves each: eight random amplitudes, of which the deviation is known to a third.
  EXPECT_NEAR(d.overlap->least(), 8.0, 4.0);
  EXPECT_THAT(answerOf(d).cautions, Contains(HasSubstr("The reference begins anew at line 302: 2 series.")));
}

TEST(Overlap, OfSeriesThatAgreeIsTheirNoise) {
  const Discovery d = found(seriesCsv(3, 0.0, 6));
  ASSERT_TRUE(d.overlap);
  EXPECT_LT(d.overlap->least(), 1.2);
}

TEST(Overlap, IsNotSaidOfOneSeries) {
  const Discovery d = found(seriesCsv(1, 8.0, 7));
  EXPECT_FALSE(d.overlap);
  for (const std::string& caution : answerOf(d).cautions) EXPECT_EQ(caution.find("begins anew"), std::string::npos) << caution;
}

}  // namespace
}  // namespace toftwin::loop
