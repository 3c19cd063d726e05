// SPDX-License-Identifier: Apache-2.0
#include "sim/decode/kinect_v2_rows.h"

#include <algorithm>

#include <toftwin/nan.h>

#include "sim/decode/unwrap_kinect_v2.h"
#include "sim/images/rough_logarithm.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

constexpr std::uint32_t bitsOf(PixelFlag flag) {
  return static_cast<std::uint32_t>(flag) | static_cast<std::uint32_t>(PixelFlag::Invalid);
}
constexpr auto kTooWeak = bitsOf(PixelFlag::LowAmplitude), kOutside = bitsOf(PixelFlag::OutOfRange);

}  // namespace

namespace {

constexpr std::size_t kPart = 128;  ///< pixels at once, whose numbers stay in the nearest cache

/// Of some pixels. Numbers first and what they mean after: loops of one width of numbers become vector code.
struct Measured {
  double range_m[kPart], depth_m[kPart], weakest[kPart], sum[kPart];
  float deviation[kPart], strongest[kPart];
};

/// By so much in its logarithm a deviation must be away from the threshold to be judged by rough logarithms, whose
/// errors are below a fifth of it.
constexpr float kDoubt = 1e-4F;

TOFTWIN_SIMD void measurePart(const KinectSeen& seen, const KinectLimits& limits, std::size_t first,
                              std::size_t count, const KinectFound& found, Measured& measured) {
  const double k0 = limits.counts_per_electron[0], k1 = limits.counts_per_electron[1],
               k2 = limits.counts_per_electron[2], unit_m = limits.unit_m, baseline_m = limits.baseline_m,
               square = limits.baseline_square;
  const float *c0 = seen.cycles[0] + first, *c1 = seen.cycles[1] + first, *c2 = seen.cycles[2] + first;
  const float *a0 = seen.amplitudes[0] + first, *a1 = seen.amplitudes[1] + first,
              *a2 = seen.amplitudes[2] + first;
  const float *ray_x = seen.ray_x + first, *ray_z = seen.ray_z + first;
  double *deviation_rad = found.deviation_rad + first, *strongest_counts = found.strongest_counts + first;
  double *range_m = measured.range_m, *depth_m = measured.depth_m, *weakest = measured.weakest,
         *sum = measured.sum;
  float *deviation = measured.deviation, *strongest = measured.strongest;
#pragma GCC ivdep
  for (std::size_t x = 0; x < count; ++x) {
    const double n0 = static_cast<double>(a0[x]) * k0, n1 = static_cast<double>(a1[x]) * k1,
                 n2 = static_cast<double>(a2[x]) * k2;
    const double less = n1 < n0 ? n1 : n0, more = n1 > n0 ? n1 : n0;
    weakest[x] = n2 < less ? n2 : less;
    strongest_counts[x] = n2 > more ? n2 : more;
    sum[x] = n0 + n1 + n2;
  }
#pragma GCC ivdep
  for (std::size_t x = 0; x < count; ++x) {
    const Unwrapped joined = joinKinectV2(static_cast<double>(c0[x]), static_cast<double>(c1[x]),
                                          static_cast<double>(c2[x]), unit_m);
    range_m[x] = joined.range_m;
    deviation_rad[x] = joined.deviation_rad;
  }
  for (std::size_t x = 0; x < count; ++x) {
    deviation[x] = static_cast<float>(deviation_rad[x]);
    strongest[x] = static_cast<float>(strongest_counts[x]);
  }
  if (baseline_m != 0.0) {
#pragma GCC ivdep
    for (std::size_t x = 0; x < count; ++x) {
      const double way_m = 2.0 * range_m[x];
      range_m[x] = (way_m * way_m - square) / (2.0 * (way_m - baseline_m * static_cast<double>(ray_x[x])));
    }
  }
#pragma GCC ivdep
  for (std::size_t x = 0; x < count; ++x) depth_m[x] = range_m[x] * static_cast<double>(ray_z[x]);
}

/// Which deviations are over the threshold between that of strong and that of weak signals, and which hardly.
TOFTWIN_SIMD void holdAgainstThreshold(const Measured& measured, std::size_t count, std::uint32_t* __restrict apart) {
  constexpr auto kSlope = static_cast<float>(kThresholdSlope), kLevel = static_cast<float>(kThresholdLevel);
  const float *deviation = measured.deviation, *strongest = measured.strongest;
  for (std::size_t x = 0; x < count; ++x) {
    const float beyond = roughLogarithm(deviation[x]) - (kSlope * roughLogarithm(strongest[x]) + kLevel);
    apart[x] = beyond > kDoubt ? kUnreliable : beyond < -kDoubt ? 0U : kDoubtful;
  }
}

TOFTWIN_SIMD bool judgePart(const Measured& measured, const KinectLimits& limits, std::size_t first,
                            std::size_t count, const KinectFound& found) {
  const double least = limits.least_counts, least_sum = limits.least_sum_counts, weak = limits.weak_rad,
               strong = limits.strong_rad, nearest = limits.nearest_m, farthest = limits.farthest_m;
  const double *depth_m = measured.depth_m, *weakest = measured.weakest, *sum = measured.sum,
               *deviation = found.deviation_rad + first, *range = measured.range_m;
  std::uint32_t* __restrict why = found.why + first;
  float* __restrict range_m = found.range_m + first, * __restrict brightness = found.brightness + first;
  std::uint32_t all = 0, between[kPart];
  holdAgainstThreshold(measured, count, between);
  for (std::size_t x = 0; x < count; ++x) {
    const bool is_seen = (weakest[x] > 0.0) & (weakest[x] >= least) & (sum[x] >= least_sum);
    const bool is_within = (depth_m[x] >= nearest) & (depth_m[x] <= farthest);
    const std::uint32_t outside = is_within ? 0U : kOutside;
    const std::uint32_t apart = deviation[x] > weak ? kUnreliable : deviation[x] > strong ? between[x] : 0U;
    const std::uint32_t bits = is_seen ? outside | apart : kTooWeak;
    why[x] = bits;
    all |= bits;
  }
  for (std::size_t x = 0; x < count; ++x) range_m[x] = static_cast<float>(range[x]);
  for (std::size_t x = 0; x < count; ++x) brightness[x] = static_cast<float>(sum[x]);
  return (all & kDoubtful) != 0;
}

}  // namespace

bool measureKinectRow(const KinectSeen& seen, const KinectLimits& limits, std::size_t width,
                      const KinectFound& found) {
  Measured measured;
  bool is_any_doubtful = false;
  for (std::size_t first = 0; first < width; first += kPart) {
    const std::size_t count = std::min(kPart, width - first);
    measurePart(seen, limits, first, count, found, measured);
    is_any_doubtful |= judgePart(measured, limits, first, count, found);
  }
  return is_any_doubtful;
}

TOFTWIN_SIMD void judgeRow(const std::uint8_t* before, const std::uint32_t* __restrict why, std::size_t width,
                           float* __restrict range_m, std::uint8_t* __restrict flags) {
  constexpr auto kSaturated = static_cast<std::uint32_t>(PixelFlag::Saturated),
                 kInvalid = static_cast<std::uint32_t>(PixelFlag::Invalid);
  for (std::size_t x = 0; x < width; ++x) flags[x] = static_cast<std::uint8_t>(why[x]);
  if (before != nullptr) {
    for (std::size_t x = 0; x < width; ++x) {
      const std::uint32_t was = before[x];
      flags[x] = static_cast<std::uint8_t>(flags[x] | was | ((was & kSaturated) != 0 ? kInvalid : 0U));
    }
  }
  for (std::size_t x = 0; x < width; ++x) {
    const std::uint32_t now = flags[x] | (range_m[x] != range_m[x] ? kInvalid : 0U);  // NaN
    flags[x] = static_cast<std::uint8_t>(now);
    range_m[x] = (now & kInvalid) != 0 ? kNaN : range_m[x];
  }
}

TOFTWIN_SIMD void markEdges(std::span<const float> unlikeness, float most, std::span<std::uint8_t> is_edge) {
  const float* from = unlikeness.data();
  std::uint8_t* to = is_edge.data();
#pragma GCC ivdep
  for (std::size_t i = 0; i < unlikeness.size(); ++i) to[i] = from[i] >= most ? 1 : to[i];
}

TOFTWIN_SIMD void addAmplitudes(const std::complex<float>* phasors, float share, std::size_t width,
                                float* __restrict mean) {
  const auto* parts = reinterpret_cast<const float*>(phasors);  // a complex number is an array of two
  for (std::size_t x = 0; x < width; ++x) {
    const float real = parts[2 * x], imaginary = parts[2 * x + 1];
    mean[x] += share * __builtin_sqrtf(real * real + imaginary * imaginary);
  }
}

}  // namespace toftwin::sim
