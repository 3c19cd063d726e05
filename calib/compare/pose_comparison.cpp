// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/pose_comparison.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/gross.h"

namespace toftwin::compare {
namespace {

bool isValidInBoth(const PoseComparison& pose, std::size_t pixel) {
  return pose.valid_a[pixel] >= 0.5F && pose.valid_b[pixel] >= 0.5F;  // false for NaN
}

Image<float> scaled(Image<float> image, float factor) {
  for (float& v : image.pixels()) v *= factor;
  return image;
}

/// PoseComparison::middle_mm, of pixels that both have.
double middleOf(const PoseComparison& pose, std::size_t frames_a, std::size_t frames_b) {
  std::vector<double> difference, noise;
  for (std::size_t i = 0; i < pose.difference_mm.size(); ++i) {
    if (!isValidInBoth(pose, i) || !std::isfinite(pose.difference_mm[i])) continue;
    difference.push_back(static_cast<double>(pose.difference_mm[i]));
    const auto of = [i](const Image<float>& image) { return static_cast<double>(image[i]); };
    noise.push_back(std::hypot(noiseOfMean(of(pose.noise_a_mm), frames_a, of(pose.valid_a)),
                               noiseOfMean(of(pose.noise_b_mm), frames_b, of(pose.valid_b))));
  }
  return middleOfCut_mm(difference, std::move(noise));
}

bool isFlying(const Image<float>& range, int x, int y, int dx, int dy, double jump) {
  const auto at = [&](int steps) {
    const int px = x + steps * dx, py = y + steps * dy;
    const bool inside = px >= 0 && py >= 0 && px < range.width() && py < range.height();
    return static_cast<double>(inside ? range(px, py) : kNaN);
  };
  const double a = at(-2), b = at(2), own = at(0), gap = std::abs(b - a);
  if (!(gap >= jump * std::min(a, b))) return false;  // false for NaN as well
  // A slanted surface climbs everywhere, a step only in the middle.
  if (!(std::abs(a - at(-3)) < 0.2 * gap && std::abs(b - at(3)) < 0.2 * gap)) return false;
  return std::min(std::abs(own - a), std::abs(own - b)) > 0.15 * gap;
}

/// Flying pixels of `from`, found in its own image, at the rays of `to`.
Image<std::uint8_t> flyingAlongRaysOf(const CameraInfo& to, const Image<float>& range,
                                      const CameraInfo& from) {
  const Image<std::uint8_t> own = flyingPixelsOf(range);
  Image<float> there(own.width(), own.height());
  for (std::size_t i = 0; i < own.size(); ++i) there[i] = own[i];
  there = nearestAlongRaysOf(to, there, from);
  Image<std::uint8_t> flying(to.width, to.height);
  for (std::size_t i = 0; i < flying.size(); ++i) flying[i] = there[i] > 0.5F ? 1 : 0;
  return flying;
}

}  // namespace

bool isCompared(const PoseComparison& pose, std::size_t pixel) {
  return isValidInBoth(pose, pixel) &&
         !isGross(static_cast<double>(pose.difference_mm[pixel]) - pose.middle_mm);
}

Image<float> comparedDifference_mm(const PoseComparison& pose) {
  Image<float> difference = pose.difference_mm;
  for (std::size_t i = 0; i < difference.size(); ++i) {
    if (!isCompared(pose, i)) difference[i] = kNaN;
  }
  return difference;
}

Image<float> noiseOfMean(const Image<float>& temporal_noise, std::size_t frames) {
  constexpr int kAround = 2;
  Image<float> noise(temporal_noise.width(), temporal_noise.height(), kNaN);
  if (frames < 2) return noise;
  // The median, as single pixels at an edge are far noisier: that of s² is below σ² (E. B. Wilson, M. M.
  // Hilferty, PNAS 17 (1931) 684).
  const double freedom = static_cast<double>(frames - 1), below = std::pow(1.0 - 2.0 / (9.0 * freedom), 1.5);
  std::vector<float> near;
  for (int y = 0; y < noise.height(); ++y) {
    for (int x = 0; x < noise.width(); ++x) {
      near.clear();
      for (int v = std::max(0, y - kAround); v <= std::min(noise.height() - 1, y + kAround); ++v) {
        for (int u = std::max(0, x - kAround); u <= std::min(noise.width() - 1, x + kAround); ++u) {
          if (std::isfinite(temporal_noise(u, v))) near.push_back(temporal_noise(u, v));
        }
      }
      if (near.empty()) continue;
      const auto middle = near.begin() + static_cast<std::ptrdiff_t>(near.size() / 2);
      std::nth_element(near.begin(), middle, near.end());
      noise(x, y) =
          static_cast<float>(static_cast<double>(*middle) / (below * std::sqrt(static_cast<double>(frames))));
    }
  }
  return noise;
}

Image<std::uint8_t> edgesOf(const Image<float>& range, const Image<float>& noise, double jump, int radius) {
  // Each jump of noise marks up to 30 pixels: at 5 σ, 6e-7 of them.
  constexpr double kSigmas = 5.0;
  Image<std::uint8_t> edge(range.width(), range.height());
  const auto noiseAt = [&](int x, int y) {
    return noise.empty() || !std::isfinite(noise(x, y)) ? 0.0 : static_cast<double>(noise(x, y));
  };
  const auto jumps = [&](int x, int y, int x2, int y2) {
    const auto a = static_cast<double>(range(x, y)), b = static_cast<double>(range(x2, y2));
    const double least = jump * std::min(a, b) + kSigmas * std::hypot(noiseAt(x, y), noiseAt(x2, y2));
    return std::abs(a - b) > least;  // false where one is NaN
  };
  const auto mark = [&](int cx, int cy) {
    for (int y = std::max(0, cy - radius); y <= std::min(range.height() - 1, cy + radius); ++y) {
      for (int x = std::max(0, cx - radius); x <= std::min(range.width() - 1, cx + radius); ++x)
        edge(x, y) = 1;
    }
  };
  for (int y = 0; y < range.height(); ++y) {
    for (int x = 0; x < range.width(); ++x) {
      if (x + 1 < range.width() && jumps(x, y, x + 1, y)) mark(x, y), mark(x + 1, y);
      if (y + 1 < range.height() && jumps(x, y, x, y + 1)) mark(x, y), mark(x, y + 1);
    }
  }
  return edge;
}

Image<std::uint8_t> flyingPixelsOf(const Image<float>& range, double jump) {
  Image<std::uint8_t> flying(range.width(), range.height());
  for (int y = 0; y < range.height(); ++y) {
    for (int x = 0; x < range.width(); ++x) {
      flying(x, y) = isFlying(range, x, y, 1, 0, jump) || isFlying(range, x, y, 0, 1, jump) ? 1 : 0;
    }
  }
  return flying;
}

Result<PoseComparison> comparePose(const Stack& a, const Stack& b) {
  if (a.pose() && b.pose() && !samePose(*a.pose(), *b.pose())) {
    const Vec3d shift = b.pose()->translation_m - a.pose()->translation_m;
    const auto &p = a.pose()->rotation_wxyz, &q = b.pose()->rotation_wxyz;
    const double half_turn = std::inner_product(p.begin(), p.end(), q.begin(), 0.0);  // its cosine
    return Error{
        Error::Code::InvalidArgument,
        fmt::format(
            "the cameras did not look from the same pose: B is {:.3f} mm away from A and turned by "
            "{:.3f}° against it. Only ranges along the same ray can be compared; set both to one pose.",
            1e3 * norm(shift), 360.0 / std::numbers::pi * std::acos(std::min(1.0, std::abs(half_turn))))};
  }
  PoseComparison result;
  result.pose = a.pose() ? a.pose() : b.pose();
  result.resampled = a.camera().width != b.camera().width ||
                     a.camera().height != b.camera().height || a.camera().fx != b.camera().fx ||
                     a.camera().fy != b.camera().fy || a.camera().cx != b.camera().cx ||
                     a.camera().cy != b.camera().cy ||
                     a.camera().distortion != b.camera().distortion;
  Image<float> range_b_mm = scaled(b.meanRange_m(), 1e3F), amplitude_b = b.meanAmplitude();
  result.noise_b_mm = scaled(b.temporalNoise_m(), 1e3F);
  result.valid_b = b.validShare();
  if (result.resampled) {
    result.flying_b = flyingAlongRaysOf(a.camera(), range_b_mm, b.camera());
    range_b_mm = alongRaysOf(a.camera(), range_b_mm, b.camera());
    result.noise_b_mm = nearestAlongRaysOf(a.camera(), result.noise_b_mm, b.camera());
    result.valid_b = nearestAlongRaysOf(a.camera(), result.valid_b, b.camera());
    if (!amplitude_b.empty()) amplitude_b = nearestAlongRaysOf(a.camera(), amplitude_b, b.camera());
  } else {
    result.flying_b = flyingPixelsOf(range_b_mm);
  }
  result.range_a_mm = scaled(a.meanRange_m(), 1e3F);
  result.noise_a_mm = scaled(a.temporalNoise_m(), 1e3F);
  result.valid_a = a.validShare();
  result.amplitude_a = a.meanAmplitude();
  result.edge = edgesOf(result.range_a_mm, noiseOfMean(result.noise_a_mm, a.frames()));
  result.flying_a = flyingPixelsOf(result.range_a_mm);
  result.difference_mm = Image<float>(a.camera().width, a.camera().height, kNaN);
  if (!amplitude_b.empty() && !result.amplitude_a.empty()) {
    result.amplitude_ratio = Image<float>(a.camera().width, a.camera().height, kNaN);
  }
  std::size_t shared = 0;
  for (std::size_t i = 0; i < result.difference_mm.size(); ++i) {
    if (std::isfinite(result.valid_b[i])) ++shared;
    result.difference_mm[i] = range_b_mm[i] - result.range_a_mm[i];
    if (!result.amplitude_ratio.empty())
      result.amplitude_ratio[i] = amplitude_b[i] / result.amplitude_a[i];
  }
  if (100 * shared < result.difference_mm.size()) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format(
            "the cameras share {} of {} rays: too few to compare. Are both camera models right?",
            shared, result.difference_mm.size())};
  }
  result.shared_rays = static_cast<double>(shared) / static_cast<double>(result.difference_mm.size());
  result.camera = a.camera();
  result.middle_mm = middleOf(result, a.frames(), b.frames());
  return result;
}

std::string resamplingNote(const PoseComparison& pose) {
  if (!pose.resampled) return {};
  return fmt::format(
      "The cameras have different lenses or resolutions: B is interpolated to A's rays, of which it shares "
      "{:.0f} %. "
      "What B alone looks at is not compared.",
      100.0 * pose.shared_rays);
}

}  // namespace toftwin::compare
