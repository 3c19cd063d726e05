// SPDX-License-Identifier: Apache-2.0
// Tables whose rows do not scatter as independent, equal ones: neighbours err alike, or some rows more than others;
// and what is not there.
#include <cmath>
#include <numbers>
#include <utility>

#include "planted.h"

namespace toftwin::compare {
namespace {

/// Two of a hundred readings wrap, each of which goes on with the next in 80 %.
Planted wrapsTogether() {
  return {"wraps that go on", {{"wrapped", 0.02}}, [](Noise& noise) {
            Columns e;
            bool wraps = noise.chance(0.02);
            for (int i = 0; i < 20'000; ++i) {
              e.push_back((wraps ? 1.5 : 0.0) + noise(0.02));
              if (noise.chance(0.2)) wraps = noise.chance(0.02);
            }
            return wrapTraits(e, 1.5);
          }};
}

std::vector<Planted> alikeOverDistance() {
  std::vector<Planted> rows;
  constexpr double kWave = 4.0 * std::numbers::pi * 30e6 / 299'792'458.0;
  for (const double rho : {0.5, 0.8}) {
    rows.push_back({"harmonics, rows that err alike (" + std::string{rho < 0.6 ? "0.5" : "0.8"} + ")",
                    {{"30 MHz, 1 per period", 4.0},
                     {"30 MHz, 4 per period", 6.0},
                     {"offset", 3.0 + 0.7 * 3.5},
                     {"scale", 0.7},
                     {"residual", 2.0}},
                    [=](Noise& noise) {
                      const Columns d = evenly(0.5, 6.5, 240);
                      const Columns e = alike(d, 2.0, rho, noise, [](double x) {
                        return 3.0 + 0.7 * x + 4.0 * std::cos(kWave * x + 1.0) +
                               6.0 * std::sin(4.0 * kWave * x - 0.4);
                      });
                      const std::vector<double> f{30e6};
                      const std::vector<int> orders{1, 2, 4};
                      return harmonicTraits(d, e, f, orders);
                    }});
  }
  rows.push_back(wrapsTogether());
  rows.push_back({"corner, rows that err alike (0.5)",
                  {{"at the edge", 40.0}, {"reach", 0.25}, {"far from it", -3.0}},
                  [](Noise& noise) {
                    const Columns x = evenly(0.0, 1.2, 150);
                    return cornerTraits(x, alike(x, 2.0, 0.5, noise, [](double d) {
                                          return -3.0 + 40.0 * std::exp(-d / 0.25);
                                        }));
                  }});
  return rows;
}

/// σ of so many ranges of a true one.
double sigmaOf(double truth, int ranges, Noise& noise) {
  double squares = 0.0;
  for (int i = 1; i < ranges; ++i) squares += std::pow(noise(truth), 2);
  return std::sqrt(squares / (ranges - 1));
}

std::vector<Planted> alikeOverLight() {
  std::vector<Planted> rows;
  rows.push_back({"motion, rows that err alike (0.5)", {{"per speed", 7.5}}, [](Noise& noise) {
                    const Columns v = evenly(-2.0, 2.0, 60);
                    return motionTraits(
                        v, alike(v, 3.0, 0.5, noise, [](double s) { return 1.0 + 7.5 * s; }));
                  }});
  rows.push_back({"motion, two sessions in turn", {{"per speed", 7.5}}, [](Noise& noise) {
                    const Columns v = evenly(-2.0, 2.0, 60);
                    Columns error;
                    for (std::size_t i = 0; i < v.size(); ++i)
                      error.push_back(1.0 + 7.5 * v[i] + (i % 2 == 0 ? 3.0 : 0.0) + noise(1.0));
                    return motionTraits(v, error);
                  }});
  // From σ² = 10 to 190: variances scatter in proportion to themselves.
  rows.push_back({"ambient, σ of 60 frames", {{"bias", 0.12}, {"noise²", 3.0}}, [](Noise& noise) {
                    const Columns klx = evenly(0.0, 60.0, 25);
                    Columns sigma;
                    for (const double e : klx) sigma.push_back(sigmaOf(std::sqrt(10.0 + 3.0 * e), 60, noise));
                    return ambientTraits(
                        klx, alike(klx, 1.0, 0.0, noise, [](double e) { return 2.0 + 0.12 * e; }), sigma);
                  }});
  const auto law = [](std::string name, Truth truth, double rho) {
    const double a = truth["floor"], b = truth["shot"], c = truth["read"];
    return Planted{std::move(name), std::move(truth), [=](Noise& noise) {
                     Columns order = evenly(0.0, 59.0, 60), signal;
                     for (const double i : order) signal.push_back(1000.0 * std::pow(10.0, -2.0 * i / 59.0));
                     Columns sigma = alike(order, std::sqrt(1.0 / 118.0), rho, noise, [&](double i) {
                       const double x = 1e-3 * signal[static_cast<std::size_t>(i)];
                       return 0.5 * std::log(a * a + b * b / x + c * c / (x * x));
                     });
                     for (double& one : sigma) one = std::exp(one);
                     return noiseLawTraits(signal, sigma);
                   }};
  };
  rows.push_back(law("noise law, rows that err alike (0.5)",
                     {{"floor", 2.0}, {"shot", 3.0}, {"read", 0.4}}, 0.5));
  const auto independent = [](std::string name, auto told) {
    return Planted{std::move(name),
                   {{"floor", 2.0}, {"shot", 3.0}, {"read", 0.4}, {"all parts together", std::sqrt(13.16)}},
                   [=](Noise& noise) {
                     Columns signal, sigma;
                     for (int i = 0; i < 60; ++i) {
                       const double x = std::pow(10.0, -2.0 * i / 59.0);
                       signal.push_back(1000.0 * x);
                       sigma.push_back(told(std::sqrt(4.0 + 9.0 / x + 0.16 / (x * x)), noise));
                     }
                     return noiseLawTraits(signal, sigma);
                   }};
  };
  rows.push_back(independent("noise law, σ of five readings",
                             [](double sigma, Noise& noise) { return sigmaOf(sigma, 5, noise); }));
  // As where each strength of light falls on another part of the image: no few readings.
  rows.push_back(independent("noise law, rows off by 40 %",
                             [](double sigma, Noise& noise) { return sigma * std::exp(noise(0.4)); }));
  rows.push_back(law("noise law without shot noise", {{"floor", 5.0}, {"shot", 0.0}, {"read", 0.2}}, 0.0));
  return rows;
}

std::vector<Planted> alikeOverTime() {
  std::vector<Planted> rows;
  rows.push_back({"drift, two steps", {{"first step", 2.0}, {"second step", -1.5}}, [](Noise& noise) -> Traits {
                    const Columns t = evenly(0.0, 3600.0, 181);
                    const auto drift = driftTraits(t, alike(t, 0.3, 0.0, noise, [](double s) {
                                                     return s > 2410.0 ? 0.5 : s > 1010.0 ? 2.0 : 0.0;
                                                   }));
                    if (!drift) return drift.error();
                    return drift->traits;
                  }});
  // A plate that turns, and a camera that sees all of its way 5 % too long.
  rows.push_back({"latency beside an error of the scale", {{"latency", 20.0}}, [](Noise& noise) {
                    const auto path = [](double s) { return s < 0.4 ? 0.5 * s : 0.4 - 0.5 * s; };
                    const Columns t = evenly(0.0, 1.0, 31);
                    Columns later;
                    for (const double one : t) later.push_back(one + 0.01);
                    return latencyTraits(
                        later, alike(later, 1e-3, 0.0, noise, [&](double s) { return 1.05 * path(s - 0.02); }),
                        t, alike(t, 1e-4, 0.0, noise, path));
                  }});
  return rows;
}

/// x at each of which `count` rows stand, and what they share there.
struct AtPlace {
  Columns x{}, y{};
};
AtPlace repeated(const Columns& places, int count, double shared, double own, Noise& noise,
                 const std::function<double(double)>& f) {
  AtPlace rows;
  for (const double place : places) {
    const double off = noise(shared);
    for (int i = 0; i < count; ++i) rows.x.push_back(place), rows.y.push_back(f(place) + off + noise(own));
  }
  return rows;
}

/// Readings of one place that share an error, and those of a place that share none.
std::vector<Planted> atPlaces() {
  std::vector<Planted> rows;
  for (const double shared : {1.0, 0.0}) {
    rows.push_back({shared > 0.0 ? "amplitude, twelve readings of each of five" : "amplitude, five times twelve rows",
                    {{"per decade", -4.0}},
                    [=](Noise& noise) {
                      const auto at = repeated({100, 200, 400, 800, 1600}, 12, shared, 0.5, noise, [](double a) {
                        return 12.0 - 4.0 * std::log10(a);
                      });
                      return amplitudeTraits(at.x, at.y);
                    }});
  }
  rows.push_back({"motion, ten readings of each of five speeds", {{"per speed", 7.5}}, [](Noise& noise) {
                    const auto at = repeated({0.1, 0.3, 0.5, 0.8, 1.2}, 10, 0.8, 0.4, noise,
                                             [](double v) { return 1.0 + 7.5 * v; });
                    return motionTraits(at.x, at.y);
                  }});
  rows.push_back({"harmonics, five readings of each of 25 distances",
                  {{"30 MHz, 4 per period", 6.0}, {"offset", 3.0}, {"scale", 0.0}},
                  [](Noise& noise) {
                    constexpr double kWave = 4.0 * std::numbers::pi * 30e6 / 299'792'458.0;
                    const auto at = repeated(evenly(0.5, 5.0, 25), 5, 1.5, 0.5, noise, [](double d) {
                      return 3.0 + 6.0 * std::cos(4.0 * kWave * d + 0.7);
                    });
                    return harmonicTraits(at.x, at.y, std::vector{30e6}, std::vector{4, 2});
                  }});
  return rows;
}

/// So many readings at a step of ambient light, whose errors are 2 + 0.12 E and scatter by `sigma`.
struct LightStep {
  double klx = 0.0;
  int readings = 0;
  double sigma = 1.0;
};
Planted ambientSteps(const char* name, Truth truth, const std::vector<LightStep>& steps) {
  return {name, std::move(truth), [steps](Noise& noise) {
            Columns klx, error, sigma;
            for (const LightStep& step : steps) {
              for (int i = 0; i < step.readings; ++i) {
                klx.push_back(step.klx), error.push_back(2.0 + 0.12 * step.klx + noise(step.sigma));
                sigma.push_back(sigmaOf(std::sqrt(90.0 + 0.5 * step.klx), 400, noise));
              }
            }
            return ambientTraits(klx, error, sigma);
          }};
}

/// Steps of which one has many readings and another few, or one that scatters more than another.
std::vector<Planted> unevenSteps() {
  return {ambientSteps("ambient, steps of 2 and 30 readings", {{"bias", 0.12}, {"noise²", 0.5}},
                       {{0.0, 2}, {12.0, 30}, {24.0, 30}, {36.0, 30}, {48.0, 30}, {60.0, 2}}),
          ambientSteps("ambient, six steps with errors of 0.6 to 1.8 mm", {{"bias", 0.12}},
                       {{0.0, 10, 0.6}, {5.0, 10, 0.675}, {10.0, 10, 0.75}, {20.0, 10, 0.9}, {40.0, 10, 1.2}, {80.0, 10, 1.8}})};
}

/// Rows that scatter more here than there.
Columns uneven(const Columns& x, Noise& noise, const std::function<double(double)>& f,
               const std::function<double(double)>& sigma) {
  Columns y;
  for (const double one : x) y.push_back(f(one) + noise(sigma(one)));
  return y;
}

std::vector<Planted> unevenly() {
  std::vector<Planted> rows;
  rows.push_back({"amplitude, noise as 1/A", {{"per decade", -4.0}}, [](Noise& noise) {
                    Columns a;
                    for (int i = 0; i < 60; ++i) a.push_back(std::exp(noise.uniform(3.0, 8.0)));
                    return amplitudeTraits(a, uneven(
                                                  a, noise, [](double one) { return 12.0 - 4.0 * std::log10(one); },
                                                  [](double one) { return 200.0 / one; }));
                  }});
  // As of a camera that is noisier while it is cold, and of light that two walls send to and fro.
  const auto warmer = [](double t) { return 8.0 * std::exp(-t / 600.0); };
  rows.push_back({"drift, noise of 0.9 to 0.3 mm",
                  {{"drift", warmer(3600.0) - warmer(0.0)}, {"time constant", 600.0}},
                  [=](Noise& noise) -> Traits {
                    const Columns t = evenly(0.0, 3600.0, 181);
                    const auto drift =
                        driftTraits(t, uneven(t, noise, warmer, [](double s) { return 0.9 - 0.6 * s / 3600.0; }));
                    if (!drift) return drift.error();
                    return drift->traits;
                  }});
  // Of 40 rows three are noisy.
  for (const int count : {150, 40}) {
    rows.push_back({count == 150 ? "corner, noise of 8 mm at the edge and 2 mm from 0.2 m on"
                                 : "corner of 40 rows, noise of 8 mm at the edge and 2 mm from 0.2 m on",
                    {{"at the edge", 40.0}, {"reach", 0.25}, {"far from it", -3.0}},
                    [count](Noise& noise) {
                      const Columns x = evenly(0.0, 1.2, count);
                      return cornerTraits(x, uneven(
                                                 x, noise, [](double d) { return -3.0 + 40.0 * std::exp(-d / 0.25); },
                                                 [](double d) { return 2.0 + 6.0 * std::exp(-d / 0.05); }));
                    }});
  }
  return rows;
}

}  // namespace

std::vector<Planted> plantedAlike() {
  std::vector<Planted> all;
  for (const auto& part :
       {alikeOverDistance(), alikeOverLight(), alikeOverTime(), atPlaces(), unevenSteps(), unevenly()})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace toftwin::compare
