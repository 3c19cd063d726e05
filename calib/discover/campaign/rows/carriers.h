// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/term.h"

/// Effects without a name that are no error of the range alone: light that comes from neighbours, and charge
/// that does not come from light. Functions of covariates are multiplied with what they do.
namespace toftwin::discover {

/// Changes of range and ln amplitude, to first order in the highest frequency's phasor z:
///     δ ln|z| = Re(δz/z),   δr = −(R/2π) Im(δz/z)
/// for light from a square of neighbours (δz = 1 % of its mean z), and for an electron more in the
/// correlation's real or imaginary part (δz = 2/N or 2i/N, N raw exposures). The same for squares about the
/// mirrored place of the image, turned by half a turn about the principal point; and the light of a place one
/// pixel farther from it. A gain of 1 % of the amplitude. And stray light, the same in all pixels: electrons
/// in phase or in quadrature like those of a charge, but as many more as the exposure is longer. Charge and gain
/// once more under the name of a converter, for those of columns that share one (repeating_columns.h).
std::map<std::string, Reading> carriersOf(const sim::SensorModel& model, const Reading& declared,
                                          double period_m, double exposure_us);

/// What is looked for with them: a kernel of squares of light, about the pixel or the mirrored place; pixels
/// that look farther out, by a function of the radius; charge that is constant or goes with exposure, ambient
/// light or temperature; a gain that goes with any covariate. `has_delay`: and a delay of the light, where
/// that is another thing than an error of the range.
std::vector<TermGroup> carrierGroups(std::span<const CovariateInfo> covariates, bool has_delay);

/// Of a gain, of a charge and of stray light; the latter two have the parts ":in_phase" and ":quadrature".
inline constexpr std::string_view kGainCarrier = "gain", kChargeCarrier = "charge", kStrayCarrier = "stray";
/// Of a column's converter: ":in_phase" and ":quadrature" as of a charge, and ":gain".
inline constexpr std::string_view kConverterCarrier = "converter";
/// The carrier of a delay in the light, 1 mm of range: it is late before the waveform's harmonics bend the phase,
/// so that it also moves the cyclic error.
inline constexpr std::string_view kDelayCarrier = "delay";

/// Pixels of a row, or of a column, share wires: what of their mean comes along them.
inline constexpr std::string_view kAlongRow = "neighbours:row", kAlongColumn = "neighbours:column";
/// Half width in pixels of the square that light comes from, of a carrier "neighbours:…"; of the whole image:
/// more than any image has. Nothing of other carriers.
std::optional<int> reachOfNeighbours(std::string_view carrier);
/// The same of a carrier "mirrored:…".
std::optional<int> reachOfMirrored(std::string_view carrier);
/// Where the point that the image is turned about moves, right and down in pixels, as such a carrier's coefficient grows
/// by all of the second image's light.
std::optional<std::array<double, 2>> mirrorMovedBy(std::string_view carrier);
/// The carriers of light from one pixel farther out, and farther in: what the lens is not as the camera file
/// says. They are the same but for the sign where light is straight from pixel to pixel.
inline constexpr std::string_view kOutwardCarrier = "outward", kInwardCarrier = "outward:in";

/// What stays the same at each pixel: "pixel:range", "pixel:gain", "pixel:delay".
inline constexpr std::string_view kPixelCarrier = "pixel";
/// For each of them a group of one term; `numbers`: how many places a pattern has.
std::vector<TermGroup> pixelGroups(bool has_delay, std::size_t numbers);

/// What effects of the catalogue call a carrier; empty: it is none.
std::string_view wordOfCarrier(std::string_view carrier);

}  // namespace toftwin::discover
