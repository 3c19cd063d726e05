// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <toftwin/units.h>

#include "sim/images/range.h"
#include "sim/images/samples.h"

namespace toftwin::sim {

/// How a camera makes ranges of its samples. Serves the simulator and drivers of cameras that give
/// raw samples alike; it knows nothing of either.
struct DecodeSettings {
  enum class Algorithm { NPhase, KinectV2 };
  enum class Baseline { FirstOrder, Exact };

  Algorithm algorithm = Algorithm::NPhase;
  double speed_of_light = kSpeedOfLight_m_per_s;
  Length baseline_length = 0_mm;
  Baseline baseline = Baseline::Exact;
  double minimum_amplitude = 0.0;
  Angle unwrap_threshold = 0.6_rad;
  Angle strong_unwrap_threshold = 0.35_rad;
  double counts_per_electron = 1.0;
  double asymmetry_threshold = 0.4;
  Length nearest = 0_m;
  Length farthest = 1000_m;

  /// What the factory measured: the phase that each frequency shows at range 0, subtracted before
  /// unwrapping. Empty: all zero. Not from the file: the sensor model knows it from its waveforms.
  std::vector<Angle> zero_phase{};
  /// Also from the factory: for each frequency the true cycles of a single return, at seen cycles
  /// i/(size − 1) from 0 to 1 after subtracting the zero phase; in between linear. Empty: as seen.
  std::vector<std::vector<float>> true_cycles{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("algorithm", algorithm,
             {{"n_phase", Algorithm::NPhase}, {"kinect_v2", Algorithm::KinectV2}},
             "n_phase: any number of frequencies in whole-number ratios; kinect_v2: the Kinect "
             "v2's own, "
             "for 80, 16 and 120 MHz in this order");
    v.number(
        "speed_of_light_m_per_s", speed_of_light, {2.9e8, 3.1e8},
        "what the device's decoder assumes; libfreenect2 takes 3e8, which reads 0.07 % too far");
    v.quantity("baseline", baseline_length, millimetre, {-1000.0, 1000.0},
               "the emitter's distance to the right of the lens, corrected as if it were one "
               "point; 0: none");
    v.choice(
        "baseline_correction", baseline,
        {{"exact", Baseline::Exact}, {"first_order", Baseline::FirstOrder}},
        "first_order drops the square of the baseline as libfreenect2 does (1 mm too far at 0.5 m "
        "for 45 mm)");
    v.number("minimum_amplitude_electrons", minimum_amplitude, {0.0, 1e9},
             "a pixel with less at any frequency is invalid");
    v.quantity("unwrap_threshold", unwrap_threshold, radian, {0.0, 10.0},
               "a pixel whose frequencies disagree by more is invalid");
    v.quantity("strong_unwrap_threshold", strong_unwrap_threshold, radian, {0.0, 10.0},
               "kinect_v2: the same for strong signals, from where the threshold rises to the "
               "other one as "
               "the signal falls");
    v.number("counts_per_electron", counts_per_electron, {1e-9, 1e9},
             "kinect_v2: the device's amplitude counts, in which its threshold's rise is known");
    v.number("asymmetry_threshold", asymmetry_threshold, {0.0, 1e9},
             "a pixel whose samples contradict each other by more than this share of its amplitude "
             "is flagged");
    v.quantity("nearest", nearest, metre, {0.0, 1e6}, "nearer ranges are invalid");
    v.quantity("farthest", farthest, metre, {0.0, 1e6}, "farther ranges are invalid");
  }
};

/// Samples → phasors, ranges along the ray, amplitude (mean over the frequencies), unmodulated part
/// and flags. `ray_x` holds the x component of each pixel's unit ray, for the baseline; may be
/// empty where that is 0. The range is NaN exactly where Invalid is flagged: saturated, too dark,
/// frequencies that disagree, out of the bounds, or a sample that is NaN.
///
/// Precondition: at least 3 steps; kinect_v2 needs 3 frequencies (SensorModel checks its file).
RangeImage decode(const Samples& samples, const DecodeSettings& settings,
                  const Image<float>& ray_x = {});

/// The Kinect v2's threshold for phases that disagree, in radians, at an amplitude in its counts:
/// weak signals may disagree more. From libfreenect2's parameters (ab_confidence_slope −0.5330578,
/// ab_confidence_offset 0.7694894).
double kinectV2Threshold(double counts, double strong_rad, double weak_rad);

}  // namespace toftwin::sim
