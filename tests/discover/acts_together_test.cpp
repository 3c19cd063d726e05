// SPDX-License-Identifier: Apache-2.0
// Covariates that act together, and how fast one changes.
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>

#include "calib/discover/campaign/captures/temperature_rates.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::AnyOf;
using testing::Contains;
using testing::HasSubstr;

/// A warm lens: late by temperature times the square of the radius.
TEST_F(Searched, WhatGrowsWithTwoThingsGoesWithBoth) {
  simulate("", [](sim::RangeImage& image, const Moment& moment, const CameraInfo& camera, std::uint64_t) {
    double warm = 0.0;
    for (const NamedTemperature& one : moment.temperatures)
      if (one.where == "sensor") warm = one.value.in(celsius) - 23.0;
    for (int y = 0; y < image.range_m.height(); ++y)
      for (int x = 0; x < image.range_m.width(); ++x) {
        const double radius = std::hypot(x - camera.cx, y - camera.cy) / 15.0;
        image.range_m(x, y) += static_cast<float>(2e-3 * warm * radius * radius);
      }
  });
  const CampaignFinding finding = search(job());
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  const auto& covariates = finding.effects.front().found.covariates;
  EXPECT_THAT(covariates, Contains("radius_px")) << verdictOf(finding);
  EXPECT_THAT(covariates,
              Contains(AnyOf("temperature_sensor_c", "temperature_illumination_c", "time_s")))
      << verdictOf(finding);
}

/// One error over the radius, another over the amplitude: neither grows with the other.
TEST_F(Searched, WhatTwoThingsDoEachByItselfIsNoProduct) {
  simulate("", [](sim::RangeImage& image, const Moment&, const CameraInfo& camera, std::uint64_t) {
    for (int y = 0; y < image.range_m.height(); ++y)
      for (int x = 0; x < image.range_m.width(); ++x) {
        const double radius = std::hypot(x - camera.cx, y - camera.cy) / 15.0;
        const double bright = static_cast<double>(image.amplitude(x, y)) / 5e4;
        if (std::isfinite(bright)) image.range_m(x, y) += static_cast<float>(8e-3 * radius * radius + 4e-3 * bright);
      }
  });
  const CampaignFinding finding = search(job());
  ASSERT_EQ(finding.effects.size(), 2U) << verdictOf(finding);
  for (const FoundEffect& one : finding.effects) {
    const auto& covariates = one.found.covariates;
    const bool has_both =
        std::ranges::count(covariates, "radius_px") > 0 && std::ranges::count(covariates, "amplitude_e") > 0;
    EXPECT_FALSE(has_both) << one.found.name;
  }
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.9) << verdictOf(finding);
}

/// A camera that was switched off is at the same times as warm as it was, or as it is: two curves, not one.
TEST(TemperatureRates, AreOfOnePowerCycle) {
  std::vector<MeasuredCapture> captures(20);
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const double t = 60.0 * static_cast<double>(c % 10), first_c = c < 10 ? 24.0 : 31.0;
    captures[c].moment.since_power_on = t * second;
    captures[c].moment.temperatures = {{"sensor", (first_c + t / 60.0 * 0.5) * celsius}};
  }
  for (const auto& rates : temperatureRates(captures)) EXPECT_NEAR(rates.at(0).c_per_min, 0.5, 1e-9);
}

/// Cooling and warming by one exponential: at any time the slope is that of the curve, whatever the captures' spacing;
/// the room's is nobody's.
TEST(TemperatureRates, AreTheCurvesSlopes) {
  std::vector<MeasuredCapture> captures(30);
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const double t = 40.0 * static_cast<double>(c) + (c % 3 == 0 ? 5.0 : 0.0);
    captures[c].moment.since_power_on = t * second;
    captures[c].moment.temperatures = {{"sensor", (35.0 - 12.0 * std::exp(-t / 900.0)) * celsius}, {"room", 23_degC}};
  }
  const auto rates = temperatureRates(captures);
  for (std::size_t c = 0; c < captures.size(); ++c) {
    ASSERT_EQ(rates[c].size(), 1U);
    EXPECT_EQ(rates[c][0].covariate, "temperature_rate_sensor");
    const double t = captures[c].moment.since_power_on->in(second);
    // The third order that a parabola leaves out: (h/τ)²/3 of the slope, h the 160 s to the farthest of five.
    const double slope = 60.0 * 12.0 / 900.0 * std::exp(-t / 900.0);
    EXPECT_NEAR(rates[c][0].c_per_min, slope, slope * (160.0 / 900.0) * (160.0 / 900.0) / 3.0);
  }
  captures.resize(4);
  EXPECT_TRUE(std::isnan(temperatureRates(captures)[0][0].c_per_min)) << "too few";
}

/// Late by how fast the sensor warms: what its time constant is, its temperature says.
TEST_F(Searched, WhatGoesWithHowFastItWarmsIsTold) {
  simulate("", [](sim::RangeImage& image, const Moment& moment, const CameraInfo&, std::uint64_t) {
    for (const NamedTemperature& one : moment.temperatures) {
      if (one.where != "sensor") continue;
      const double c_per_min = (35.0 - one.value.in(celsius)) / 15.0;  // of tinyCamera
      for (float& range : image.range_m.pixels()) range += static_cast<float>(20e-3 * c_per_min);
    }
  });
  const CampaignFinding finding = search(job());
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  EXPECT_THAT(verdictOf(finding), HasSubstr("temperature_rate_sensor"));
}

}  // namespace
}  // namespace toftwin::discover
