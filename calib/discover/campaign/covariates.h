// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "calib/discover/campaign/rows.h"
#include "calib/discover/campaign/temperature_rates.h"

namespace toftwin::discover {

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
