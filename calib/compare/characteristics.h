// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/compare/json.h"
#include "calib/compare/pose_comparison.h"
#include "calib/compare/statistics.h"

namespace toftwin::compare {

/// For each pose the number of its place: equal for equal poses, so that a pose visited again is no
/// second place. A pose that is not known is a place of its own.
std::vector<std::uint32_t> placesOf(const std::vector<PoseComparison>& poses);

/// What is near and far, in reports: between these ranges.
inline constexpr std::array kRangeEdges_m{0.0, 0.75, 1.0, 1.5, 2.0, 3.0, 4.5, 100.0};
std::string rangeRegionName(std::size_t bin);

/// One row of the result: some pixels of all poses together.
struct Region {
  std::string name;
  Summary difference_mm;  ///< its standard error is over places
  double noise_a_mm = 0.0, noise_b_mm = 0.0;  ///< medians over pixels
};

/// All poses together.
struct Characteristics {
  /// Pixels that differ by more than kGross_mm: a wrong period of the phase, or another surface.
  std::size_t gross = 0;
  std::size_t gross_on_surfaces = 0;    ///< of them, more than two pixels from a jump of A's range
  std::size_t surface_pixels = 0;       ///< there, valid in both, gross or not
  std::size_t poses_all_gross = 0;      ///< where both see something, and all of it is gross
  std::vector<Region> regions;          ///< the first is "all pixels"
  double valid_a = 0.0, valid_b = 0.0;  ///< share of pixels valid in at least half of the frames
  double mask_agreement = 0.0;          ///< share of pixels where both are valid or both are not
  double mask_overlap = 0.0;            ///< valid in both / valid in either
  std::size_t pixels = 0;               ///< that both cameras look at, over all poses
  std::size_t compared = 0;             ///< of these, valid in both and not gross
  std::size_t places = 0;               ///< different poses at which any are compared
  std::size_t flying_a = 0, flying_b = 0;  ///< of the compared pixels
  std::size_t edge_pixels = 0;             ///< of them too
  std::optional<std::size_t> flying_both;  ///< in the same pixel; none where B was interpolated
  Summary amplitude_ratio;  ///< B / A; n = 0 unless both give amplitude; error over places
  Summary noise_ratio;      ///< B / A per pixel; error over places
};
Characteristics characterise(const std::vector<PoseComparison>& poses);
Json toJson(const Characteristics& characteristics);

/// Mean of `y` in equally filled bins of `x`, with its standard error over places: how a difference
/// goes with a covariate.
struct Trend {
  std::vector<double> x, y;
  std::vector<double> low, high;  ///< mean ± 2 standard errors; NaN in a bin of one place
};
Trend trendOf(const std::vector<double>& x, const std::vector<double>& y,
              const std::vector<std::uint32_t>& place, int bins);

/// What A weighs in the mean of both cameras' ranges by 1/σ², σ_B²/(σ_A² + σ_B²). Of all means of the two it is
/// the one whose noise does not go with that of B − A: by A's own range a reading that is too far would fall into
/// a farther class or step, and its B − A be too small there. A half where no noise is known.
double weightOfA(double noise_a, double noise_b);

/// The compared pixels of all poses whose difference is known, as columns. `range_mm` is of both cameras, each
/// weighted by the noise of the other, so that it does not go with the noise of the difference.
struct Pixels {
  std::vector<double> difference_mm, range_mm, amplitude, amplitude_ratio, noise_a_mm, noise_b_mm;
  std::vector<bool> edge;
  std::vector<std::uint32_t> place;
};
Pixels pixelsOf(const std::vector<PoseComparison>& poses);

}  // namespace toftwin::compare
