// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/correlate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

/// A harmonic whose relative content is smaller is not there.
constexpr double kNoContent = 1e-12;
/// One below this is faint (Harmonic).
constexpr double kFaintContent = 0.05;

/// modulated += or = Re(weight · phasors), whose parts alternate.
TOFTWIN_SIMD void addModulated(const float* __restrict phasors, float real, float imaginary, int width,
                               float* __restrict modulated) {
  for (int x = 0; x < width; ++x) modulated[x] += real * phasors[2 * x] - imaginary * phasors[2 * x + 1];
}
TOFTWIN_SIMD void setModulated(const float* __restrict phasors, float real, float imaginary, int width,
                               float* __restrict modulated) {
  for (int x = 0; x < width; ++x) modulated[x] = real * phasors[2 * x] - imaginary * phasors[2 * x + 1];
}

/// Both taps; the second may be null.
TOFTWIN_SIMD void fillTaps(const float* __restrict steady, const float* __restrict ambient,
                           const float* __restrict modulated, float half_gain, int width, float* __restrict first,
                           float* __restrict second) {
  if (second == nullptr) {
    for (int x = 0; x < width; ++x) first[x] = half_gain * (steady[x] + ambient[x]) + modulated[x];
    return;
  }
  for (int x = 0; x < width; ++x) {
    const float even = half_gain * (steady[x] + ambient[x]);
    first[x] = even + modulated[x];
    second[x] = even - modulated[x];
  }
}

}  // namespace

Angle Response::zeroPhase() const {
  return (harmonics.empty() ? 0.0 : -std::arg(harmonics.front())) * radian;
}

double Response::leastCharge() const {
  constexpr int kPhases = 2048;
  double least = 1.0;
  for (int i = 0; i < kPhases; ++i) {
    double modulated = 0.0;
    for (std::size_t n = 0; n < harmonics.size(); ++n) {
      const double angle = 2.0 * std::numbers::pi * i / kPhases * static_cast<double>(n + 1);
      modulated += (harmonics[n] * std::polar(1.0, angle)).real();
    }
    least = std::min(least, 1.0 - contrast * std::abs(modulated));
  }
  return least;
}

std::vector<std::complex<double>> relativeHarmonics(const Waveform& emitted,
                                                    const Waveform& demodulating,
                                                    Frequency frequency, int count) {
  std::vector<std::complex<double>> relative;
  double fundamental = 0.0;
  for (int n = 1; n <= count; ++n) {
    const std::complex<double> c =
        emitted.coefficient(n, frequency) * std::conj(demodulating.coefficient(n, frequency));
    if (n == 1) fundamental = std::abs(c);
    if (fundamental < 1e-9) return {};
    relative.push_back(c / fundamental);
  }
  return relative;
}

std::vector<Harmonic> correlatedTerms(const std::vector<Response>& responses, int harmonics) {
  std::vector<Harmonic> seen;
  for (const Response& response : responses) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(harmonics); ++i) {
      const double content = i < response.harmonics.size() ? std::abs(response.harmonics[i]) : 0.0;
      seen.push_back(content < kNoContent      ? Harmonic::Unseen
                     : content < kFaintContent ? Harmonic::Faint
                                               : Harmonic::Seen);
    }
  }
  return seen;
}

std::vector<Harmonic> correlatedTerms(const std::vector<Response>& responses, const Light& light) {
  std::vector<Harmonic> seen = correlatedTerms(responses, light.harmonics);
  for (std::size_t term = 0; term < std::min(seen.size(), light.error.content.size()); ++term) {
    if (light.error.content[term] != std::complex<float>{}) seen[term] = Harmonic::Seen;
  }
  return seen;
}

std::vector<SeenHarmonic> foldedTerms(const std::vector<Response>& responses, int harmonics, int steps) {
  const std::vector<Harmonic> terms = correlatedTerms(responses, harmonics);
  std::vector<SeenHarmonic> seen(terms.begin(), terms.end());
  for (std::size_t term = 0; term < seen.size(); ++term) {
    const std::size_t i = term % static_cast<std::size_t>(harmonics);
    const int n = static_cast<int>(i) + 1;
    const bool is_alike = n % steps == 1 % steps, is_mirrored = !is_alike && (n + 1) % steps == 0;
    SeenHarmonic& harmonic = seen[term];
    if (i == 0 || harmonic.how != Harmonic::Faint || !(is_alike || is_mirrored)) continue;
    const auto& contents = responses[term / static_cast<std::size_t>(harmonics)].harmonics;
    harmonic.is_folded = true;
    harmonic.is_mirrored = is_mirrored;
    harmonic.beside_first =
        std::complex<float>{contents[i] / (is_mirrored ? std::conj(contents[0]) : contents[0])};
  }
  return seen;
}

Light correlatedPart(const Light& light, const std::vector<Response>& responses, bool all_harmonics) {
  Light part;
  part.frequencies = light.frequencies;
  part.harmonics = light.harmonics;
  if (all_harmonics) {
    part.phasors = light.phasors;
  } else {
    part.phasors.resize(light.phasors.size());
    const std::vector<Harmonic> seen = correlatedTerms(responses, light);
    for (std::size_t term = 0; term < seen.size(); ++term) {
      if (seen[term] != Harmonic::Unseen) part.phasors[term] = light.phasors[term];
    }
  }
  part.steady = light.steady;
  part.ambient = light.ambient;
  part.truth.albedo = light.truth.albedo;  // ambient light asks for it
  part.error = light.error;
  return part;
}

Correlator::Correlator(const Light& light, const std::vector<Response>& responses, int steps, int taps)
    : light_(light), step_count_(steps), taps_(taps) {
  for (std::size_t f = 0; f < responses.size(); ++f) {
    frequencies_.push_back(responses[f].frequency);
    for (int k = 0; k < steps; ++k) {
      steps_.push_back({static_cast<float>(0.5 * responses[f].electrons_per_radiance),
                        weightsOf(responses[f], light, f, k, steps)});
    }
  }
}

/// The weights of frequency `f` at step `k` of `steps`.
std::vector<Correlator::Weight> Correlator::weightsOf(const Response& response, const Light& light,
                                                      std::size_t f, int k, int steps) {
  double theta = 2.0 * std::numbers::pi * k / steps;
  const auto step = static_cast<std::size_t>(k);
  if (step < light.error.step_rad.size()) theta += static_cast<double>(light.error.step_rad[step]);
  std::vector<Weight> weights;
  for (std::size_t i = 0; i < response.harmonics.size(); ++i) {
    const int n = static_cast<int>(i) + 1;
    std::complex<double> content = response.harmonics[i];
    const std::size_t at = f * static_cast<std::size_t>(light.harmonics) + i;
    if (at < light.error.content.size()) content += std::complex<double>{light.error.content[at]};
    const Image<std::complex<float>>& phasors = light.phasor(f, n);
    if (std::abs(content) < kNoContent || phasors.empty()) continue;
    const std::complex<double> weight =
        0.5 * response.electrons_per_radiance * response.contrast * content * std::polar(1.0, n * theta);
    weights.push_back({&phasors, static_cast<float>(weight.real()), static_cast<float>(weight.imag())});
  }
  return weights;
}

Samples Correlator::rows(int count) const {
  Samples samples{.frequencies = frequencies_, .steps = step_count_, .taps = taps_};
  samples.electrons.assign(steps_.size() * static_cast<std::size_t>(taps_),
                           Image<float>{light_.width(), count});
  return samples;
}

void Correlator::collect(int top, int first, int last, Samples& samples) const {
  constexpr int kPiece = 512;  // pixels at a time
  float modulated[kPiece];
  for (int y = first; y < last; ++y) {
    for (int x = 0; x < light_.width(); x += kPiece) {
      const int count = std::min(kPiece, light_.width() - x);
      Image<float>* electrons = samples.electrons.data();
      for (const Step& step : steps_) {
        if (step.weights.empty()) std::fill_n(modulated, count, 0.0F);
        for (std::size_t i = 0; i < step.weights.size(); ++i) {
          const Weight& weight = step.weights[i];
          // A complex number is an array of two.
          const auto* parts = reinterpret_cast<const float*>(&(*weight.phasors)(x, top + y));
          (i == 0 ? setModulated : addModulated)(parts, weight.real, weight.imaginary, count, modulated);
        }
        fillTaps(&light_.steady(x, top + y), &light_.ambient(x, top + y), modulated, step.half_gain, count,
                 &electrons[0](x, y), taps_ == 2 ? &electrons[1](x, y) : nullptr);
        electrons += taps_;
      }
    }
  }
}

Samples correlate(const Light& light, const std::vector<Response>& responses, int steps, int taps) {
  const Correlator correlator{light, responses, steps, taps};
  Samples samples = correlator.rows(light.height());
  forRows(light.height(), [&](int first, int last) { correlator.collect(0, first, last, samples); });
  return samples;
}

}  // namespace toftwin::sim
