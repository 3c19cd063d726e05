// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <toftwin/frame.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

#include "calib/compare/statistics.h"

namespace toftwin::compare {

/// What one source saw at one pose: per pixel the mean and variance over the frames, without
/// keeping the frames. Range is along the ray; a source that gives only depth is converted by its
/// camera model.
class Stack {
 public:
  /// Adds a frame. Errors: it has neither a range nor a depth plane of floats, or its camera model
  /// or pose is not that of the frames before.
  Result<> add(const Frame& frame);

  [[nodiscard]] std::size_t frames() const { return frames_; }
  [[nodiscard]] const CameraInfo& camera() const { return camera_; }
  [[nodiscard]] const std::optional<Transform<World, Camera>>& pose() const { return pose_; }
  /// The frames' provenance and moments, for the log; the first frame's.
  [[nodiscard]] const Provenance& provenance() const { return provenance_; }

  /// Mean range; NaN where less than half of the frames are valid.
  [[nodiscard]] Image<float> meanRange_m() const;
  /// Standard deviation of the range over time; NaN where fewer than two frames are valid.
  [[nodiscard]] Image<float> temporalNoise_m() const;
  /// Share of the frames in which the pixel is valid.
  [[nodiscard]] Image<float> validShare() const;
  /// Mean amplitude of the valid frames in the device's unit; NaN where there is none, empty image
  /// if the source gives no amplitude.
  [[nodiscard]] Image<float> meanAmplitude() const;

 private:
  Result<> begin(const Frame& frame);

  CameraInfo camera_;
  std::optional<Transform<World, Camera>> pose_;
  Provenance provenance_;
  std::uint64_t last_sequence_ = 0;
  std::size_t frames_ = 0;
  Image<float> range_per_z_;  ///< |ray| / z of each pixel, for depth planes
  Image<Running> range_m_;
  Image<Running> amplitude_;
};

/// The range of a frame along each pixel's ray in metres, NaN where invalid.
Result<Image<float>> rangeOf(const Frame& frame);

/// An image of ranges as seen by `from`, along the rays of `to` (both in the same place): between
/// the four pixels around, 1/z is linear on a plane, so that is what is interpolated. NaN outside
/// `from`'s image, where a neighbour is invalid, and where the four differ by more than 3 % (an
/// edge).
Image<float> alongRaysOf(const CameraInfo& to, const Image<float>& range_m, const CameraInfo& from);
/// The same for any other quantity, from the nearest pixel.
Image<float> nearestAlongRaysOf(const CameraInfo& to, const Image<float>& values,
                                const CameraInfo& from);

/// Whether two poses are the same: within 10 µm and 10 µrad, far below what moves a reading.
bool samePose(const Transform<World, Camera>& a, const Transform<World, Camera>& b);

}  // namespace toftwin::compare
