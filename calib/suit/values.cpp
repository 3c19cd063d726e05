// SPDX-License-Identifier: Apache-2.0
#include "calib/suit/values.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>

#include <toftwin/nan.h>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/least_squares.h"

namespace toftwin::suit {
namespace {

bool isInside(const RegionSpec& region, Vec3f point) {
  const std::array at{static_cast<double>(point.x), static_cast<double>(point.y),
                      static_cast<double>(point.z)};
  for (std::size_t k = 0; k < 3; ++k) {
    if (at[k] < region.lower_m[k] || at[k] > region.upper_m[k]) return false;
  }
  return true;
}

/// e of each pixel in mm; NaN where it is invalid.
double errorOf(const Seen& seen, const Image<float>& frame_m, std::uint32_t pixel) {
  return 1e3 * (static_cast<double>(frame_m[pixel]) - static_cast<double>(seen.range_m[pixel]));
}

/// Share of pixels and frames whose error fulfils `holds`; an invalid pixel's is NaN.
template <class Holds>
double share(const Seen& seen, std::span<const std::uint32_t> pixels, std::span<const Image<float>> frames_m,
             const Holds& holds) {
  std::size_t count = 0;
  for (const Image<float>& frame : frames_m) {
    for (const std::uint32_t pixel : pixels) count += holds(errorOf(seen, frame, pixel)) ? 1 : 0;
  }
  return static_cast<double>(count) / static_cast<double>(pixels.size() * frames_m.size());
}

double shareOfMissed(const RequirementSpec& requirement, const Seen& seen,
                     std::span<const std::uint32_t> pixels, std::span<const Image<float>> frames_m) {
  std::size_t missed = 0;
  const double within = requirement.within.in(millimetre);
  for (const Image<float>& frame : frames_m) {
    const auto good = std::ranges::count_if(
        pixels, [&](std::uint32_t pixel) { return std::abs(errorOf(seen, frame, pixel)) <= within; });
    missed += good < requirement.pixels ? 1 : 0;
  }
  return static_cast<double>(missed) / static_cast<double>(frames_m.size());
}

/// The median of a variance over n frames, relative to the true one: of χ² with n − 1 degrees, over n − 1.
/// Few frames understate noise by it: a tenth at four, a hundredth of the standard deviation at 34.
double medianOfVariance(std::size_t n) {
  thread_local std::vector<double> known;
  if (known.size() <= n) known.resize(n + 1, 0.0);
  if (known[n] == 0.0) {
    const double degrees = static_cast<double>(n - 1);
    known[n] = boost::math::quantile(boost::math::chi_squared{degrees}, 0.5) / degrees;
  }
  return known[n];
}

/// Median over pixels of their mean or standard deviation over frames.
double medianOverPixels(Kind kind, const Seen& seen, std::span<const std::uint32_t> pixels,
                        std::span<const Image<float>> frames_m) {
  std::vector<double> each;
  for (const std::uint32_t pixel : pixels) {
    compare::Running running;
    for (const Image<float>& frame : frames_m) {
      const double error = errorOf(seen, frame, pixel);
      if (std::isfinite(error)) running.add(error);
    }
    if (kind == Kind::Bias && running.n() > 0) each.push_back(running.mean());
    if (kind == Kind::Noise && running.n() > 1)
      each.push_back(running.variance() / medianOfVariance(running.n()));
  }
  const double median = compare::quantile(std::move(each), 0.5);
  return kind == Kind::Noise ? std::sqrt(median) : median;
}

/// How many trials a repeat is. Where repeats come out alike, whole frames may fail or always the same pixels; of a
/// share that no whole frames make, it is the pixels.
std::size_t trialsOfEach(std::span<const double> repeats, Counted counted) {
  const bool are_alike = std::ranges::all_of(repeats, [&](double one) { return one == repeats.front(); });
  if (!are_alike) return counted.pixels * counted.frames;
  constexpr double kRounding = 1e-9;
  const double frames = repeats.front() * static_cast<double>(counted.frames);
  const bool are_frames = std::abs(frames - std::round(frames)) < kRounding;
  return are_frames ? std::min(counted.pixels, counted.frames) : counted.pixels;
}

}  // namespace

std::vector<std::uint32_t> pixelsOf(const RequirementSpec& requirement, const Case& use, const Seen& seen) {
  const auto region = std::ranges::find(use.spec.regions, requirement.region, &RegionSpec::name);
  std::vector<std::uint32_t> pixels;
  for (std::uint32_t i = 0; i < seen.range_m.size(); ++i) {
    if (!std::isfinite(seen.range_m[i]) || seen.object[i] < 0) continue;
    const auto object = static_cast<std::size_t>(seen.object[i]);
    if (!requirement.object.empty() && use.object_names[object] != requirement.object) continue;
    if (!requirement.region.empty() && !isInside(*region, seen.point_m[i])) continue;
    pixels.push_back(i);
  }
  return pixels;
}

double valueOf(const RequirementSpec& requirement, const Seen& seen, std::span<const std::uint32_t> pixels,
               std::span<const Image<float>> frames_m) {
  if (requirement.kind == Kind::Pixels) return static_cast<double>(pixels.size());
  if (pixels.empty() || frames_m.empty()) return kNaN;
  const double within = requirement.within.in(millimetre);
  switch (requirement.kind) {
    case Kind::Accuracy:
      return share(seen, pixels, frames_m, [&](double e) { return std::abs(e) <= within; });
    case Kind::Valid:
      return share(seen, pixels, frames_m, [](double e) { return std::isfinite(e); });
    case Kind::Phantom:
      return share(seen, pixels, frames_m, [&](double e) { return e < -within; });
    case Kind::Missed:
      return shareOfMissed(requirement, seen, pixels, frames_m);
    case Kind::Bias:
    case Kind::Noise:
      return medianOverPixels(requirement.kind, seen, pixels, frames_m);
    case Kind::Pixels:
    case Kind::FrameRate:
      break;
  }
  return kNaN;
}

Estimate estimateOf(std::span<const double> repeats, std::optional<double> together, double level) {
  const compare::Summary summary = compare::summarise(repeats);
  Estimate estimate{.value = together.value_or(summary.mean), .low = 0.0, .high = 0.0, .repeats = summary.n};
  double half = std::numeric_limits<double>::infinity();
  if (summary.n >= 2) {
    const double degrees = static_cast<double>(summary.n - 1);
    half = compare::studentT(degrees, level) * summary.standard_error;
    if (together) half += std::abs(summary.mean - *together) / degrees;
  }
  estimate.low = estimate.value - half;
  estimate.high = estimate.value + half;
  return estimate;
}

Estimate shareEstimateOf(std::span<const double> repeats, std::optional<double> together, Counted counted) {
  Estimate estimate = estimateOf(repeats, together);
  if (std::isnan(estimate.value)) return estimate;
  const double trials = static_cast<double>(repeats.size() * trialsOfEach(repeats, counted));
  const auto floor =
      compare::shareInterval(estimate.value * trials, trials, compare::ShareRule::ClopperPearson);
  estimate.low = std::max(0.0, std::min(estimate.low, floor.low));
  estimate.high = std::min(1.0, std::max(estimate.high, floor.high));
  return estimate;
}

Estimate missedEstimateOf(std::span<const double> repeats, std::size_t frames) {
  const compare::Summary summary = compare::summarise(repeats);
  const double share = summary.mean, count = static_cast<double>(summary.n);
  double trials = count * static_cast<double>(frames);
  if (summary.n == 0 || frames == 0) return {.value = kNaN, .low = 0.0, .high = 1.0, .repeats = summary.n};
  if (share == 0.0 || share == 1.0) {
    trials = count;
  } else if (summary.n >= 2 && summary.sd > 0.0) {
    const double quantiles = compare::studentT(trials - 1.0) / compare::studentT(count - 1.0);
    trials =
        std::min(trials, share * (1.0 - share) * count / (summary.sd * summary.sd) * quantiles * quantiles);
  }
  const auto [low, high] = compare::shareInterval(share * trials, trials, compare::ShareRule::ClopperPearson);
  return {.value = share, .low = low, .high = high, .repeats = summary.n};
}

Estimate exactly(double value) { return {.value = value, .low = value, .high = value, .repeats = 1}; }

bool isAtLeast(Kind kind) {
  return kind == Kind::Accuracy || kind == Kind::Valid || kind == Kind::Pixels || kind == Kind::FrameRate;
}

bool isShare(Kind kind) {
  return kind == Kind::Accuracy || kind == Kind::Valid || kind == Kind::Missed || kind == Kind::Phantom;
}

double limitOf(const RequirementSpec& requirement) {
  switch (requirement.kind) {
    case Kind::Accuracy:
    case Kind::Valid:
      return requirement.at_least_percent / 100.0;
    case Kind::Missed:
    case Kind::Phantom:
      return requirement.at_most_percent / 100.0;
    case Kind::Bias:
    case Kind::Noise:
      return requirement.at_most.in(millimetre);
    case Kind::Pixels:
      return requirement.at_least_pixels;
    case Kind::FrameRate:
      return requirement.at_least_hz;
  }
  return kNaN;
}

std::string unitOf(Kind kind) {
  if (isShare(kind)) return "%";
  if (kind == Kind::Pixels) return "pixels";
  return kind == Kind::FrameRate ? "Hz" : "mm";
}

double shownScale(Kind kind) { return isShare(kind) ? 100.0 : 1.0; }

Verdict verdictOf(const RequirementSpec& requirement, const Estimate& estimate) {
  const double limit = limitOf(requirement);
  // The largest magnitude of an interval is at one of its ends; the smallest may be 0 within it.
  const bool is_signed = requirement.kind == Kind::Bias;
  const double size = is_signed ? std::abs(estimate.value) : estimate.value;
  const double most = is_signed ? std::max(std::abs(estimate.low), std::abs(estimate.high)) : estimate.high;
  const double least = is_signed ? (estimate.low <= 0.0 && estimate.high >= 0.0
                                        ? 0.0
                                        : std::min(std::abs(estimate.low), std::abs(estimate.high)))
                                 : estimate.low;
  const bool at_least = isAtLeast(requirement.kind);
  Verdict verdict{.estimate = estimate, .margin = at_least ? size - limit : limit - size};
  verdict.is_met = verdict.margin >= -1e-12 * std::max(1.0, limit);
  const double worst = at_least ? least - limit : limit - most,
               best = at_least ? most - limit : limit - least;
  verdict.is_certain = verdict.is_met ? worst >= -1e-12 * std::max(1.0, limit) : best < 0.0;
  return verdict;
}

double relativeMargin(const RequirementSpec& requirement, const Verdict& verdict) {
  const double limit = limitOf(requirement);
  // Of "at least 95 %" 5 % may fail, and that is the scale; "none" has the scale of one in a hundred.
  const double scale =
      isShare(requirement.kind) ? (isAtLeast(requirement.kind) ? 1.0 - limit : limit) : limit;
  return verdict.margin / std::max(scale, isShare(requirement.kind) ? 0.01 : 1e-9);
}

}  // namespace toftwin::suit
