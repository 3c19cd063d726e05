// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <toftwin/result.h>

#include "calib/compare/real_data.h"
#include "sim/tracer/trace.h"

/// The parts of the section about the published simulator; judgePublished puts them together.
namespace toftwin::compare {

/// The camera that the authors describe: the Kinect's view; three point emitters 20, 25 and 30 mm
/// beside the lens on the side of negative x that shine alike into all directions; 30 MHz.
sim::TraceRequest publishedCamera(double effort);

/// What came out, for the verdict.
struct PublishedCorner {
  double rms_exact_mm = 0.0;   ///< theirs − the solution of their own model without their slip
  double rms_remade_mm = 0.0;  ///< theirs − that with the slip
  double rms_ours_mm = 0.0;    ///< our tracer − the independent reference, same material
  double noise_ours_mm = 0.0;  ///< what the noise of both makes of that
};
Result<PublishedCorner> addPublishedCorner(const RealDataJob& job, Finding& finding);
/// A published corner curve: errors along each ray, and how it scatters from ray to ray (second
/// differences / √6).
struct PublishedLine {
  std::vector<double> t, error_mm;
  double noise_mm = 0.0;
};
Result<PublishedLine> loadPublishedCorner(const std::filesystem::path& file, std::size_t every = 1);
Result<> addPublishedDistance(const RealDataJob& job, Finding& finding);
Result<> addPublishedBox(const RealDataJob& job, Finding& finding);

/// The published pulsed camera: two gates as long as the pulse and light that both collect alike.
/// Reading minus truth for a return of strength 1 / `weakness` (relative to the constant light) at
/// a range, in mm; a return later than both gates loses its end.
double twoGateError_mm(double range_m, Frequency f, double weakness);

}  // namespace toftwin::compare
