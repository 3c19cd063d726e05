// SPDX-License-Identifier: Apache-2.0
// What the tracer's tests share: small cameras, phasors read as ranges, expectations with error bars.
#pragma once

#include <gmock/gmock.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <string>

#include "sim/tracer/trace.h"

namespace toftwin::sim::testing {

inline constexpr double kPi = std::numbers::pi;
using Complex = std::complex<double>;

/// k = 2πf/c, the phase per metre of light path.
inline double wavenumber(Frequency f) { return 2.0 * kPi * f.in(hertz) / kSpeedOfLight_m_per_s; }

inline Scene sceneOf(const std::string& toml) {
  auto scene = Scene::parse(toml, "test.toml");
  if (!scene) throw std::runtime_error{scene.error().message};
  return *std::move(scene);
}

/// A camera at the world's origin that looks along +z, with a point light of isotropic 4π W (1 W/sr)
/// in its pinhole.
inline TraceRequest requestFor(int width, int height, double focal_px, std::vector<Frequency> frequencies) {
  TraceRequest request;
  request.camera = {.width = width, .height = height, .fx = focal_px, .fy = focal_px,
                    .cx = (width - 1) / 2.0, .cy = (height - 1) / 2.0, .distortion = {}, .calibration_id = {}};
  request.emitters = {EmitterSpec{.power_w = 4.0 * kPi, .isotropic = true}};
  request.frequencies = std::move(frequencies);
  request.samples_per_pixel = 1;
  request.max_surfaces = 1;
  request.pixel_extent = 0.0;
  return request;
}

inline Complex phasorAt(const Light& light, std::size_t frequency, int x, int y, int harmonic = 1) {
  return Complex{light.phasor(frequency, harmonic)(x, y)};
}

/// How much further than `range` the phasor's phase says the surface is, within ± half the unambiguous
/// range: e = −arg(P e^{2ikr}) / 2k.
inline double rangeError(Complex phasor, Frequency f, double range_m) {
  const double k = wavenumber(f);
  return -std::arg(phasor * std::polar(1.0, 2.0 * k * range_m)) / (2.0 * k);
}

/// Standard deviation of the range from the Monte-Carlo variance of the phasor: σ/|P| / 2k.
inline double rangeSigma(const Light& light, std::size_t frequency, int x, int y) {
  return std::sqrt(static_cast<double>(light.variance[frequency](x, y))) /
         std::abs(phasorAt(light, frequency, x, y)) / (2.0 * wavenumber(light.frequencies[frequency]));
}

/// The mean over all pixels of one frequency, and what the pixels' spread says of it: the standard deviation
/// of a component, and of the component across the mean, which turns the phase. Even sampling makes the
/// spread of pixels smaller than that of samples, which Light::variance states.
struct PixelMean {
  Complex phasor;
  double sigma = 0.0, sigma_across = 0.0;
};
inline PixelMean meanOfPixels(const Light& light, std::size_t frequency) {
  const auto& phasors = light.phasors[frequency].pixels();
  const double pixels = static_cast<double>(phasors.size());
  PixelMean mean;
  for (const auto& z : phasors) mean.phasor += Complex{z} / pixels;
  const Complex along = mean.phasor / std::abs(mean.phasor);
  double squares = 0.0, across = 0.0;
  for (const auto& z : phasors) {
    squares += std::norm(Complex{z} - mean.phasor);
    across += std::pow((Complex{z} * std::conj(along)).imag(), 2);
  }
  mean.sigma = std::sqrt(squares / (2.0 * pixels * (pixels - 1.0)));
  mean.sigma_across = std::sqrt(across / (pixels * (pixels - 1.0)));
  return mean;
}

}  // namespace toftwin::sim::testing
