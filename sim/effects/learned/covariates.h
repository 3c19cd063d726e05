// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>
#include <toftwin/geometry.h>
#include <toftwin/image.h>

#include "sim/effects/effect.h"
#include "sim/terms/image_terms.h"
#include "sim/terms/term.h"

/// What a learned term may go with, a row each. A new covariate is one row of kLearnedCovariates (covariates.cpp).
namespace toftwin::sim {

/// Writes a covariate of decoded pixels, all as long as each other.
using DecodedRow = void (*)(std::span<const double> range_mm, std::span<const double> amplitude_e, std::span<double> row);

struct LearnedCovariate {
  std::string_view name;  ///< the word in files; with "*", any word of letters, digits and _ stands for it
  std::string_view unit;
  std::string_view meaning;
  terms::Varies varies = terms::Varies::Frame;
  Covariates explains{};
  /// One of these says what it is, NaN where that is not known. Of Varies::Frame:
  double (*of_frame)(const Conditions& now, std::string_view name) = nullptr;
  /// Of Varies::Column, Row and Place: of the pixel (x, y) of the full image.
  double (*of_place)(const CameraInfo& camera, int x, int y) = nullptr;
  /// Of Varies::Pixel, each where it is known: of light, as an image, and of decoded pixels.
  Image<float> (*of_light)(const Light& light, const Conditions& now) = nullptr;
  DecodedRow of_decoded = nullptr;
};

std::span<const LearnedCovariate> learnedCovariates();
/// The row of a covariate, or null.
const LearnedCovariate* learnedCovariate(std::string_view name);
/// Whether a term of that stage can know it.
bool isKnownAt(terms::Stage stage, const LearnedCovariate& covariate);
/// The names of all that terms of that stage can go with: "time_s, row".
std::string learnedCovariateNames(terms::Stage stage);
std::string_view wordOf(terms::Stage stage);

/// A covariate as the evaluator of images asks for it. Precondition: it is known. The field refers to `now`.
terms::Field fieldOf(std::string_view covariate, const Conditions& now);
/// What the frame says of it; NaN where it does not, and of what is no covariate of the frame.
terms::Known knownOfFrame(std::string_view covariate, const Conditions& now);

/// 1/cos of the angle between a pixel's ray and the surface's normal (unit, camera frame, towards the
/// camera), at most 20. (x, y): of the full image.
double incidenceAt(const CameraInfo& camera, const Vec3f& normal, int x, int y);
/// ln(mean amplitude over the square of that reach / the pixel's own): how bright a pixel's surroundings are.
/// NaN where the pixel has none.
Image<float> surroundings(const Image<float>& amplitude, int reach);

}  // namespace toftwin::sim
