// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "calib/discover/table_data.h"

/// Tables with an effect that the finder is not told.
namespace toftwin::discover {

/// How rows err besides the effect.
struct Errors {
  double sigma_mm = 1.0;
  bool heavy_tails = false;  ///< Student's t with 4 degrees of freedom, of the same variance
  bool bumped = false;       ///< rows 120 to 129 are 6 sigma off together
  double session_mm = 0.5;   ///< deviation of the sessions' offsets
  int sessions = 4;
  double logged_mm = 0.0;  ///< deviation of an offset of 20 rows that share one logged ambient light, if any
  double ar1_mm = 0.0;     ///< deviation of an AR(1) process from row to row, correlation 0.9
  /// 0, or in how many captures of 20 rows the rows were taken: ambient light and temperature stay, the
  /// distance changes by a quarter of a metre, and each has an offset of its own. A multiple of 4.
  int captures = 0;
  double capture_mm = 0.5;  ///< deviation of the captures' offsets
};

enum class Hidden {
  Nothing,
  WarmUp,
  Wiggle,
  Temperature,
  AmbientTimesDistance,
  Step,
  Parity,
  InverseAmplitude,
  Exposure,
  IncidenceSquared,
  TwoHarmonics,
  TanSquared,
  Hinge
};
inline constexpr Hidden kHidden[]{Hidden::WarmUp,
                                  Hidden::Wiggle,
                                  Hidden::Temperature,
                                  Hidden::AmbientTimesDistance,
                                  Hidden::Step,
                                  Hidden::Parity,
                                  Hidden::InverseAmplitude,
                                  Hidden::Exposure,
                                  Hidden::IncidenceSquared,
                                  Hidden::TwoHarmonics,
                                  Hidden::TanSquared,
                                  Hidden::Hinge};
const char* nameOf(Hidden hidden);
/// What it goes with, sorted.
std::vector<std::string> covariatesOf(Hidden hidden);

struct Planted {
  TableData data;
  std::vector<double> effect_mm;  ///< of each row: what was hidden
};
/// 400 rows of 4 sessions or as many as said, each from switching on, distances in random order. The effects
/// are scaled so that each has noncentrality `lambda` over the rows after offset, gain and session offsets.
Planted plant(std::uint64_t seed, const std::vector<Hidden>& hidden, double lambda,
              const Errors& errors = {});
/// The table as a file: error_mm, session, day (of the session; if wanted) and the covariates.
std::string csvOf(const TableData& data, bool has_day = false);

}  // namespace toftwin::discover
