// SPDX-License-Identifier: Apache-2.0
// Of what explains the data about as well, which is chosen.
#include <gtest/gtest.h>

#include "calib/discover/shape_choice.h"

namespace toftwin::discover {
namespace {

/// A charge, and over what it changes; its gain in ten captures.
Explanation charge(std::vector<std::string> covariates, int numbers, std::vector<double> gains) {
  Explanation one{.covariates = std::move(covariates), .numbers = numbers};
  one.fitted.group.terms.push_back({.carrier = "charge"});
  for (const double gain : gains) one.gain.total += gain;
  one.gain.by_capture = std::move(gains);
  return one;
}

/// 1 ± 3 in χ² more than a constant charge; less than the error of that difference.
TEST(ShapeChoice, ACarrierChangesWithNothingUnlessThatExplainsMore) {
  const std::vector<double> constant(10, 10.0), hardly{11, 9, 11, 9, 11, 9, 11, 9, 11, 10};
  const std::vector<Explanation> all{charge({"ambient_klx", "charge"}, 2, hardly),
                                     charge({"charge"}, 2, constant)};
  ASSERT_TRUE(choose(all));
  EXPECT_EQ(*choose(all), 1U);
}

TEST(ShapeChoice, ACarrierChangesWithWhatExplainsMore) {
  const std::vector<double> constant(10, 10.0), more{15, 14, 15, 16, 15, 14, 15, 16, 15, 15};
  const std::vector<Explanation> all{charge({"ambient_klx", "charge"}, 2, more),
                                     charge({"charge"}, 2, constant)};
  ASSERT_TRUE(choose(all));
  EXPECT_EQ(*choose(all), 0U);
}

/// A delay that is the same everywhere is no simpler form of a charge.
TEST(ShapeChoice, AnotherCarrierIsNoSimplerForm) {
  const std::vector<double> constant(10, 10.0), hardly{11, 9, 11, 9, 11, 9, 11, 9, 11, 10};
  std::vector<Explanation> all{charge({"ambient_klx", "charge"}, 2, hardly), charge({"charge"}, 2, constant)};
  all[1].fitted.group.terms.front().carrier = "delay";
  all[1].covariates = {"ambient_klx"};
  ASSERT_TRUE(choose(all));
  EXPECT_EQ(*choose(all), 0U);
}

}  // namespace
}  // namespace toftwin::discover
