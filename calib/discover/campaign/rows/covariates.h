// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "calib/discover/campaign/captures/temperature_rates.h"
#include "calib/discover/campaign/rows/cells.h"
#include "calib/discover/term.h"

namespace toftwin::discover {

/// Covariates of a capture's cells, one column for each name.
struct CaptureCovariates {
  std::vector<std::string> names{};
  Eigen::MatrixXf values{};  ///< cells × names
  std::vector<bool> is_same{};  ///< by name: the same in all cells
};

/// What an error of a camera can go with, for each cell of a capture; of the declared simulation,
/// not of what was measured, whose noise would otherwise stand on both sides.
/// `multipath`: TracedCapture's; `rates`: the capture's of temperatureRates().
CaptureCovariates covariatesOf(const MeasuredCapture& capture, const std::vector<TemperatureRate>& rates,
                               const sim::Light& light, const Image<float>& multipath, const Reading& declared,
                               const CameraInfo& camera, const Cells& cells);

/// The word of sim::kCovariateNames that a campaign's covariate belongs to: "radius_px" is of
/// "position".
std::string_view wordOf(std::string_view covariate);
/// Its unit, and what is looked for along it.
CovariateInfo describe(const std::string& name);

}  // namespace toftwin::discover
