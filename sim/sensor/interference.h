// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/units.h>

#include "sim/images/light.h"
#include "sim/sensor/waveform.h"
#include "sim/tracer/scene_file.h"
#include "sim/tracer/trace.h"

namespace toftwin::sim {

/// How the modulated light of another camera, or of a lamp, interferes with a camera that demodulates. Its mean counts
/// as ambient light: charge and shot noise. Of its modulation, a raw exposure from t − T/2 to t + T/2 (device time)
/// keeps where overtones of both meet: with the other light's waveform e′ at frequency f′ and its phase φ at time 0,
/// the pixel's reference r at f, and the response of correlate() to the camera's own e,
///     ± g/2 · C Re Σₙ Σₘ (q e′ₘ rₙ* / |e₁ r₁|) P′ₘ exp(i (n θₖ + m φ + 2π Δ t)) sinc(π Δ T),   Δ = m f′ − n f
/// with the pixel's contrast C, P′ₘ the other light's phasor over the way to the pixel at m f′, q how much of the waveform's
/// modulation it has, and sinc x = sin x / x. Of m, the two count whose m f′ lie next to n f: all others beat at f′ or faster,
/// of which an exposure keeps less than 1 / (π f′ T). So many harmonics n count as the camera's own (`sampling.harmonics`).
/// Closed form of the integral over the exposure of both Fourier series; the sum over n is that of correlate().
///
/// Deviations: effects on the camera's own emission (delays, duty_drift, rise_drift) act on both lights together, where the
/// own waveform nearly lacks a harmonic by much. Clocks are exact: clock_scale changes ranges, not beats.
/// Of a camera with the effect `harmonics`, which adds to what overtones are worth, n = 1 alone counts. Where many
/// pulses fall into an exposure, a pulsed camera sees the mean alone.
class Interference {
 public:
  /// One of the camera's modulations.
  struct Own {
    Frequency frequency{};
    Waveform emitted{}, demodulating{};
  };
  Interference(ForeignEmitterSpec emitter, const std::vector<Own>& own, int harmonics);

  /// What to trace for the camera of `own`: the other light alone, at the frequencies that count.
  [[nodiscard]] TraceRequest request(const TraceRequest& own) const;
  /// Adds to the camera's own light what the raw exposure sees of the other one, which was traced as request() says.
  /// The exposure's times are those of the first row; each further one is exposed by `row_delay` later.
  void addTo(Light& light, const Light& other, const Exposure& exposure, Duration row_delay) const;
  bool operator==(const Interference&) const = default;

 private:
  /// A harmonic of its light against one of a reference.
  struct Beat {
    std::size_t own;    ///< which modulation
    int harmonic;       ///< n
    std::size_t other;  ///< which of frequencies_: m f′
    int times;          ///< m
    Frequency difference;
    std::complex<double> weight;  ///< beside the own phasor Pₙ
    bool operator==(const Beat&) const = default;
  };
  /// A harmonic that the reference has and the own light lacks: its phasor and what that is worth are the other's.
  struct Lacking {
    std::size_t own;
    int harmonic;
    std::complex<double> content;  ///< rₙ* / |e₁ r₁|
    bool operator==(const Lacking&) const = default;
  };
  void addBeatsOf(std::size_t own, const Own& modulation, int harmonic, double fundamental);
  [[nodiscard]] std::complex<double> coefficient(int times, const Waveform& like) const;
  std::size_t frequencyOf(int times);
  void addBeat(const Beat& beat, const Light& other, const Exposure& exposure, Duration row_delay, Light& light) const;

  ForeignEmitterSpec emitter_;
  std::vector<Frequency> frequencies_;  ///< m f′ of all beats
  std::vector<Beat> beats_;
  std::vector<Lacking> lacking_;
};

}  // namespace toftwin::sim
