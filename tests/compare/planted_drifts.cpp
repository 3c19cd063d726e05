// SPDX-License-Identifier: Apache-2.0
// Drifts that are planted, for coverage_test.cpp.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "planted.h"

namespace toftwin::compare {
namespace {

Traits traitsOf(const Result<DriftTraits>& drift) {
  if (!drift) return drift.error();
  return drift->traits;
}

/// A quarter of an hour of a value every 10 s: 8 mm (1 − e^(−t/τ)), 0.3 mm of noise.
Planted shortDrift(double tau) {
  const auto f = [tau](double t) { return 8.0 - 8.0 * std::exp(-t / tau); };
  Planted one{fmt::format("drift over 890 s, τ = {:.0f} s", tau),
              {{"drift", f(890.0)}, {"time constant", tau}},
              [f](Noise& noise) {
                const Columns t = evenly(0.0, 890.0, 90);
                return traitsOf(driftTraits(t, noisy(t, 0.3, noise, f)));
              }};
  // In a third of runs it is straight within the noise, and a ramp is chosen: right, without a time constant.
  if (tau > 890.0) one.truth.erase("time constant");
  return one;
}

/// An hour of a value every 20 s, 0.3 mm of noise.
Planted drift(std::string name, Truth truth, std::function<double(double)> f) {
  return {std::move(name), std::move(truth), [f](Noise& noise) {
            const Columns t = evenly(0.0, 3600.0, 181);
            return traitsOf(driftTraits(t, noisy(t, 0.3, noise, f)));
          }};
}

/// The standard plan's block of warming up: fourteen captures from two minutes after power-on.
Planted ofThePlan(const char* of, double sigma, std::function<double(double)> f) {
  return {fmt::format("drift, 14 captures, {}", of), {{"drift", f(1095.0) - f(120.0)}}, [=](Noise& noise) {
            const Columns t = evenly(120.0, 1095.0, 14);
            return traitsOf(driftTraits(t, noisy(t, sigma, noise, f)));
          }};
}

}  // namespace

std::vector<Planted> plantedDrifts() {
  const auto exponential = [](double t) { return 8.0 * std::exp(-t / 600.0); };
  std::vector<Planted> rows;
  rows.push_back(drift("drift, one exponential",
                       {{"drift", exponential(3600) - exponential(0)}, {"time constant", 600.0}},
                       exponential));
  const auto two = [](double t) { return 9.0 * std::exp(-t / 100.0) + 6.0 * std::exp(-t / 1200.0); };
  rows.push_back(drift("drift, two exponentials", {{"drift", two(3600) - two(0)}}, two));
  rows.push_back(drift("drift, ramp", {{"drift", 1.8}, {"slope", 5e-4}}, [](double t) { return 5e-4 * t; }));
  rows.push_back(drift("drift, step", {{"step", 2.0}}, [](double t) { return t > 1510.0 ? 2.0 : 0.0; }));
  for (const double tau : {30.0, 50.0, 60.0, 150.0, 600.0, 1500.0}) rows.push_back(shortDrift(tau));
  rows.push_back(
      {"drift, errors that go on (0.5)", {{"drift", exponential(3600) - exponential(0)}}, [=](Noise& noise) {
         const Columns t = evenly(0.0, 3600.0, 181);
         Columns y;
         double e = noise(0.3);
         for (const double one : t) {
           y.push_back(exponential(one) + e);
           e = 0.5 * e + noise(0.3 * std::sqrt(0.75));
         }
         return traitsOf(driftTraits(t, y));
       }});
  // The stand-in's and the Kinect v2's warming up.
  rows.push_back(ofThePlan("60 and 600 s", 0.02,
                           [](double t) { return -4.0 * std::exp(-t / 60.0) - 4.0 * std::exp(-t / 600.0); }));
  rows.push_back(ofThePlan("200 and 400 s", 0.05,
                           [](double t) { return 4.47 * std::exp(-t / 200.0) - 8.94 * std::exp(-t / 400.0); }));
  return rows;
}

}  // namespace toftwin::compare
