// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/frame.h>

#include "calib/compare/report.h"
#include "calib/plan/plan.h"
#include "calib/plan/run_index.h"

namespace toftwin::plan {

/// Something that a run was made with. Names end in their unit.
struct RunSetting {
  std::string of{};  ///< "A", "B", or "" of the run itself
  std::string name{}, value{};
  bool operator==(const RunSetting&) const = default;
};

/// A camera as a run calls it: "kinect, Kinect v2 0815".
struct CameraName {
  std::string source{}, model{}, serial{};
};
CameraName cameraNameOf(const std::string& text);

/// Of the run: plan, its seed, the blocks that were `skipped`, the captures of so many `planned`, and the settings that
/// were gone through. Of each camera: which it is, and what its first frame says: kind, resolution, frequencies, ids of
/// calibration, scene and model, seed, effects.
std::vector<RunSetting> settingsOf(const Plan& plan, const std::vector<std::string>& skipped,
                                   const std::vector<CaptureRecord>& records, std::size_t planned,
                                   const std::string& index_sha256);
std::vector<RunSetting> settingsOf(const char* of, const std::string& camera, const Frame& first);

/// A row for each name; the run's own stand under A and B alike.
compare::TableBlock provenanceTable(const std::vector<RunSetting>& settings);
compare::Json toJson(const std::vector<RunSetting>& settings);

}  // namespace toftwin::plan
