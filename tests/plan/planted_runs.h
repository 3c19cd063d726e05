// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "calib/plan/run_traits.h"

/// A run whose cameras err as planted, and what is told of it.
namespace toftwin::plan {

inline constexpr double kFrequency_hz = 30e6, kPeriod_m = 299'792'458.0 / 2.0 / kFrequency_hz;
inline constexpr unsigned kSeed = 20261122;

/// 60 captures while B warms up (−8 mm, τ = 600 s) and A does not, 40 over distance with a wave of 5 mm four
/// times per period; noise 400 mm / amplitude; pixel 0 is invalid in B alone.
inline ComparedRun plantedRun() {
  std::mt19937_64 random{kSeed};
  std::normal_distribution<double> error{0.0, 0.1};
  ComparedRun run;
  run.frequency_hz = {std::vector{kFrequency_hz}, std::vector{kFrequency_hz}};
  for (int i = 0; i < 100; ++i) {
    const bool is_warming = i < 60;
    ComparedCapture one;
    one.pixels = 15;
    one.record.number = static_cast<std::size_t>(i);
    one.record.kind = is_warming ? "warm_up" : "distance";
    one.record.a.since_power_on_s = one.record.b.since_power_on_s = 60.0 * i;
    const double d_m = is_warming ? 1.5 : 0.5 + 0.1 * (i - 60);
    one.range_a_mm = 1000.0 * d_m + error(random);
    one.difference_mm = (is_warming ? -8.0 * (1.0 - std::exp(-60.0 * i / 600.0))
                                    : 5.0 * std::sin(8.0 * std::numbers::pi * d_m / kPeriod_m)) +
                        error(random);
    one.amplitude_a = 100.0 + 40.0 * i;
    one.noise_a_mm = 400.0 / one.amplitude_a * (1.0 + 0.2 * error(random));
    one.own[0].amplitude = one.amplitude_a, one.own[0].noise_mm = one.noise_a_mm;
    one.own[1].amplitude = std::nan("");
    one.own[0].range_mm = Image<float>(4, 4, static_cast<float>(one.range_a_mm));
    one.own[1].range_mm = Image<float>(4, 4, static_cast<float>(one.range_a_mm + one.difference_mm));
    one.thinned.valid_a = Image<float>(4, 4, 1.0F);
    one.thinned.valid_b = Image<float>(4, 4, 1.0F);
    one.thinned.valid_b[0] = 0.0F;
    run.captures.push_back(one);
  }
  return run;
}

inline const RunTrait* find(const RunTraits& all, std::string_view what, std::string_view of,
                            std::string_view name) {
  for (const RunTrait& one : all.traits) {
    if (one.what.starts_with(what) && one.of == of && one.trait.name == name) return &one;
  }
  return nullptr;
}

/// Within twice its interval's half: 3.9 standard errors, a false alarm of 1e-4 for each.
inline void expectNear(const RunTrait* found, double truth) {
  ASSERT_NE(found, nullptr);
  EXPECT_NEAR(found->trait.value, truth, found->trait.high - found->trait.low)
      << found->what << ' ' << found->trait.name;
}

}  // namespace toftwin::plan
