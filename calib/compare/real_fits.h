// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/compare/held_out.h"
#include "calib/compare/real_data.h"
#include "calib/compare/simulated_wall.h"
#include "sim/sensor/sensor_model.h"

/// What the judges of real data fit on one half and judge on the other.
namespace toftwin::compare {

/// Modulation frequencies of a camera of the set, Hz.
std::vector<double> frequenciesOf(const std::string& camera);

/// Effects that the preset lacks, fitted to the distance table through the simulator. Rows in step; `preset` is
/// without noise, `walls` were traced for it and reach beyond the rows.
void addDistanceFit(const RealCamera& camera, const sim::SensorModel& preset, const TracedWalls& walls,
                    const std::vector<double>& reference_mm, const std::vector<double>& error_mm,
                    Finding& finding);

/// A corner's line and its simulation for some albedos of the boards, on the same rays.
struct CornerLines {
  std::vector<double> t, truth_mm, measured_mm;   ///< errors: measured − reference
  std::vector<double> as_is_mm;                   ///< preset, assumed albedo
  std::vector<double> direct_mm;                  ///< preset, one surface
  std::vector<double> albedo;                     ///< ascending
  std::vector<std::vector<double>> simulated_mm;  ///< per albedo
  double emitter_x_mm = 0.0;                      ///< of the preset
};
void addCornerFit(const RealCamera& camera, const CornerLines& lines, Finding& finding);

/// The change that a box makes on the wall, and its simulation for some albedos of the box, emitter
/// where the preset has it and mirrored.
struct BoxLines {
  std::vector<double> place_mm, measured_mm, published_mm;
  std::vector<double> albedo;
  std::vector<std::vector<double>> preset_mm, mirrored_mm;  ///< per albedo
  double assumed_albedo = 0.5;
  /// Pure sines of the camera's frequencies with one emitter at these places, box albedo 0.8.
  std::vector<double> emitter_x_mm;
  std::vector<std::vector<double>> by_emitter_mm;
};
void addBoxFit(const BoxLines& lines, Finding& finding);

}  // namespace toftwin::compare
