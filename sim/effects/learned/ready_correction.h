// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/effects/effect.h"
#include "sim/effects/learned/decoded_images.h"
#include "sim/effects/learned/learned.h"
#include "sim/effects/learned/range_guess.h"
#include "sim/terms/image_terms.h"

namespace toftwin::sim {

/// A correction ready for the frames of one camera: what goes with places alone is computed once. One thread at a time; it
/// uses all cores itself.
class ReadyCorrection {
 public:
  /// Of images of that size, whose place in the full image and lens `now` says: these are the same for all frames. Precondition:
  /// Correction::of() takes these effects.
  ReadyCorrection(const std::vector<Learned>& effects, int width, int height, const Conditions& now);

  /// As Correction::undone(). Precondition: images of that size, of the same camera.
  [[nodiscard]] DecodedImages undone(DecodedImages measured, const Conditions& now);

 private:
  /// One effect. Terms of the range are told apart by whether they stay what they are while the range is looked for.
  struct Undo {
    std::optional<terms::ImageTerms> fixed{}, moving{}, amplitude{};
    /// Of `moving` what goes with the range alone: as an image of the guess's ranges in one row.
    std::optional<terms::ImageTerms> of_range{};
    std::vector<std::string> of_frame{};    ///< covariates of the frame in `of_range`
    std::vector<double> frame_values{};     ///< what these were when the guess was made
    RangeGuess guess{};
    void setFrame(const Conditions& now);
    void makeGuess(const Conditions& now);
    void undo(DecodedImages& images) const;
  };
  std::vector<Undo> undos_;  ///< the last effect comes first
};

}  // namespace toftwin::sim
