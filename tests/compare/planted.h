// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// Normal numbers of one run.
class Noise {
 public:
  explicit Noise(unsigned seed) : random_(seed) {}
  double operator()(double sigma) { return sigma * normal_(random_); }
  double uniform(double low, double high) { return low + (high - low) * uniform_(random_); }
  bool chance(double p) { return uniform_(random_) < p; }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
};

using Columns = std::vector<double>;
using Truth = std::map<std::string, double>;

/// From the first to the last in equal steps.
inline Columns evenly(double first, double last, int count) {
  Columns x;
  for (int i = 0; i < count; ++i) x.push_back(first + (last - first) * i / (count - 1));
  return x;
}

/// y = f(x) + noise.
inline Columns noisy(const Columns& x, double sigma, Noise& noise, const std::function<double(double)>& f) {
  Columns y;
  for (const double one : x) y.push_back(f(one) + noise(sigma));
  return y;
}

/// y = f(x) + errors of `sigma`, each of which has `rho` of the one before.
inline Columns alike(const Columns& x, double sigma, double rho, Noise& noise,
              const std::function<double(double)>& f) {
  Columns y;
  double e = noise(sigma);
  for (const double one : x) {
    y.push_back(f(one) + e);
    e = rho * e + noise(sigma * std::sqrt(1.0 - rho * rho));
  }
  return y;
}

/// Cells of a wall, and the capture of each.
struct Cells {
  Columns distance_m{}, error_mm{}, pixels{};
  std::vector<std::size_t> capture{};
};

/// Eighteen captures of a wall, whose ranges are up to 1.2 times its distance, a cell each `step_m`: each
/// capture is off by `own_mm` of its own, each cell by `cell_mm`.
Cells eighteenWalls(Noise& noise, double step_m, double own_mm, double cell_mm,
                    const std::function<double(double)>& error_mm);

/// Rows of sessions.
struct AtPlaceOfSession {
  Columns x{}, y{}, session{};
};

/// What is planted, and what one run makes of it.
struct Planted {
  std::string name;
  Truth truth;
  std::function<Traits(Noise&)> run;
};

/// Series over time since power-on.
std::vector<Planted> plantedDrifts();
/// Waves, noise laws and wraps.
std::vector<Planted> plantedOverDistance();
/// Veils in the lens, of one frequency and of several that the cameras' own decoders join.
std::vector<Planted> plantedScatter();
/// Rows that err alike or scatter by their own measure, and parts that are not there.
std::vector<Planted> plantedAlike();
/// Rows of sessions that a column tells.
std::vector<Planted> plantedSessions();
/// Noise of frames, of which many and few are known.
std::vector<Planted> plantedFrames();
/// Lines and frames that err together.
std::vector<Planted> plantedBursts();

}  // namespace toftwin::compare
