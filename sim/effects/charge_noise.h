// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "sim/effects/effects.h"

namespace toftwin::sim {

/// Shot noise, full well and read noise that follow each other, in one pass over the pixels: a sum of two
/// independent Gaussians is a Gaussian of summed variance, so that one normal number does for both.
///     S → S + √(fano S + σ²) z
/// That leaves out the third moment of Poisson's distribution. The skewness γ = λ / (λ + σ²)^(3/2) is at most
/// 0.385 / σ, and makes the distribution function wrong by γ/6 · φ(0): with σ ≥ kLeastSigma by less than 1.3e-3,
/// and poisson() itself is wrong by up to 1.5e-3. Charges within seven standard deviations of the full well are
/// drawn step by step, as the effects do it, those beyond are cut.
struct ChargeNoise {
  static constexpr double kLeastSigma = 20.0;  ///< electrons, per √fano

  ShotNoise shot;
  std::optional<Saturation> well;
  ReadNoise read;
  std::size_t read_place;  ///< of the last of them in the model

  /// Those that begin at `first`, with nothing between them but effects on other images; nothing if it is not so.
  static std::optional<ChargeNoise> from(std::span<const AnyEffect> effects, std::size_t first);

  /// `of_shot` and `of_read` are the random numbers that the effects themselves would have.
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& of_shot,
                              const Random& of_read) const;
};

}  // namespace toftwin::sim
