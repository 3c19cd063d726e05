// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>
#include <toftwin/geometry.h>
#include <toftwin/image.h>

#include "sim/effects/effect.h"

/// Tables over one or two covariates, for what was learned from measurements and has no name.
namespace toftwin::sim {

/// What a learned table may go with. Each effect offers those that it can know where it acts.
enum class LearnedOver {
  Nothing,
  Time,
  Illumination,
  Sensor,
  Ambient,
  Exposure,
  Range,
  Amplitude,
  Column,
  Row,
  Radius,
  Incidence,
  Surround4,
  Surround16,
  SurroundAll
};

/// What is the same in all pixels of a frame: 0 of Nothing; NaN where the frame does not say it, and of
/// what differs from pixel to pixel.
double ofFrame(LearnedOver over, const Moment& moment);
/// Column, row, radius about the principal point, in pixels of the full image, of the pixel (x, y); of
/// anything else NaN.
double ofPlace(LearnedOver over, const Conditions& now, int x, int y);

/// 1/cos of the angle between a pixel's ray and the surface's normal (unit, camera frame, towards the
/// camera), at most 20. (x, y): of the full image.
double incidenceAt(const CameraInfo& camera, const Vec3f& normal, int x, int y);
/// ln(mean amplitude over the square of that reach / the pixel's own): how bright a pixel's surroundings are.
/// NaN where the pixel has none.
Image<float> surroundings(const Image<float>& amplitude, int reach);
/// Half width of a Surround's square, in pixels: that of SurroundAll is the image.
int reachOf(LearnedOver surround, int width, int height);

/// Knots of a table over x, or over x and y; nothing in the second is over x alone.
struct LearnedKnots {
  const std::vector<double>&x, &y;

  /// Values at the knots, for the first x all y, then for the next x; linear (bilinear) between them and
  /// constant beyond. 0 of an empty table, else NaN where a covariate is.
  [[nodiscard]] double valueIn(const std::vector<double>& table, double at_x, double at_y) const;
};

/// What of an effect's keys a single one cannot say is wrong, or nothing. `offsets`: the first table and its
/// key.
std::string problemOf(const LearnedKnots& knots, LearnedOver over, LearnedOver and_over,
                      std::pair<std::string_view, const std::vector<double>&> offsets,
                      const std::vector<double>& gains_percent);

}  // namespace toftwin::sim
