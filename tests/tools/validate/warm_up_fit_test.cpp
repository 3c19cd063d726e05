// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/warm_up_fit.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace toftwin::validate {
namespace {

TEST(WarmUp, FindsTheEffectItWasMadeWith) {
  const sim::WarmUp effect{.fast = 3_mm, .fast_time = 60_s, .slow = 6_mm, .slow_time = 600_s};
  std::vector<double> time, depth;
  for (double t = 1.0; t < 1200.0; t += 2.0)
    time.push_back(t), depth.push_back(900.0 + effect.drift(t * second).in(millimetre));
  const WarmUpFit fit = fitWarmUp(time, depth, 2);
  // The grid of time constants has steps of 15 %; between them 2 % of the smaller amplitude can
  // remain.
  EXPECT_LT(fit.rms_mm, 0.06);
  for (const double t : {5.0, 100.0, 700.0})
    EXPECT_NEAR(fit.depth_mm(t), 900.0 + effect.drift(t * second).in(millimetre), 0.2);
}

TEST(WarmUp, WithoutExponentialsIsTheMean) {
  const WarmUpFit fit = fitWarmUp(std::vector<double>{1, 2, 3}, std::vector<double>{10, 20, 30}, 0);
  EXPECT_NEAR(fit.depth_mm(7.0), 20.0, 1e-12);
  EXPECT_NEAR(fit.rms_mm, std::sqrt(200.0 / 3.0), 1e-12);
}

}  // namespace
}  // namespace toftwin::validate
