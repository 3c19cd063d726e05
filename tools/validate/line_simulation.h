// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/validate/free_numbers.h"
#include "tools/validate/line_rows.h"
#include "tools/validate/traced_line.h"

namespace toftwin::validate {

/// The scene of a file with another albedo of one of its materials, as TOML; unchanged without one. Errors: the file
/// cannot be read, or has no such material although it `is_needed`.
Result<std::string> sceneText(const std::filesystem::path& file, const std::string& material, std::optional<double> albedo,
                              bool is_needed);

/// Directions of the pixels of a camera's middle row.
std::vector<double> pixelRays(const sim::SensorModel& camera);

/// A line's light for one choice of scene and light source, traced once, and what the camera as it is reads of it.
struct LineCase {
  std::vector<TracedLine> with, without;  ///< for each run; `without` of a change
  std::vector<double> rows_mm;            ///< what is judged, for each row
  double error_mm = 0.0;                  ///< of one line, by Monte-Carlo and sensor noise
};

/// Simulates the rows of a line.
class LineSimulation {
 public:
  LineSimulation(const Line& what, const EffectGroup& fitted, const Subject& camera, const Task& task, const LineRows& rows);

  /// Traces a case. `albedo`: of the material that a number is of; `variant`: another light source.
  [[nodiscard]] Result<LineCase> trace(int surfaces, std::optional<double> albedo = {}, const Variant* variant = nullptr) const;
  /// Traces the cases that a number of role albedo lies between.
  Result<> traceAlbedos();
  /// Predicts the rows for values of all numbers; of a case where no albedo is given. The simulation and the case must
  /// live as long.
  [[nodiscard]] PredictNumbers predictor(const LineCase& without_albedo) const;

 private:
  [[nodiscard]] std::vector<double> read(const LineCase& one, const sim::SensorModel& camera, const RowHalo& halo,
                                         double* error_mm) const;
  [[nodiscard]] std::vector<double> predict(const LineCase& base, std::span<const double> values) const;

  const Line& what_;
  const EffectGroup& fitted_;
  const Task& task_;
  const LineRows& rows_;
  sim::SensorModel camera_;
  int frames_;
  double emitter_x_mm_ = 0.0;
  const FreeNumber* albedo_ = nullptr;
  std::vector<LineCase> by_albedo_;
};

}  // namespace toftwin::validate
