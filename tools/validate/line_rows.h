// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/validate/judged.h"
#include "tools/validate/scan_line.h"

namespace toftwin::validate {

/// One run of a line that was measured with its background: what stands before it.
struct PlateRun {
  std::string with{}, without{};  ///< scenes in the camera's frame, TOML
  double plate_mm = 0.0;      ///< depth of the plate
  double covered = 0.0;       ///< share of the row
};

/// What is judged of a line: one row for each ray, all runs together.
struct LineRows {
  std::vector<double> t, place_mm, measured_mm;
  std::vector<int> run;
  std::vector<double> on_reference_mm;  ///< range of the reference along each ray; empty without one
  std::vector<PlateRun> plates;         ///< one for each run, without a scene file

  [[nodiscard]] std::size_t size() const { return t.size(); }
};

/// Reads the measured line, or lines. `pixels_t`: the rays of the simulated pixels.
Result<LineRows> readRows(const Line& what, const Task& task, const std::vector<double>& pixels_t);

/// The edges of a description: x and z in turn.
std::vector<EdgePoint> edgePoints(const std::vector<double>& edges_mm);

/// Another simulator's values at the places of our rows; NaN where it has none.
Result<std::vector<double>> otherAt(const Other& other, const Line& what, const Task& task, const LineRows& rows);

}  // namespace toftwin::validate
