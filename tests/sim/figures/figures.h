// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <string>

namespace toftwin::sim::figures {

/// Draws a figure: an SVG file's text.
using Draw = std::function<std::string()>;

/// The figures of docs/effects, by the name of the effect.
void addPhaseFigures(std::map<std::string, Draw>& figures);  ///< errors over one turn of the phase
void addCurveFigures(std::map<std::string, Draw>& figures);  ///< errors over range, time, light
void addImageFigures(std::map<std::string, Draw>& figures);  ///< pictures of a scene
void addConsequenceFigures(std::map<std::string, Draw>& figures);  ///< what no effect makes

}  // namespace toftwin::sim::figures
