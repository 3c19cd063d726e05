// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/geometry.h>
#include <toftwin/image.h>

#include "calib/suit/use_case.h"

namespace toftwin::suit {

/// What a camera at one place would see if it made no error.
struct Seen {
  Image<float> range_m{};        ///< along the ray; NaN where nothing is
  Image<std::int32_t> object{};  ///< number in the scene, −1 where nothing is
  Image<Vec3f> point_m{};        ///< in the world
};

/// Numbers of the pixels that a requirement is about: all that see anything, or its object, or its region.
std::vector<std::uint32_t> pixelsOf(const RequirementSpec& requirement, const Case& use, const Seen& seen);

/// What frames of one place come to, in the requirement's own unit: shares are 0 … 1, lengths mm. Errors are
/// e = range − true range of each of `pixels` in each frame.
///   accuracy  share of pixels and frames that are valid with |e| ≤ within
///   bias      median over pixels of the mean of e over frames      (signed)
///   noise     standard deviation over frames: √ of the median over pixels of s² (n − 1) / median of χ²(n −
///   1) valid     share of pixels and frames that are valid missed    share of frames with fewer than
///   `pixels` pixels valid with |e| ≤ within phantom   share of pixels and frames that are valid with e <
///   −within pixels    number of pixels
/// NaN where nothing is to be judged.
double valueOf(const RequirementSpec& requirement, const Seen& seen, std::span<const std::uint32_t> pixels,
               std::span<const Image<float>> frames_m);

/// A value with the interval that holds it with 95 %.
struct Estimate {
  double value = 0.0, low = 0.0, high = 0.0;
  std::size_t repeats = 0;
};

/// From independent repeats θ_r and, where there is one, the value θ_P of all repeats' light together:
///   θ_P ± ( t(0.975, R − 1) sd(θ_r)/√R + |mean θ_r − θ_P| / (R − 1) )
/// The second term is what the tracer's own noise, which falls as one over the number of paths, still moves
/// θ_P by. Without θ_P the mean of the repeats stands for it.
/// `level`: what the interval is to hold with.
Estimate estimateOf(std::span<const double> repeats, std::optional<double> together, double level = 0.95);

/// What a repeat counts to get a share.
struct Counted {
  std::size_t pixels = 0, frames = 0;
};
/// The same of a share of pixels and frames, cut to 0 … 1, and never narrower than counting leaves it:
/// Clopper and Pearson's interval of so many events in all pixels and frames; where all repeats are alike, so
/// that they say nothing of how they scatter, in min(pixels, frames) trials of each, or in so many as it has pixels
/// where the share is of no whole frames. More are not independent where whole frames fail, or always the same pixels.
Estimate shareEstimateOf(std::span<const double> repeats, std::optional<double> together, Counted counted);
/// Of the shares of missed frames in each repeat. Frames of one repeat share its light and its fixed pattern,
/// so that a repeat, not a frame, is what is independent: with the share p, Clopper and Pearson's interval of
///   n* = min( R F, p (1 − p) R / sd²(p_r) · (t(R F − 1) / t(R − 1))² )
/// trials (E. L. Korn, B. I. Graubard, Surv. Methodol. 24 (1998) 193), and of R trials where none or all are
/// missed.
Estimate missedEstimateOf(std::span<const double> repeats, std::size_t frames);
/// A number that nothing makes uncertain.
Estimate exactly(double value);

/// Whether a requirement asks for at least its limit, or at most.
bool isAtLeast(Kind kind);
bool isShare(Kind kind);
/// In the unit of valueOf().
double limitOf(const RequirementSpec& requirement);
/// "mm", "%", "pixels", "Hz": what the report shows.
std::string unitOf(Kind kind);
/// From the unit of valueOf() to that of the report.
double shownScale(Kind kind);

/// An estimate against its limit. The margin is positive where the requirement is met, in the unit of
/// valueOf(); for bias it is the limit less |value|.
struct Verdict {
  Estimate estimate{};
  double margin = 0.0;
  bool is_met = false;
  bool is_certain = false;  ///< the whole interval is on the same side of the limit
};
Verdict verdictOf(const RequirementSpec& requirement, const Estimate& estimate);
/// The margin relative to the limit, to compare requirements of different units; shares of what may fail.
double relativeMargin(const RequirementSpec& requirement, const Verdict& verdict);

}  // namespace toftwin::suit
