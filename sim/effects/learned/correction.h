// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

#include "sim/effects/effect.h"
#include "sim/effects/learned/decoded_images.h"
#include "sim/effects/learned/learned.h"

namespace toftwin::sim {

/// Takes learned errors off decoded images. Of terms of the range and of the amplitude,
///     r_m = r + Σ t(r, A, …),  A_m = A (1 + Σ g(r, A, …))
/// finds r and A where r_m and A_m are known. Effects are undone from the last to the first. Stateless but for the
/// effects: equal input, equal output, also on several threads.
class Correction {
 public:
  /// Error Unsupported: the first term that cannot be undone, with why: noise, readings that are lost, what other pixels
  /// or other frames carry, light and charges, covariates that a decoded image does not tell.
  static Result<Correction> of(std::vector<Learned> effects);

  using Images = DecodedImages;
  /// Where no range gives what was measured (beyond a jump, where curves fold back), the nearest that was met is taken. Of many frames a
  /// ReadyCorrection does the same quicker.
  [[nodiscard]] Images undone(Images measured, const Conditions& now) const;
  [[nodiscard]] const std::vector<Learned>& effects() const { return effects_; }

  /// Covariates of the frame that this moment does not tell: terms with them add nothing, and nothing is taken off.
  [[nodiscard]] std::vector<std::string> unknownOf(const Conditions& now) const;
  [[nodiscard]] std::vector<std::string> covariates() const;
  [[nodiscard]] bool changesAmplitude() const;

 private:
  explicit Correction(std::vector<Learned> effects) : effects_(std::move(effects)) {}
  std::vector<Learned> effects_;
};

}  // namespace toftwin::sim
