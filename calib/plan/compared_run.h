// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toftwin/image.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/named_traits.h"
#include "calib/plan/camera_seen.h"
#include "calib/plan/run_index.h"
#include "calib/plan/run_settings.h"

namespace toftwin::plan {

/// What a camera read in a capture over its own mask, whatever the other one saw.
struct OwnReading {
  /// Every so-manieth pixel of each row and column, of the kinds that are series (warm_up, ambient); else
  /// empty.
  Image<float> range_mm{}, noise_each_mm{};
  double noise_mm = 0.0, amplitude = 0.0;  ///< medians; NaN where there is none
};

/// One capture of a run, compared.
struct ComparedCapture {
  CaptureRecord record;
  std::size_t pixels = 0;                                  ///< compared, surfaces and edges together
  double difference_mm = 0.0;                              ///< mean of B − A over them; NaN without any
  double error_mm = 0.0;                                   ///< its standard error over the image, by blocks
  double range_a_mm = 0.0;                                 ///< mean, over the compared pixels as all below
  double noise_a_mm = 0.0, noise_b_mm = 0.0;               ///< temporal, medians
  double amplitude_a = 0.0, amplitude_b = 0.0;             ///< medians; NaN where a camera gives none
  double valid_a = 0.0, valid_b = 0.0, masks_agree = 0.0;  ///< shares of the pixels
  /// Every so-manieth pixel of each row and column, for what is told of all captures together.
  compare::PoseComparison thinned;
  /// Of the distance block: range to the plan's wall along the rays of `thinned`, NaN beside it; empty where
  /// no pose is known.
  Image<float> wall_range_m{};
  /// Standard error of the range to the plan's wall by what the pose is known to be uncertain by: of A's
  /// frames, and what B's own adds where it saw where it stood; 0 where nobody says.
  std::array<double, 2> pose_error_mm{};
  std::array<CameraSeen, 2> seen{};  ///< of A and B, each by itself
  std::array<OwnReading, 2> own{};   ///< of A and B, each by its own mask
  std::size_t frames_of_b = 0, same_frames = 0;  ///< in which anything is seen, and how many of them are A's
};

/// The compared captures of a run, in its order.
struct ComparedRun {
  std::string plan;  ///< its name
  std::vector<ComparedCapture> captures;
  std::vector<ComparedCapture> moving{};  ///< of a plate that moves: not compared pixel by pixel
  std::vector<std::pair<std::string, compare::PoseComparison>>
      examples;  ///< whole images, a capture of each block
  /// Modulation frequencies of A and B, by the first capture's frames; empty: none is told.
  std::array<std::vector<double>, 2> frequency_hz{};
  std::vector<std::string> warnings;
  std::vector<RunSetting> settings{};  ///< what it was made with
  bool is_locked = false;  ///< of the locked captures
};

/// A characteristic of a run. Over captures each is a row: of B − A its mean over the
/// pixels that both cameras see, of a camera by itself over its own. Errors of a
/// camera by itself are against the surfaces that the plan puts before it.
using RunTrait = compare::NamedTrait;
using RunTraits = compare::NamedTraits;

/// Characteristics that a page draws.
inline constexpr const char *kDrift = "drift", *kHarmonicsOfWall = "harmonics, against the plan's wall",
                            *kNoiseLaw = "noise law", *kNoiseOverDistance = "temporal noise over distance",
                            *kPatternOverDistance = "fixed pattern over distance",
                            *kPatternOverAmplitude = "fixed pattern over amplitude";

inline constexpr std::array kCameras{"A", "B"};

using Captures = std::vector<const ComparedCapture*>;
/// Those of blocks of a kind, or of all, of which both cameras see a pixel.
Captures capturesOf(const ComparedRun& run, std::string_view kind);
/// Those of blocks of a kind, whatever is seen, also of a plate that moves.
Captures allCapturesOf(const ComparedRun& run, std::string_view kind);

}  // namespace toftwin::plan
