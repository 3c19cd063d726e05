// SPDX-License-Identifier: Apache-2.0
#include "calib/intrinsics/corner_fit.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "calib/linear/linear.h"

namespace toftwin::intrinsics {
namespace {

// With p the pixel's centre, c the corner, and n_A, n_B the normals of the two edges through it:
//   s_A = n_A (p − c) / (√2 σ), s_B likewise
//   E = (k + erf(s_A)) (k + erf(s_B))
//   d = (p − c) / reach
//   I(p) = min(saturation, m + g d + E (a + h d))
// k = 0 where four squares meet; k = 1 at the outer corner of one, into which both normals point.
// For k = 0, turning by 180° about c leaves E as it is, so whatever the edges do to each other near the
// corner (light that spreads from bright squares, a checker that meets only at an angle) does not move c.
enum Parameter { U, V, AngleA, AngleB, LogBlur, Level, SlopeX, SlopeY, Half, HalfX, HalfY, Count };
using Vector = Eigen::Matrix<double, Count, 1>;
using Matrix = Eigen::Matrix<double, Count, Count>;

constexpr double kLeastReach_px = 2.0;
constexpr int kSteps = 40;
constexpr double kLeastBlur_px = 0.2, kMostBlur_px = 6.0;

struct Sample {
  double u, v, value;
};

struct Window {
  std::vector<Sample> samples;
  double reach = 1.0;  ///< pixels
  double saturation = 0.0;
  double k = 0.0;
};

double length(const std::array<double, 2>& v) { return std::hypot(v[0], v[1]); }

/// Amplitude images say 0 where a pixel has no value; squares that are black throughout are 0 as well. A few zeros
/// are the former.
void dropPixelsWithoutValue(std::vector<Sample>& samples) {
  constexpr std::size_t kFew = 6;  // one in six
  const auto zeros = static_cast<std::size_t>(std::ranges::count(samples, 0.0, &Sample::value));
  if (zeros * kFew < samples.size()) std::erase_if(samples, [](const Sample& one) { return one.value == 0.0; });
}

/// The pixels whose place in the board's own axes is within reach.
Window windowAround(const Image<float>& image, const CornerGuess& guess, float saturation) {
  const auto& a = guess.along;
  const auto& b = guess.across;
  const double determinant = a[0] * b[1] - a[1] * b[0];
  Window window{.samples = {},
                .reach = 0.5 * std::max(length(a), length(b)),
                .saturation = saturation,
                .k = guess.is_outer ? 1.0 : 0.0};
  const double short_side = std::min(length(a), length(b));
  const double share = std::max(guess.reach, kLeastReach_px / std::max(short_side, 1.0));
  const int half = static_cast<int>(std::ceil(share * (length(a) + length(b))));
  const int u0 = static_cast<int>(std::lround(guess.at.u)), v0 = static_cast<int>(std::lround(guess.at.v));
  for (int v = std::max(0, v0 - half); v <= std::min(image.height() - 1, v0 + half); ++v) {
    for (int u = std::max(0, u0 - half); u <= std::min(image.width() - 1, u0 + half); ++u) {
      const double du = u - guess.at.u, dv = v - guess.at.v;
      const double along = (du * b[1] - dv * b[0]) / determinant;
      const double across = (a[0] * dv - a[1] * du) / determinant;
      if (std::abs(along) > share || std::abs(across) > share) continue;
      const float value = image(u, v);
      if (std::isfinite(value)) window.samples.push_back({double(u), double(v), value});
    }
  }
  dropPixelsWithoutValue(window.samples);
  return window;
}

/// The model's value there and its derivatives.
double model(const Vector& x, const Window& window, const Sample& at, Vector* slope) {
  constexpr double kTwoOverRootPi = 2.0 * std::numbers::inv_sqrtpi;
  const double du = at.u - x[U], dv = at.v - x[V];
  const double scale = 1.0 / (std::numbers::sqrt2 * std::exp(x[LogBlur]));
  const double cos_a = std::cos(x[AngleA]), sin_a = std::sin(x[AngleA]);
  const double cos_b = std::cos(x[AngleB]), sin_b = std::sin(x[AngleB]);
  const double s = (-sin_a * du + cos_a * dv) * scale;
  const double t = (-sin_b * du + cos_b * dv) * scale;
  const double beside_a = window.k + std::erf(s), beside_b = window.k + std::erf(t),
               edges = beside_a * beside_b;
  const double dx = du / window.reach, dy = dv / window.reach;
  const double half = x[Half] + x[HalfX] * dx + x[HalfY] * dy;
  const double value = x[Level] + x[SlopeX] * dx + x[SlopeY] * dy + edges * half;
  if (slope == nullptr) return std::min(value, window.saturation);
  if (value > window.saturation) {
    slope->setZero();  // however bright: the pixel says the same
    return window.saturation;
  }
  const double by_s = half * beside_b * kTwoOverRootPi * std::exp(-s * s);
  const double by_t = half * beside_a * kTwoOverRootPi * std::exp(-t * t);
  const double by_x = (x[SlopeX] + edges * x[HalfX]) / window.reach;
  const double by_y = (x[SlopeY] + edges * x[HalfY]) / window.reach;
  (*slope)[U] = (by_s * sin_a + by_t * sin_b) * scale - by_x;
  (*slope)[V] = -(by_s * cos_a + by_t * cos_b) * scale - by_y;
  (*slope)[AngleA] = by_s * (-cos_a * du - sin_a * dv) * scale;
  (*slope)[AngleB] = by_t * (-cos_b * du - sin_b * dv) * scale;
  (*slope)[LogBlur] = -by_s * s - by_t * t;
  (*slope)[Level] = 1.0;
  (*slope)[SlopeX] = dx;
  (*slope)[SlopeY] = dy;
  (*slope)[Half] = edges;
  (*slope)[HalfX] = edges * dx;
  (*slope)[HalfY] = edges * dy;
  return value;
}

double misfit(const Vector& x, const Window& window) {
  double sum = 0.0;
  for (const Sample& sample : window.samples) {
    const double left = model(x, window, sample, nullptr) - sample.value;
    sum += left * left;
  }
  return sum;
}

struct Normal {
  Matrix a = Matrix::Zero();
  Vector b = Vector::Zero();
};
Normal normalEquations(const Vector& x, const Window& window) {
  Normal normal;
  Vector slope;
  for (const Sample& sample : window.samples) {
    const double left = model(x, window, sample, &slope) - sample.value;
    normal.a.selfadjointView<Eigen::Lower>().rankUpdate(slope);
    normal.b -= left * slope;
  }
  normal.a = normal.a.selfadjointView<Eigen::Lower>();
  return normal;
}

Vector start(const CornerGuess& guess, const Window& window) {
  Vector x = Vector::Zero();
  x[U] = guess.at.u;
  x[V] = guess.at.v;
  x[AngleA] = std::atan2(guess.along[1], guess.along[0]);
  x[AngleB] = std::atan2(guess.across[1], guess.across[0]);
  // Of the normals, for which AngleA and AngleB stand, one points out of the square between along and across.
  const bool is_left_handed = guess.along[0] * guess.across[1] < guess.along[1] * guess.across[0];
  if (guess.is_outer) x[is_left_handed ? AngleA : AngleB] += std::numbers::pi;
  x[LogBlur] = std::log(1.0);
  double level = 0.0, half = 0.0, weight = 0.0;
  for (const Sample& sample : window.samples) level += sample.value;
  level /= static_cast<double>(window.samples.size());
  Vector slope;
  x[Half] = 1.0;  // so that the derivative by Half is the pattern itself
  const Window unbounded{.samples = {}, .reach = window.reach, .saturation = HUGE_VAL, .k = window.k};
  for (const Sample& sample : window.samples) {
    model(x, unbounded, sample, &slope);
    half += slope[Half] * (sample.value - level);
    weight += slope[Half] * slope[Half];
  }
  x[Level] = level;
  x[Half] = half / weight;
  return x;
}

/// Levenberg-Marquardt; false if it never settled.
bool minimise(Vector& x, const Window& window) {
  constexpr double kNearlyStill_px = 0.005;
  double damping = 1e-3, now = misfit(x, window), moved = HUGE_VAL;
  for (int step = 0; step < kSteps; ++step) {
    const Normal normal = normalEquations(x, window);
    Matrix damped = normal.a;
    damped.diagonal() += damping * (normal.a.diagonal().array() + 1e-12).matrix();
    const Vector change = linear::Ldlt{damped}.solve(normal.b);
    if (!change.allFinite()) return false;
    Vector next = x + change;
    next[LogBlur] = std::clamp(next[LogBlur], std::log(kLeastBlur_px), std::log(kMostBlur_px));
    const double then = misfit(next, window);
    if (then <= now) {
      const bool is_settled = std::hypot(change[U], change[V]) < 1e-4 && now - then <= 1e-6 * now;
      moved = std::hypot(change[U], change[V]);
      x = next;
      now = then;
      damping = std::max(damping * 0.2, 1e-9);
      if (is_settled) return true;
    } else {
      damping *= 8.0;
      if (damping > 1e9) return true;  // no step improves it: it is at the bottom
    }
  }
  return moved < kNearlyStill_px;  // other parameters may creep, such as a blur that is too small to tell
}

}  // namespace

std::optional<FittedCorner> fitCorner(const Image<float>& image, const CornerGuess& guess,
                                      float saturation) {
  const double area = std::abs(guess.along[0] * guess.across[1] - guess.along[1] * guess.across[0]);
  if (!(area > 4.0)) return std::nullopt;
  const Window window = windowAround(image, guess, saturation);
  static_assert(kFewestPixels == 2 * static_cast<std::size_t>(Count));
  if (window.samples.size() < kFewestPixels) return std::nullopt;
  Vector x = start(guess, window);
  if (!minimise(x, window)) return std::nullopt;
  const double moved = std::hypot(x[U] - guess.at.u, x[V] - guess.at.v);
  if (moved > 0.35 * std::min(length(guess.along), length(guess.across))) return std::nullopt;

  Normal normal = normalEquations(x, window);
  const double spare = static_cast<double>(window.samples.size()) - static_cast<double>(Count);
  const double variance = misfit(x, window) / spare;
  normal.a.diagonal().array() += 1e-12 * normal.a.diagonal().maxCoeff();
  const Matrix covariance = variance * linear::inverse(normal.a);
  const double error = std::sqrt(0.5 * (covariance(U, U) + covariance(V, V)));
  if (!std::isfinite(error)) return std::nullopt;
  return FittedCorner{.at = {x[U], x[V]},
                      .error_px = error,
                      .blur_px = std::exp(x[LogBlur]),
                      .contrast = x[Half]};
}

}  // namespace toftwin::intrinsics
