// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/raw_exposures.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>

#include <toftwin/nan.h>
#include <toftwin/units.h>

namespace toftwin::discover {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

/// Sample `channel` (frequency × steps + step) of a pixel.
using SampleAt = std::function<double(std::size_t channel, std::size_t pixel)>;

/// Real parts of the samples' Fourier series but the first, over |z|: the mean, then cosine and sine of 2, 3, … waves,
/// and of K even the alternating part.
class Closures {
 public:
  explicit Closures(std::size_t steps) {
    const auto k = static_cast<double>(steps);
    addPart(steps, [&](double) { return 1.0 / k; });
    for (std::size_t n = 2; 2 * n < steps; ++n) {
      addPart(steps, [&](double i) { return 2.0 / k * std::cos(kTurn * static_cast<double>(n) * i / k); });
      addPart(steps, [&](double i) { return 2.0 / k * std::sin(kTurn * static_cast<double>(n) * i / k); });
    }
    if (steps % 2 == 0) addPart(steps, [&](double i) { return std::cos(std::numbers::pi * i) / k; });
  }
  [[nodiscard]] std::size_t count() const { return weights_.size(); }
  [[nodiscard]] const std::vector<double>& weights(std::size_t part) const { return weights_[part]; }

 private:
  void addPart(std::size_t steps, const std::function<double(double)>& weight) {
    weights_.emplace_back();
    for (std::size_t i = 0; i < steps; ++i) weights_.back().push_back(weight(static_cast<double>(i)));
  }
  std::vector<std::vector<double>> weights_{};
};

RawReading readingOf(int width, int height, const std::vector<Frequency>& frequencies, std::size_t steps,
                     const SampleAt& sample) {
  const auto highest = static_cast<std::size_t>(std::ranges::max_element(frequencies) - frequencies.begin());
  const Closures closures{steps};
  RawReading reading{Image<float>(width, height, kNaN), unambiguousRange(frequencies[highest]).in(metre)};
  reading.per_frequency = closures.count();
  reading.closures.assign(frequencies.size() * closures.count(), Image<float>(width, height, kNaN));
  std::vector<std::complex<double>> turned(steps);
  for (std::size_t k = 0; k < steps; ++k)
    turned[k] = std::polar(2.0 / static_cast<double>(steps),
                           -kTurn * static_cast<double>(k) / static_cast<double>(steps));
  std::vector<double> s(steps);
  for (std::size_t f = 0; f < frequencies.size(); ++f) {
    for (std::size_t i = 0; i < reading.range_m.size(); ++i) {
      std::complex<double> z;
      for (std::size_t k = 0; k < steps; ++k) s[k] = sample(f * steps + k, i), z += s[k] * turned[k];
      const double size = std::abs(z);
      if (!std::isfinite(size) || size == 0.0) continue;
      if (f == highest) {
        const double turns = -std::arg(z) / kTurn;
        reading.range_m[i] = static_cast<float>((turns - std::floor(turns)) * reading.period_m);
      }
      for (std::size_t part = 0; part < closures.count(); ++part) {
        double sum = 0.0;
        for (std::size_t k = 0; k < steps; ++k) sum += closures.weights(part)[k] * s[k];
        reading.closures[f * closures.count() + part][i] = static_cast<float>(sum / size);
      }
    }
  }
  return reading;
}

constexpr std::size_t kLeastSteps = 3;

}  // namespace

std::optional<RawReading> rawReadingOf(const Frame& frame) {
  const Plane* plane = frame.find(PlaneKind::Samples);
  if (plane == nullptr || plane->type != ElementType::F32) return std::nullopt;
  std::vector<Frequency> frequencies;
  for (const Exposure& exposure : frame.moment.exposures)
    if (frequencies.empty() || !(frequencies.back() == exposure.modulation)) frequencies.push_back(exposure.modulation);
  const auto channels = static_cast<std::size_t>(plane->channels);
  const bool is_whole = !frequencies.empty() && channels == frame.moment.exposures.size() &&
                        channels % frequencies.size() == 0 && channels / frequencies.size() >= kLeastSteps &&
                        std::ranges::none_of(frequencies, [](Frequency f) { return !(f > 0_MHz); });
  if (!is_whole) return std::nullopt;
  const auto values = plane->as<float>();
  const std::size_t pixels = values.size() / channels;
  return readingOf(plane->width, plane->height, frequencies, channels / frequencies.size(),
                   [&](std::size_t channel, std::size_t i) {
                     return static_cast<double>(values[channel * pixels + i]);
                   });
}

RawReading rawReadingOf(const sim::Samples& samples) {
  const auto steps = static_cast<std::size_t>(samples.steps), taps = static_cast<std::size_t>(samples.taps);
  RawReading reading =
      readingOf(samples.width(), samples.height(), samples.frequencies, steps, [&](std::size_t channel, std::size_t i) {
        const auto first = static_cast<double>(samples.electrons[channel * taps][i]);
        return taps == 1 ? first : first - static_cast<double>(samples.electrons[channel * taps + 1][i]);
      });
  if (taps == 1)
    for (std::size_t f = 0; f < samples.frequencies.size(); ++f) reading.closures[f * reading.per_frequency] = {};
  return reading;
}

float nearestRange(float range_m, float about_m, double period_m) {
  const auto period = static_cast<float>(period_m);
  return range_m + period * std::round((about_m - range_m) / period);
}

}  // namespace toftwin::discover
