// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/discover/camera_text.h"
#include "calib/discover/discover_table.h"

/// What a table showed, in a camera file that the simulator runs.
namespace toftwin::discover {

struct TableCamera {
  std::string toml{};
  std::vector<std::string> notes{};  ///< what columns were taken for, and what could not be written
};
/// The camera with a `learned` effect for each effect whose columns the simulator knows, and one for offset and gain where
/// rows have one offset. Columns are known by the simulator's names (time_s, temperature_sensor_c, …) and by what headers
/// say; the reference is the range. Error: errors of the table are no lengths.
Result<TableCamera> cameraWith(const TableDiscovery& discovery, const CameraText& camera);

/// The values of a covariate at which an effect is tabled: nearly straight in between.
std::vector<double> pointsOf(const TableDiscovery& discovery, const Effect& effect, const std::string& covariate);

}  // namespace toftwin::discover
