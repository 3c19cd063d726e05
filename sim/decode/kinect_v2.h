// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include <toftwin/image.h>

#include "sim/decode/decode.h"

namespace toftwin::sim {

/// The Kinect v2's own decoder, after the algorithm in libfreenect2's depth processors:
///  1. demodulation, each pixel's own phase taken off by the device's tables
///  2. a joint bilateral filter over 3 × 3 pixels of each frequency's phasors; a pixel whose
///  neighbours
///     have too different phases is at an edge
///  3. too little amplitude, at one frequency or in sum, is invalid
///  4. unwrapping (unwrap.h); phases that disagree are invalid, the more the stronger the signal
///  5. the emitter's place beside the lens
///  6. bounds; edges, and pixels between a nearer and a farther neighbour (flying pixels) are
///  invalid
/// Steps 2 and 6's edges can be left out, as there. Called by decode().
RangeImage decodeKinectV2(const Samples& samples, const DecodeSettings& settings,
                          const DecodeRays& rays);

/// The same of samples that need not all be there at once: they come in strips of rows, in any order and from many
/// threads. `settings` and `rays` must live as long.
class KinectV2Decoder {
 public:
  /// Of images like the one that `shape` describes, whose own images are not looked at.
  KinectV2Decoder(const Samples& shape, int width, int height, const DecodeSettings& settings, const DecodeRays& rays);
  ~KinectV2Decoder();

  /// Rows first ≤ y < last of these samples are those of the image from `top` on.
  void take(int top, const Samples& samples, int first, int last);
  /// When every row was taken.
  RangeImage finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// What the bilateral filter made of one frequency.
struct FilteredPhasors {
  Image<std::complex<float>> phasors;
  /// Σ (1 − cos Δφ)/2 over the eight neighbours that are strong enough.
  Image<float> unlikeness;
};

/// Joint bilateral filter: mean over 3 × 3 pixels with weights
///     g · exp(−k (1 − cos Δφ)/2),   k = 1.442695 · 5
/// g a Gaussian of σ = 3 pixels, Δφ the phase against the middle pixel. Neighbours weaker than
/// `least_amplitude` do not count; in a pixel that is weaker itself all count alike (k = 0). Pixels
/// without signal and the image's border stay as they are. Pixels that `flags`, unless it is empty, call
/// saturated become and count as zero.
FilteredPhasors bilateralFilter(const Image<std::complex<float>>& phasors, float least_amplitude,
                                const Image<std::uint8_t>& flags = {});

/// The same row by row: cheapest if they are asked for from top to bottom. Looks at the images as long as it lives.
class BilateralRows {
 public:
  BilateralRows(const Image<std::complex<float>>& phasors, float least_amplitude, const Image<std::uint8_t>& flags);
  BilateralRows(BilateralRows&&) noexcept;
  ~BilateralRows();
  void row(int y, std::complex<float>* phasors, float* unlikeness);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Pixels that the edge filter drops: `depth_m` along the optical axis, NaN where invalid already;
/// `is_edge` from the bilateral filter (unlikeness of 2.5 or more at any frequency); `brightness`
/// is the sum of the frequencies' amplitudes in counts. A pixel at an edge is dropped, and one that
/// hangs between a neighbour nearer by more than 50 mm and one farther by more than 30 mm, the
/// larger of both above 100 mm, where the brightness varies by 5 % or more. Neighbours at an edge
/// are not looked at.
Image<std::uint8_t> edgePixels(const Image<float>& depth_m, const Image<std::uint8_t>& is_edge,
                               const Image<float>& brightness);

}  // namespace toftwin::sim
