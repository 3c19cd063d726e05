// SPDX-License-Identifier: Apache-2.0
// Characteristics that are planted: how often their stated 95 % intervals hold the truth, 200 seeds each.
// Seeds are 1 to 200 for every row. The counts are those of docs/characteristics.md.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <tuple>

#include "calib/compare/statistics.h"
#include "calib/compare/trait_verdict.h"
#include "planted.h"

namespace toftwin::compare {
namespace {

constexpr int kRuns = 200;

Columns spaced(double first, double last, int count) {
  Columns x;
  for (int i = 0; i < count; ++i) x.push_back(first + (last - first) * i / (count - 1));
  return x;
}

/// y = f(x) + noise.
Columns noisy(const Columns& x, double sigma, Noise& noise, const std::function<double(double)>& f) {
  Columns y;
  for (const double one : x) y.push_back(f(one) + noise(sigma));
  return y;
}

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
                const Columns t = spaced(0.0, 890.0, 90);
                return traitsOf(driftTraits(t, noisy(t, 0.3, noise, f)));
              }};
  // In a third of runs it is straight within the noise, and a ramp is chosen: right, without a time constant.
  if (tau > 890.0) one.truth.erase("time constant");
  return one;
}

/// An hour of a value every 20 s, 0.3 mm of noise.
Planted drift(std::string name, Truth truth, std::function<double(double)> f) {
  return {std::move(name), std::move(truth), [f](Noise& noise) {
            const Columns t = spaced(0.0, 3600.0, 181);
            return traitsOf(driftTraits(t, noisy(t, 0.3, noise, f)));
          }};
}

std::vector<Planted> drifts() {
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
         const Columns t = spaced(0.0, 3600.0, 181);
         Columns y;
         double e = noise(0.3);
         for (const double one : t) {
           y.push_back(exponential(one) + e);
           e = 0.5 * e + noise(0.3 * std::sqrt(0.75));
         }
         return traitsOf(driftTraits(t, y));
       }});
  return rows;
}

/// Cells of a wall, and the capture of each.
struct Cells {
  Columns distance_m{}, error_mm{}, pixels{};
  std::vector<std::size_t> capture{};
};

/// Eighteen captures of a wall, whose ranges are up to 1.2 times its distance, a cell each `step_m`: each
/// capture is off by `own_mm` of its own, each cell by `cell_mm`.
Cells eighteenWalls(Noise& noise, double step_m, double own_mm, double cell_mm,
                    const std::function<double(double)>& error_mm) {
  Cells cells;
  for (std::size_t c = 0; c < 18; ++c) {
    const double distance_m = 0.6 * std::pow(4.0 / 0.6, static_cast<double>(c / 2) / 8.0);
    const double own = noise(own_mm);
    for (double at = distance_m; at < 1.2 * distance_m; at += step_m) {
      cells.distance_m.push_back(at), cells.capture.push_back(c);
      cells.error_mm.push_back(error_mm(at) + own + noise(cell_mm));
    }
  }
  return cells;
}

/// 28 captures of a wall by a camera of 96 × 72 pixels, whose noise goes as the distance up to 2 m and as its square
/// from there on, which is no power: twelvefold from 0.55 to 3.7 m. Near captures have few steps, of many pixels each.
Cells unevenWalls(Noise& noise, double own_mm, const std::function<double(double)>& error_mm) {
  constexpr double kStep_m = 0.025, kPixels = 96 * 72, kNear_mm = 2.0;
  Cells cells;
  for (std::size_t c = 0; c < 28; ++c) {
    const double distance_m = 0.55 * std::pow(3.7 / 0.55, static_cast<double>(c / 2) / 13.0);
    const double own = noise(own_mm), steps = 0.2 * distance_m / kStep_m;
    for (double at = distance_m; at < 1.2 * distance_m; at += kStep_m) {
      cells.distance_m.push_back(at), cells.capture.push_back(c), cells.pixels.push_back(kPixels / steps);
      const double pixel_mm = kNear_mm * at / 0.55 * std::max(1.0, at / 2.0);
      cells.error_mm.push_back(error_mm(at) + own + noise(pixel_mm / std::sqrt(cells.pixels.back())));
    }
  }
  return cells;
}

/// σ of `frames` ranges over their mean amplitude, at 60 strengths of light over 3.5 decades and 20 MHz: a
/// phasor with normal noise on both of its parts, which is √(36/I + 1/I²) mm where it is small, and 10 mm
/// that the light does not change.
Traits lawOfPhasors(Noise& noise, int frames) {
  constexpr double kLight_hz = 20e6, kPerRadian_mm = 299'792'458e3 / (4.0 * std::numbers::pi * kLight_hz);
  Columns signal, sigma_mm;
  for (int i = 0; i < 60; ++i) {
    const double x = std::pow(10.0, -3.5 * i / 59.0),
                 part = std::sqrt(36.0 / x + 1.0 / (x * x)) / kPerRadian_mm;
    Running range_mm, amplitude;
    for (int k = 0; k < frames; ++k) {
      const double across = noise(part), along = 1.0 + noise(part);
      range_mm.add(kPerRadian_mm * std::atan2(across, along) + noise(10.0));
      amplitude.add(1000.0 * x * std::hypot(across, along));
    }
    signal.push_back(amplitude.mean()), sigma_mm.push_back(std::sqrt(range_mm.variance()));
  }
  return noiseLawTraits(signal, sigma_mm, std::vector{kLight_hz});
}

std::vector<Planted> overDistance() {
  std::vector<Planted> rows;
  rows.push_back(
      {"harmonics",
       {{"30 MHz, 1 per period", 4.0},
        {"30 MHz, 4 per period", 6.0},
        {"offset", 3.0 + 0.7 * 3.5},
        {"scale", 0.7},
        {"residual", 2.0}},
       [](Noise& noise) {
         const Columns d = spaced(0.5, 6.5, 240);
         const double k = 4.0 * std::numbers::pi * 30e6 / 299'792'458.0;
         const Columns e = noisy(d, 2.0, noise, [&](double x) {
           return 3.0 + 0.7 * x + 4.0 * std::cos(k * x + 1.0) + 6.0 * std::sin(4.0 * k * x - 0.4);
         });
         const std::vector<double> f{30e6};
         const std::vector<int> orders{1, 2, 4};
         return harmonicTraits(d, e, f, orders);
       }});
  // Amplitudes err by 2 mm · √(2/240) = 0.183 mm: one that is not there, and one as small as its own error.
  rows.push_back({"small harmonics",
                  {{"30 MHz, 1 per period", 0.183}, {"30 MHz, 2 per period", 0.0}},
                  [](Noise& noise) {
                    const Columns d = spaced(0.5, 6.5, 240);
                    const double k = 4.0 * std::numbers::pi * 30e6 / 299'792'458.0;
                    const Columns e =
                        noisy(d, 2.0, noise, [&](double x) { return 3.0 + 0.183 * std::cos(k * x + 1.0); });
                    const std::vector<double> f{30e6};
                    const std::vector<int> orders{1, 2, 4};
                    return harmonicTraits(d, e, f, orders);
                  }});
  const std::vector<double> kinect_hz{16e6, 80e6, 120e6};
  const auto wave = [](double hz, int per_period) {
    return 4.0 * std::numbers::pi * per_period * hz / 299'792'458.0;
  };
  rows.push_back({"harmonics of cells",
                  {{"16 MHz, 4 per period", 1.0},
                   {"80 MHz, 4 per period", 3.0},
                   {"120 MHz, 4 per period", 0.0},
                   {"scale", 0.7}},
                  [=](Noise& noise) {
                    const Cells cells = eighteenWalls(noise, 0.025, 1.0, 0.5, [=](double d) {
                      return 2.0 + 0.7 * d + std::cos(wave(16e6, 4) * d + 1.0) +
                             3.0 * std::sin(wave(80e6, 4) * d);
                    });
                    const std::vector<int> orders{4};
                    return harmonicTraits(cells.distance_m, cells.error_mm, kinect_hz, orders, {.of = cells.capture});
                  }});
  // With the waves that are looked for by themselves.
  rows.push_back(
      {"harmonics of cells, three steps",
       {{"16 MHz, 6 per period", 1.2}, {"16 MHz, 4 per period", 0.0}, {"16 MHz, 3 per period", 0.0}},
       [=](Noise& noise) {
         const Cells cells = eighteenWalls(
             noise, 0.05, 0.3, 0.3, [=](double d) { return 2.0 + 1.2 * std::cos(wave(16e6, 6) * d + 1.0); });
         return harmonicTraits(cells.distance_m, cells.error_mm, kinect_hz, {.of = cells.capture});
       }});
  // Far steps scatter thirty times as much as near ones. With an error that captures share, and without.
  for (const double own_mm : {0.0, 0.1}) {
    rows.push_back({own_mm > 0.0 ? "harmonics of uneven steps" : "harmonics of uneven steps alone",
                    {{"25 MHz, 4 per period", 1.0},
                     {"25 MHz, 6 per period", 0.0},
                     {"offset", 5.0},
                     {"scale", 0.7}},
                    [=](Noise& noise) {
                      const Cells mean = unevenWalls(noise, 0.0, [](double) { return 0.0; });
                      const double middle_m = summarise(mean.distance_m).mean;
                      const Cells cells = unevenWalls(noise, own_mm, [=](double d) {
                        return 5.0 + 0.7 * (d - middle_m) + std::cos(wave(25e6, 4) * d + 1.0);
                      });
                      return harmonicTraits(cells.distance_m, cells.error_mm, std::vector{25e6},
                                            {.of = cells.capture, .pixels = cells.pixels});
                    }});
  }
  rows.push_back({"noise law", {{"floor", 2.0}, {"shot", 3.0}, {"read", 0.4}}, [](Noise& noise) {
                    // σ of 60 frames each: √(1/118) of itself uncertain. Relative to the largest signal,
                    // 1000.
                    Columns signal, sigma;
                    for (int i = 0; i < 60; ++i) {
                      const double x = std::pow(10.0, -2.0 * i / 59.0);
                      signal.push_back(1000.0 * x);
                      const double s = std::sqrt(4.0 + 9.0 / x + 0.16 / (x * x));
                      sigma.push_back(s * std::exp(noise(std::sqrt(1.0 / 118.0))));
                    }
                    return noiseLawTraits(signal, sigma);
                  }});
  rows.push_back({"noise law, down to no light",
                  {{"floor", 10.0}, {"shot", 6.0}, {"read", 1.0}},
                  [](Noise& noise) { return lawOfPhasors(noise, 300); }});
  rows.push_back({"wraps", {{"wrapped", 0.02}}, [](Noise& noise) {
                    Columns e;
                    for (int i = 0; i < 20'000; ++i)
                      e.push_back((noise.chance(0.02) ? 1.5 : 0.0) + noise(0.02));
                    return wrapTraits(e, 1.5);
                  }});
  rows.push_back({"wraps of whole patches", {{"wrapped", 0.02}}, [](Noise& noise) {
                    // In one of 25 cells of an image half of the pixels wrap together.
                    Columns shares;
                    for (int i = 0; i < 2000; ++i) shares.push_back(noise.chance(0.04) ? 0.5 : 0.0);
                    return wrapTraits(shares);
                  }});
  return rows;
}

std::vector<Planted> otherWays() {
  std::vector<Planted> rows;
  rows.push_back(
      {"corner", {{"at the edge", 40.0}, {"reach", 0.25}, {"far from it", -3.0}}, [](Noise& noise) {
         const Columns x = spaced(0.0, 1.2, 150);
         return cornerTraits(
             x, noisy(x, 2.0, noise, [](double d) { return -3.0 + 40.0 * std::exp(-d / 0.25); }));
       }});
  rows.push_back({"amplitude", {{"at 1", 12.0}, {"per decade", -4.0}}, [](Noise& noise) {
                    Columns a, e;
                    for (int i = 0; i < 100; ++i) {
                      a.push_back(std::pow(10.0, noise.uniform(1.0, 4.0)));
                      e.push_back(12.0 - 4.0 * std::log10(a.back()) + noise(2.0));
                    }
                    return amplitudeTraits(a, e);
                  }});
  rows.push_back({"ambient", {{"bias", 0.12}, {"noise²", 0.5}}, [](Noise& noise) {
                    const Columns klx = spaced(0.0, 60.0, 25);
                    Columns sigma;
                    // Of 400 frames, so that the variance's own spread differs little over the steps.
                    for (const double e : klx)
                      sigma.push_back(std::sqrt((90.0 + 0.5 * e) * (1.0 + noise(std::sqrt(2.0 / 399.0)))));
                    return ambientTraits(klx, noisy(klx, 1.0, noise, [](double e) { return 2.0 + 0.12 * e; }),
                                         sigma);
                  }});
  rows.push_back({"motion", {{"per speed", 7.5}}, [](Noise& noise) {
                    const Columns v = spaced(-2.0, 2.0, 21);
                    return motionTraits(v, noisy(v, 3.0, noise, [](double s) { return 1.0 + 7.5 * s; }));
                  }});
  return rows;
}

std::vector<Planted> overTime() {
  std::vector<Planted> rows;
  rows.push_back({"lag", {{"lag", 0.3}, {"rest", 100.0}}, [](Noise& noise) {
                    Columns k, y;
                    for (int cycle = 0; cycle < 6; ++cycle) {
                      for (int i = 0; i < 12; ++i) {
                        k.push_back(i);
                        y.push_back(100.0 + 900.0 * std::pow(0.3, i) + noise(10.0));
                      }
                    }
                    return lagTraits(k, y);
                  }});
  rows.push_back({"lag of the first frame", {{"left behind", 0.05}}, [](Noise& noise) {
                    Columns first, rest, before;
                    for (int i = 0; i < 6; ++i) {
                      rest.push_back(i % 2 == 0 ? 1000.0 : 100.0), before.push_back(i % 2 == 0 ? 100.0 : 1000.0);
                      first.push_back(rest.back() + 0.05 * (before.back() - rest.back()) + noise(3.0));
                    }
                    return afterImageTraits(first, rest, before);
                  }});
  rows.push_back(
      {"latency", {{"latency", 83.0}}, [](Noise& noise) {
         const Columns rt = spaced(-1.0, 11.0, 1201), t = spaced(0.0, 10.0, 200);
         const auto path = [](double s) { return 300.0 * std::sin(0.9 * s) + 80.0 * std::sin(2.3 * s); };
         Columns reference;
         for (const double s : rt) reference.push_back(path(s));
         return latencyTraits(t, noisy(t, 5.0, noise, [&](double s) { return 12.0 + path(s - 0.083); }), rt,
                              reference);
       }});
  rows.push_back({"frame timing", {{"interval", 33.3}, {"jitter", 0.4}, {"lost", 0.03}}, [](Noise& noise) {
                    // Each interval jitters by itself; a lost frame joins two of them.
                    Columns starts{0.0};
                    double now = 0.0;
                    for (int i = 0; i < 600; ++i) {
                      now += 0.0333 + noise(0.0004);
                      if (!noise.chance(0.03)) starts.push_back(now);
                    }
                    return timingTraits(starts);
                  }});
  return rows;
}

std::vector<Planted> atEdges() {
  std::vector<Planted> rows;
  rows.push_back(
      {"flying pixels", {{"flying", 0.35}, {"offset", 0.4}, {"near side", 0.75}}, [](Noise& noise) {
         Image<float> range(24, 240);
         for (int y = 0; y < 240; ++y) {
           const bool flies = noise.chance(0.35);
           const double share = noise.uniform(0.2, 0.6);
           for (int x = 0; x < 24; ++x)
             range(x, y) = static_cast<float>((x < 12             ? 1.0
                                               : x == 12 && flies ? 1.0 + share
                                                                  : 2.0) +
                                              noise(0.002));
         }
         return flyingTraits(range);
       }});
  rows.push_back(
      {"edge",
       {{"edge", 10.3}, {"width", 0.9}, {"10-90 width", 2.5631 * 0.9}, {"resolution", 0.187390 / 0.9}},
       [](Noise& noise) {
         // A slanted edge: rows see it at different places, so that the values lie closer than pixels.
         Columns x, v;
         for (int y = 0; y < 20; ++y) {
           for (int i = 0; i < 20; ++i) {
             x.push_back(i - 0.13 * y + 1.3);
             v.push_back(1000.0 + 700.0 * 0.5 * std::erfc(-(x.back() - 10.3) / 0.9 / std::numbers::sqrt2) +
                         noise(15.0));
           }
         }
         return edgeTraits(x, v);
       }});
  rows.push_back({"emitter shadow", {{"left", 1.5}, {"right", 4.0}, {"asymmetry", 2.5}}, [](Noise& noise) {
                    Image<float> range(60, 80, 2.0f);
                    for (int y = 0; y < 80; ++y) {
                      const int left = static_cast<int>(noise.uniform(0.0, 4.0)),
                                right = 2 + static_cast<int>(noise.uniform(0.0, 5.0));
                      for (int x = 20 - left; x < 40 + right; ++x)
                        range(x, y) = x < 20 || x >= 40 ? std::numeric_limits<float>::quiet_NaN() : 1.0f;
                    }
                    return shadowTraits(range, 1.5);
                  }});
  return rows;
}

std::vector<Planted> ofMasks() {
  std::vector<Planted> rows;
  // 90 % valid in A; B differs from A in 4 % of the pixels: both valid 0.9 · 0.96, only A 0.036, only B
  // 0.004.
  const double both = 0.864, agree = 0.96, share_b = both + 0.1 * 0.04,
               chance = 0.9 * share_b + 0.1 * (1.0 - share_b);
  rows.push_back({"mask agreement",
                  {{"agreement", agree},
                   {"overlap", both / (both + 0.04)},
                   {"kappa", (agree - chance) / (1.0 - chance)}},
                  [](Noise& noise) {
                    std::vector<Image<std::uint8_t>> a, b;
                    for (int pose = 0; pose < 12; ++pose) {
                      Image<std::uint8_t>&of_a = a.emplace_back(60, 40), &of_b = b.emplace_back(60, 40);
                      for (std::size_t i = 0; i < of_a.size(); ++i) {
                        of_a[i] = noise.chance(0.9) ? 1 : 0;
                        of_b[i] = noise.chance(0.04) ? 1 - of_a[i] : of_a[i];
                      }
                    }
                    return maskTraits(a, b);
                  }});
  return rows;
}

std::vector<Planted> allPlanted() {
  std::vector<Planted> all;
  for (const auto& part :
       {drifts(), overDistance(), otherWays(), plantedScatter(), overTime(), atEdges(), ofMasks(),
        plantedFrames(), plantedAlike(), plantedSessions(), plantedBursts()})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// How many of the runs held each truth. A trait that a run does not give (another drift model was chosen)
/// did not.
std::map<std::string, int> heldBy(const Planted& planted) {
  std::map<std::string, int> held;
  for (const auto& [name, truth] : planted.truth) held[name] = 0;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    Noise noise{seed};
    const Traits traits = planted.run(noise);
    EXPECT_TRUE(traits) << planted.name << ", seed " << seed << ": " << traits.error().message;
    if (!traits) continue;
    for (const Trait& trait : *traits) {
      const auto truth = planted.truth.find(trait.name);
      if (truth != planted.truth.end() && trait.low <= truth->second && truth->second <= trait.high)
        ++held[trait.name];
    }
  }
  return held;
}

class Coverage : public testing::TestWithParam<std::size_t> {};

/// Intervals of exactly 95 % are held in Bin(200, 0.95) runs. A row fails outside of the counts that all rows
/// together leave with 5 % (Šidák: each with 1 − 0.95^(1/rows), half of it at either end). The seeds are fixed, so
/// that the test does not waver; what holds 85 % fails in 97 %.
struct Bounds {
  int least = 0, most = 0;
};
Bounds boundsFor(std::size_t rows) {
  const double each = 1.0 - std::pow(0.95, 1.0 / static_cast<double>(rows));
  const boost::math::binomial runs{kRuns, 0.95};
  Bounds bounds{0, kRuns};
  while (boost::math::cdf(runs, bounds.least) < 0.5 * each) ++bounds.least;
  while (boost::math::cdf(boost::math::complement(runs, bounds.most - 1)) < 0.5 * each) --bounds.most;
  return bounds;
}

TEST_P(Coverage, OfIntervalsIsWhat200RunsOf95PercentAllow) {
  const auto all = allPlanted();
  std::size_t rows = 0;
  for (const Planted& one : all) rows += one.truth.size();
  const Bounds bounds = boundsFor(rows);
  const Planted& planted = all[GetParam()];
  std::stringstream page;
  page << std::ifstream{TOFTWIN_SOURCE_DIR "/docs/characteristics.md"}.rdbuf();
  const auto expectOnPage = [&](const std::string& words) {
    EXPECT_TRUE(page.str().find(words) != std::string::npos) << "docs/characteristics.md lacks: " << words;
  };
  expectOnPage(fmt::format("{} rows: {:.1f} to {:.1f} %", rows, bounds.least / 2.0, bounds.most / 2.0));
  for (const auto& [name, held] : heldBy(planted)) {
    EXPECT_GE(held, bounds.least) << planted.name << ": " << name;
    EXPECT_LE(held, bounds.most) << planted.name << ": " << name;
    expectOnPage(
        fmt::format("| {} | {} | {:.6g} | {:.1f} |", planted.name, name, planted.truth.at(name), held / 2.0));
  }
}

/// RMS over the distances of what is left of a wave beside the line that it looks like.
double besideItsLine(const Columns& distance_m, const std::function<double(double)>& wave_mm) {
  double n = 0.0, d1 = 0.0, d2 = 0.0, w1 = 0.0, w2 = 0.0, dw = 0.0;
  for (const double d : distance_m) {
    const double w = wave_mm(d);
    n += 1.0, d1 += d, d2 += d * d, w1 += w, w2 += w * w, dw += d * w;
  }
  const double covariance = dw / n - d1 / n * w1 / n, variance = d2 / n - d1 / n * d1 / n;
  return std::sqrt(w2 / n - w1 / n * w1 / n - covariance * covariance / variance);
}

/// Of steps over 4.8 m that do not tell which waves of 16 MHz they are: all together are held, of equal cameras,
/// too. Of 40 runs, 95 % hold 38 ± 1.4, and 2.5 % on one side are 1 ± 1 (binomial; of 200 runs of each, and of 0.15 mm, at
/// least 183 were held, and at most 10 of equal cameras told to have waves).
TEST(WavesTogether, AreToldWhicheverTheyAre) {
  const std::vector<double> kinect_hz{16e6, 80e6, 120e6};
  const double per_m = 4.0 * std::numbers::pi * 6.0 * 16e6 / 299'792'458.0;
  for (const double wave_mm : {0.0, 4.4}) {
    const auto error_mm = [=](double d) { return wave_mm * std::cos(per_m * d + 1.0); };
    int held = 0, differ = 0;
    for (unsigned seed = 1; seed <= 40; ++seed) {
      Noise noise{seed};
      const Cells cells = eighteenWalls(noise, 0.1, 0.3, 0.3, [&](double d) { return 2.0 + error_mm(d); });
      const auto fitted = fittedHarmonics(cells.distance_m, cells.error_mm, kinect_hz, {.of = cells.capture});
      ASSERT_TRUE(fitted && fitted->together) << "single waves are in doubt";
      const Trait& together = *fitted->together;
      const double truth = besideItsLine(cells.distance_m, error_mm);
      held += together.low <= truth && truth <= together.high;
      differ += together.low > 0.0;
    }
    EXPECT_GE(held, 34) << wave_mm;
    if (wave_mm == 0.0) {
      EXPECT_LE(differ, 4);
    } else if (wave_mm > 1.0) {
      EXPECT_EQ(differ, 40);
    }
    RecordProperty(fmt::format("held_{}", wave_mm), held);
  }
}

/// σ² of one camera is 1.1² + 0.7²/I, of the other 1.1² + 0.5²/I + 0.05²/I²: where a part is 0 of one alone its
/// difference is not told, whichever parts the rows show; of all together it is, held and no wider than 0.2 mm.
TEST(NoiseLaw, IsToldAsAWholeWherePartsStandInForOneAnother) {
  int held = 0, not_told = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    Noise noise{seed};
    NamedTraits traits;
    for (const auto& [whose, shot, read] : {std::tuple{"A", 0.7, 0.0}, {"B", 0.5, 0.05}}) {
      Columns signal, sigma;
      for (int i = 0; i < 40; ++i) {
        signal.push_back(std::pow(0.05, i / 39.0));
        const double law = 1.21 + shot * shot / signal.back() + read * read / signal.back() / signal.back();
        sigma.push_back(std::sqrt(law) * (1.0 + noise(0.02)));
      }
      const auto fitted = noiseLawTraits(signal, sigma);
      ASSERT_TRUE(fitted);
      for (const Trait& one : *fitted) traits.traits.push_back({"noise law", "", whose, one});
    }
    const double truth = std::sqrt(1.21 + 0.25 + 0.0025) - std::sqrt(1.21 + 0.49);
    for (const TraitVerdict& one : verdictsOf(traits)) {
      const bool is_whole = one.difference.name == kWholeLaw;
      const bool is_no_a = one.a->trait.value == 0.0, is_no_b = one.b->trait.value == 0.0;
      if (!is_whole) {
        EXPECT_EQ(one.why_not.empty(), is_no_a == is_no_b) << one.difference.name;
        not_told += !one.why_not.empty();
        continue;
      }
      held += one.difference.low <= truth && truth <= one.difference.high;
      EXPECT_LT(one.difference.high - one.difference.low, 0.2);
    }
  }
  EXPECT_GE(held, 183) << "95 % of 200 are 190 ± 3.1, and four rows hold together";
  EXPECT_GT(not_told, 0);
}

INSTANTIATE_TEST_SUITE_P(Planted, Coverage, testing::Range(std::size_t{0}, allPlanted().size()));

}  // namespace
}  // namespace toftwin::compare
