// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <vector>

#include <toftwin/image.h>
#include <toftwin/units.h>

#include "sim/images/range.h"
#include "sim/images/samples.h"

namespace toftwin::sim {

/// How a pulsed camera's gates lie (pulsed.h).
enum class PulseScheme { ShortLong, TwoGate };

/// How a camera makes ranges of its samples. Serves the simulator and drivers of cameras that give
/// raw samples alike; it knows nothing of either.
struct DecodeSettings {
  enum class Algorithm { NPhase, KinectV2, Pulsed };
  enum class Baseline { FirstOrder, Exact };

  /// What only the Kinect v2's decoder asks for. Defaults: libfreenect2's parameters.
  struct KinectV2 {
    double counts_per_electron = 1.0;
    std::array<double, 3> amplitude_multipliers{1.322581, 1.0, 1.612903};
    double least_counts = 3.0;
    double least_sum_counts = 10.0;
    Angle strong_unwrap_threshold = 0.3490659_rad;
    bool bilateral_filter = true;
    double bilateral_threshold_counts = 3.0;
    bool edge_filter = true;
    double edge_unlikeness = 2.5;

    template <class Visitor>
    void visit(Visitor& v) {
      v.number("counts_per_electron", counts_per_electron, {1e-9, 1e9},
               "the device's raw counts, in which its thresholds are known");
      v.numbers("amplitude_multipliers", amplitude_multipliers, {1e-3, 1e3},
                "per frequency, to make up for the contrast; thresholds look at counts times this");
      v.number("least_counts", least_counts, {0.0, 1e9},
               "a pixel with less at any frequency is invalid");
      v.number("least_sum_counts", least_sum_counts, {0.0, 1e9},
               "a pixel with less in the sum of its frequencies is invalid");
      v.quantity("strong_unwrap_threshold", strong_unwrap_threshold, radian, {0.0, 10.0},
                 "unwrap_threshold for strong signals; it rises from here to there as the signal falls");
      v.flag("bilateral_filter", bilateral_filter, "average phases over 3 x 3 pixels that are alike");
      v.number("bilateral_threshold_counts", bilateral_threshold_counts, {0.0, 1e9},
               "neighbours with less are left out of it");
      v.flag("edge_filter", edge_filter, "drop pixels at edges and those that hang in between");
      v.number("edge_unlikeness", edge_unlikeness, {0.0, 8.0},
               "a pixel is at an edge from this sum over its neighbours of (1 - cos phase difference)/2");
    }
  };

  Algorithm algorithm = Algorithm::NPhase;
  double speed_of_light = kSpeedOfLight_m_per_s;
  Length baseline_length = 0_mm;
  Baseline baseline = Baseline::Exact;
  double minimum_amplitude = 0.0;
  Angle unwrap_threshold = 0.6_rad;
  double asymmetry_threshold = 0.4;
  Length nearest = 0_m;
  Length farthest = 1000_m;
  KinectV2 kinect{};

  /// What the factory measured: the phase that each frequency shows at range 0, subtracted before
  /// unwrapping. Empty: all zero. Not from the file: the sensor model knows it from its waveforms.
  std::vector<Angle> zero_phase{};
  /// Also from the factory: for each frequency the true cycles of a single return, at seen cycles
  /// i/(size − 1) from 0 to 1 after subtracting the zero phase; in between linear. Empty: as seen.
  std::vector<std::vector<float>> true_cycles{};
  /// Also from the factory: for each frequency an image of e^(iφ₀), φ₀ being the phase that the pixel
  /// itself adds (the Kinect v2's p0 tables). Empty, or an empty image: none.
  std::vector<Image<std::complex<float>>> pixel_turns{};
  /// pulsed: the scheme, the pulse's width, and the factory's range at ratio i/(size − 1); empty: c T / 2 × ratio.
  PulseScheme pulse_scheme = PulseScheme::ShortLong;
  Duration pulse_width{};
  std::vector<double> pulse_ranges_m{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("algorithm", algorithm,
             {{"n_phase", Algorithm::NPhase},
              {"kinect_v2", Algorithm::KinectV2},
              {"pulsed", Algorithm::Pulsed}},
             "n_phase: any number of frequencies in whole-number ratios; kinect_v2: the Kinect "
             "v2's own, "
             "for 80, 16 and 120 MHz in this order; pulsed: the gates of [pulse]");
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
             "n_phase: a pixel with less at any frequency is invalid; pulsed: of returned charge");
    v.quantity("unwrap_threshold", unwrap_threshold, radian, {0.0, 10.0},
               "a pixel whose frequencies disagree by more is invalid");
    v.number("asymmetry_threshold", asymmetry_threshold, {0.0, 1e9},
             "a pixel whose samples contradict each other by more than this share of its amplitude "
             "is flagged");
    v.quantity("nearest", nearest, metre, {0.0, 1e6}, "nearer ranges are invalid (kinect_v2: depths)");
    v.quantity("farthest", farthest, metre, {0.0, 1e6}, "farther ranges are invalid (kinect_v2: depths)");
    v.group("kinect_v2", kinect, "");
  }
};

/// Components of each pixel's unit ray. Empty: all pixels look along the axis.
struct DecodeRays {
  Image<float> x, z;
};

/// Samples → phasors, ranges along the ray, amplitude (mean over the frequencies), unmodulated part
/// and flags. The rays are for the baseline and for what is said of depth. The range is NaN exactly
/// where Invalid is flagged: saturated, too dark, frequencies that disagree, out of the bounds, filtered
/// out, or a sample that is NaN.
///
/// Precondition: at least 3 steps; kinect_v2 needs 3 frequencies (SensorModel checks its file).
RangeImage decode(const Samples& samples, const DecodeSettings& settings,
                  const DecodeRays& rays = {});

/// The Kinect v2's threshold for phases that disagree, in radians, at its strongest frequency's
/// amplitude in counts: weak signals may disagree more. From libfreenect2's parameters
/// (ab_confidence_slope −0.5330578, ab_confidence_offset 0.7694894).
double kinectV2Threshold(double counts, double strong_rad, double weak_rad);

}  // namespace toftwin::sim
