// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/rows/phasor_change.h"
#include "calib/discover/term.h"

/// Light of what is beyond a brightness, which spills over the whole chip with its phase: of over-exposed pixels
/// alone, where scatter (neighbours) is of all.
namespace toftwin::discover {

inline constexpr std::string_view kSpilledCarrier = "spilled";

/// What 1 % of the mean over the image of (1 − T/A) z, where the amplitude A is above T, changes, for T = 1/2, 1/4 and
/// 1/8 of the brightest ("spilled:1/2" …). `sources`: what falls on the pixels, also where it is too bright to be read;
/// `brightest`: of all captures, in the unit of the amplitude.
std::map<std::string, Reading> spilledCarriers(const Reading& declared, const Phasors& sources, double period_m,
                                               double brightest);

TermGroup spilledGroup();

}  // namespace toftwin::discover
