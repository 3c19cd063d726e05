// SPDX-License-Identifier: Apache-2.0
// Waves over distance, noise laws and wraps that are planted, for coverage_test.cpp.
#include <cmath>
#include <numbers>

#include "calib/compare/statistics.h"
#include "planted.h"

namespace toftwin::compare {
namespace {

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

}  // namespace

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

std::vector<Planted> plantedOverDistance() {
  std::vector<Planted> rows;
  rows.push_back(
      {"harmonics",
       {{"30 MHz, 1 per period", 4.0},
        {"30 MHz, 4 per period", 6.0},
        {"offset", 3.0 + 0.7 * 3.5},
        {"scale", 0.7},
        {"residual", 2.0}},
       [](Noise& noise) {
         const Columns d = evenly(0.5, 6.5, 240);
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
                    const Columns d = evenly(0.5, 6.5, 240);
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

}  // namespace toftwin::compare
