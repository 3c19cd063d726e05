// SPDX-License-Identifier: Apache-2.0
// Of what explains the data about as well, which is chosen.
#include <gtest/gtest.h>

#include "calib/discover/shape_choice.h"

namespace toftwin::discover {
namespace {

const std::vector<double> kConstant(10, 10.0),
    kHardlyMore{11, 9, 11, 9, 11, 9, 11, 9, 11, 10}, kMore{15, 14, 15, 16, 15, 14, 15, 16, 15, 15};

/// Two numbers times a carrier, which change with a covariate or not; their gain in ten captures.
Explanation times(const char* carrier, std::vector<std::string> covariates,
                  const std::vector<double>& gains) {
  Explanation one{.covariates = std::move(covariates), .numbers = 2};
  one.fitted.group.terms.push_back({.carrier = carrier});
  for (const double gain : gains) one.gain.total += gain;
  one.gain.by_capture = gains;
  return one;
}
Explanation overLight(const std::vector<double>& gains) {
  return times("charge", {"ambient_klx", "charge"}, gains);
}

/// 1 ± 3 in χ² more than a constant charge; less than the error of that difference.
TEST(ShapeChoice, ACarrierChangesWithNothingUnlessThatExplainsMore) {
  EXPECT_EQ(choose({overLight(kHardlyMore), times("charge", {"charge"}, kConstant)}), 1U);
}

TEST(ShapeChoice, ACarrierChangesWithWhatExplainsMore) {
  EXPECT_EQ(choose({overLight(kMore), times("charge", {"charge"}, kConstant)}), 0U);
}

/// Stray light is a charge that goes with the exposure by itself.
TEST(ShapeChoice, ASimplerFormIsChosenIfItExplainsAsMuch) {
  Explanation stray = times("stray", {"stray"}, kConstant);
  stray.fitted.group.simpler_than = "charge";
  const auto overExposure = [](const auto& gains) { return times("charge", {"charge", "exposure_us"}, gains); };
  EXPECT_EQ(choose({overExposure(kHardlyMore), stray}), 1U);
  EXPECT_EQ(choose({overExposure(kMore), stray}), 0U);
}

/// A delay that is the same everywhere is no simpler form of a charge.
TEST(ShapeChoice, AnotherCarrierIsNoSimplerForm) {
  EXPECT_EQ(choose({overLight(kHardlyMore), times("delay", {"ambient_klx"}, kConstant)}), 0U);
}

}  // namespace
}  // namespace toftwin::discover
