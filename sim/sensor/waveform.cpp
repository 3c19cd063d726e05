// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/waveform.h"

#include <cmath>
#include <numbers>

namespace toftwin::sim {
namespace {

constexpr double kPi = std::numbers::pi;

/// (1/2π) ∫ clip(cos x, ±q)/q · cos nx dx: with α = acos q and odd n
///     (2/πq) [ q sin(nα)/n + ∫_α^{π/2} cos x cos nx dx ],   even n: 0
double clippedSine(int n, double q) {
  if (n % 2 == 0) return 0.0;
  const double alpha = std::acos(q);
  const auto antiderivative = [n](double x) {  // of cos x cos nx
    const double m = n;
    if (n == 1) return x / 2.0 + std::sin(2.0 * x) / 4.0;
    return std::sin((m - 1.0) * x) / (2.0 * (m - 1.0)) +
           std::sin((m + 1.0) * x) / (2.0 * (m + 1.0));
  };
  const double flat = q * std::sin(n * alpha) / n;
  return 2.0 / (kPi * q) * (flat + antiderivative(kPi / 2.0) - antiderivative(alpha));
}

double realCoefficient(const Waveform& wave, int n) {
  switch (wave.shape) {
    case Waveform::Shape::Sine:
      return n == 1 ? 0.5 : 0.0;
    case Waveform::Shape::Square:
      return std::sin(n * kPi * wave.duty) / (n * kPi * wave.duty);
    case Waveform::Shape::ClippedSine:
      return clippedSine(n, wave.clip);
    case Waveform::Shape::Impulse:
      return 1.0;
  }
  return 0.0;
}

}  // namespace

std::complex<double> Waveform::coefficient(int n, Frequency fundamental) const {
  // RC low pass: 1 / (1 + i n ω τ)
  const double n_omega_tau = 2.0 * kPi * n * fundamental.in(hertz)*rise.in(second);
  return realCoefficient(*this, n) / std::complex<double>{1.0, n_omega_tau};
}

}  // namespace toftwin::sim
