// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/progress.h"
#include "calib/compare/report.h"
#include "calib/plan/plan.h"
#include "calib/plan/run_index.h"
#include "calib/plan/seen.h"

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

/// Reads both recordings of a capture and compares them pixel by pixel. Errors name the capture: a file that
/// is missing, damaged or not the one that the index names, poses that disagree, fields of view that do not
/// overlap. `whole`: also gives the comparison of all pixels. A plate that moves is not compared pixel by pixel.
struct CompareHow {
  int stride = 1;
  std::array<std::vector<double>, 2>
      frequency_hz{};  ///< of A's and B's modulation, ascending; empty: not known
};
Result<ComparedCapture> compareCapture(const std::filesystem::path& run, const Plan& plan,
                                       const CaptureRecord& record, const CompareHow& how,
                                       compare::PoseComparison* whole = nullptr);

/// Error where a recording is missing or not the one that was captured.
Result<> checkHash(const std::filesystem::path& run, const RecordedFile& file);

/// What a run is judged by.
struct CompareRunJob {
  std::filesystem::path run;
  std::filesystem::path output;
  bool locked = false;  ///< judge on the locked captures, which can be done once
  std::string note;
  std::filesystem::path log{};  ///< a RunLog that the result is put into; empty: none
  std::function<bool()> interrupted{};
};

/// Compares the captures of a run and leaves index.html, report.json and report.md in the output folder;
/// gives what to say of it. A run that is not through is compared as far as it is, and the report says so.
Result<compare::WrittenReport> compareRun(const CompareRunJob& job, compare::Progress& progress);

}  // namespace toftwin::plan
