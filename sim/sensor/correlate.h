// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <vector>

#include "sim/images/light.h"
#include "sim/images/samples.h"
#include "sim/sensor/waveform.h"

namespace toftwin::sim {

/// How a pixel answers to light modulated at one frequency.
struct Response {
  Frequency frequency{};
  double contrast = 1.0;                ///< m: amplitude of the fundamental per collected electron
  double electrons_per_radiance = 1.0;  ///< over one raw exposure, both taps together
  /// ĉₙ = eₙ rₙ* / |e₁ r₁| for n = 1 … harmonics: emitted and demodulating waveform.
  std::vector<std::complex<double>> harmonics{};

  /// The fundamental's phase at range zero: −arg ĉ₁.
  [[nodiscard]] Angle zeroPhase() const;
  /// Least charge of a tap per mean charge, over all phases: negative is impossible for a real
  /// pixel.
  [[nodiscard]] double leastCharge() const;
  bool operator==(const Response&) const = default;
};

/// ĉₙ of an emitted and a demodulating waveform. Empty if either has no fundamental.
std::vector<std::complex<double>> relativeHarmonics(const Waveform& emitted,
                                                    const Waveform& demodulating,
                                                    Frequency frequency, int count);

/// How correlate() sees the light's phasors, in their order, by what the responses hold of them.
std::vector<Harmonic> correlatedTerms(const std::vector<Response>& responses, int harmonics);
/// The same, with those seen that the light's own modulation error adds.
std::vector<Harmonic> correlatedTerms(const std::vector<Response>& responses, const Light& light);
/// The same, with the faint ones folded that so many steps see as they see the first: n = ±1 modulo the steps, where
/// exp(i n θₖ) = exp(±i θₖ). Right as long as nothing turns harmonics or shifts steps between the light and its
/// correlation.
std::vector<SeenHarmonic> foldedTerms(const std::vector<Response>& responses, int harmonics, int steps);

/// A copy of the light to be changed by effects, without what correlate() would not look at: harmonics that
/// no response holds are empty images, unless `all_harmonics` are asked for.
Light correlatedPart(const Light& light, const std::vector<Response>& responses, bool all_harmonics);

/// Collects a raw exposure's charge, noise-free: at step k, θₖ = 2πk/steps,
///     tap 0, 1 = g/2 · ( L + A ± m Re Σₙ ĉₙ Pₙ e^(i n θₖ) )
/// with the light's phasors Pₙ, its own unmodulated radiance L, the ambient radiance A, and g
/// electrons per radiance. The light's modulation error adds to ĉₙ and θₖ. Wiggling is born here:
/// harmonics that the steps cannot tell from the fundamental. The light has the responses' frequencies in
/// their order and at least their harmonics; a harmonic that is an empty image is taken as dark.
Samples correlate(const Light& light, const std::vector<Response>& responses, int steps, int taps);

/// The same row by row, as if asked for rows of correlate()'s samples. Looks at the light as long as it
/// lives.
class Correlator {
 public:
  Correlator(const Light& light, const std::vector<Response>& responses, int steps, int taps);

  /// Samples of so many rows, all zero.
  [[nodiscard]] Samples rows(int count) const;
  /// Writes the samples of rows `top`, `top` + 1, … into rows first ≤ y < last of `samples`: light's row is
  /// top + y.
  void collect(int top, int first, int last, Samples& samples) const;

 private:
  /// ½ g m ĉₙ e^(i n θₖ): what a phasor is multiplied with at one step.
  struct Weight {
    const Image<std::complex<float>>* phasors;
    float real, imaginary;
  };
  struct Step {
    float half_gain;
    std::vector<Weight> weights;
  };
  static std::vector<Weight> weightsOf(const Response& response, const Light& light, std::size_t f, int k,
                                       int steps);

  const Light& light_;
  int step_count_, taps_;
  std::vector<Frequency> frequencies_;
  std::vector<Step> steps_;  ///< frequency by frequency
};

}  // namespace toftwin::sim
