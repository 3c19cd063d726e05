// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstdint>
#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/image.h>
#include <toftwin/units.h>

namespace toftwin::sim {

/// What the central ray of each pixel meets first, exact: the ground truth of a simulated frame.
struct Truth {
  Image<float> range_m;       ///< NaN where the ray meets nothing
  Image<Vec3f> normal;        ///< unit, camera frame, towards the camera; zero where nothing
  Image<float> albedo;        ///< NaN where nothing
};

/// How modulation and demodulation differ from what the camera file says of them; correlate() heeds it.
struct ModulationError {
  /// Added to the correlation's relative content ĉₙ, in the order of Light::phasors; empty: nothing.
  std::vector<std::complex<float>> content;
  /// By how much step k is late, of every frequency; steps beyond the last are exact.
  std::vector<float> step_rad;
};

/// How much of a harmonic of the light a camera sees. Faint is what its overtones have less of than a twentieth of
/// what the fundamental has.
enum class Harmonic : std::uint8_t { Unseen, Faint, Seen };

/// The same, and whether the camera's few steps can tell it from the first one at all. If not, it is folded: P₁ + w
/// Pₙ, or P₁ + conj(w Pₙ) where it is mirrored, is all that they see of both.
struct SeenHarmonic {
  // NOLINTNEXTLINE(google-explicit-constructor): mostly that is all there is to say
  SeenHarmonic(Harmonic as = Harmonic::Seen) : how(as) {}
  bool operator==(const SeenHarmonic&) const = default;

  Harmonic how;
  bool is_folded = false, is_mirrored = false;
  std::complex<float> beside_first{};  ///< w, if it is folded
};

/// The light that reaches each pixel from the camera's own emitters, before any electronics.
///
/// `phasors[f * harmonics + (n - 1)]` holds, for modulation frequency f and harmonic n = 1 … harmonics,
///     P(p) = Σ_paths w · exp(−i 2π n f L / c)
/// with L the optical length from emitter over all surfaces to the pinhole and w the path's radiance
/// [W m⁻² sr⁻¹]. A single surface at range r beside the emitter has arg P = −4π f r / c.
/// A harmonic that the camera does not correlate may be an empty image.
/// Without frequencies (a pulsed camera), `phasors[i]` holds gate charges, g₁ in the real part and g₂ in the
/// imaginary one, g the i-th PathFunctions of the request:
///     Σ_paths w · g(L)
/// so that what is linear in light (scatter) acts on them unchanged.
/// `steady` is the sum of all w alone: the emitters' unmodulated radiance.
/// `ambient` is the radiance of everything else (sun, lamps), unmodulated.
struct Light {
  std::vector<Frequency> frequencies;
  int harmonics = 1;
  std::vector<Image<std::complex<float>>> phasors;
  Image<float> steady;
  Image<float> ambient;
  /// Variance of the Monte-Carlo mean of the first harmonic's phasor, per frequency: (real variance
  /// + imaginary variance) / 2, as if samples were independent; they are spread evenly, which makes it
  /// an upper bound. Empty if one sample per pixel was taken.
  std::vector<Image<float>> variance;
  Truth truth;
  ModulationError error;

  [[nodiscard]] int width() const { return steady.width(); }
  [[nodiscard]] int height() const { return steady.height(); }
  Image<std::complex<float>>& phasor(std::size_t frequency, int harmonic) {
    return phasors[frequency * static_cast<std::size_t>(harmonics) + static_cast<std::size_t>(harmonic - 1)];
  }
  [[nodiscard]] const Image<std::complex<float>>& phasor(std::size_t frequency, int harmonic) const {
    return phasors[frequency * static_cast<std::size_t>(harmonics) + static_cast<std::size_t>(harmonic - 1)];
  }
};

}  // namespace toftwin::sim
