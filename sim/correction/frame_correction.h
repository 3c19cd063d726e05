// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include <toftwin/frame.h>
#include <toftwin/image.h>

#include "sim/correction/learned_correction.h"
#include "sim/effects/learned/ready_correction.h"

namespace toftwin::sim {

/// Takes learned errors off the frames of one camera: what the daemon serves and what `toftwin correct` writes. One thread at
/// a time.
class FrameCorrection {
 public:
  explicit FrameCorrection(std::shared_ptr<const LearnedCorrection> correction);

  enum class Done {
    Corrected,
    CorrectedBefore,  ///< provenance says so already, as in a recording of a corrected source; nothing was changed
    WithoutRange,     ///< there is no plane to correct, of the camera's size; nothing was changed
  };
  /// Range and Depth, and Amplitude of terms of it, without the learned errors. Provenance then says by what.
  Done correct(Frame& frame);

  /// Range of each pixel in metres, of a frame that has depth alone by its rays; NaN where there is none. Empty if the frame has
  /// neither.
  [[nodiscard]] Image<float> rangesOf(const Frame& frame);

  [[nodiscard]] const LearnedCorrection& of() const { return *correction_; }

 private:
  void note(Provenance& provenance, const Conditions& now) const;
  Correction::Images undone(Correction::Images measured, const Conditions& now);
  const Image<float>& ratioFor(const CameraInfo& camera);

  std::shared_ptr<const LearnedCorrection> correction_;  // shared with the configuration, which opens sources again
  bool uses_amplitude_ = false;
  Image<float> range_per_depth_;                         ///< of the camera below; empty until it is needed
  CameraInfo of_camera_;
  std::optional<ReadyCorrection> ready_;  ///< of the camera below; empty until it is needed
  CameraInfo ready_for_;
};

/// How provenance begins what it says of a correction: "corrected by model.toml (1a2b3c4d)".
inline constexpr std::string_view kCorrectedBy = "corrected by ";
/// What provenance says of the correction of a frame; empty if it was not corrected.
std::string correctionOf(const Provenance& provenance);

}  // namespace toftwin::sim
