// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/loop/explain.h"
#include "calib/loop/ladder.h"
#include "calib/loop/no_readings.h"
#include "calib/loop/overlap.h"
#include "calib/loop/telling/numbers.h"
#include "calib/loop/telling/removed.h"
#include "calib/loop/telling/told.h"

namespace toftwin::loop {

/// All that was found out about a table.
struct Discovery {
  table::Readings readings{};
  TableEvidence all{};           ///< rows with an error, in the file's order
  TableEvidence open{}, locked{};  ///< those that measure something: for the search, and for judging it
  std::vector<NoReadings> no_readings{};  ///< numbers of rows are of `all`
  Explanation mean{};            ///< what the error goes with; effects between groups come last
  std::vector<Told> told{};      ///< of each effect of the mean, on open rows: what is said of it
  std::vector<std::vector<Number>> numbers{};  ///< of each of them
  Removed removed{};             ///< what the written model takes off the locked rows
  Explanation spread{};          ///< what the logarithm of its magnitude goes with
  std::optional<Explanation> share{};  ///< what the share of rows that measure nothing goes with, where there are enough
  bool has_group_offsets = false;
  double noise = 0.0;            ///< robust deviation of the rows beside a model that is flexible along each column
  Repeats repeats{};
  std::optional<Overlap> overlap{};  ///< of series, where the reference begins anew in the file
  Model model{};
  bool is_written = true;        ///< false: the model is no better than none on locked rows
  Ladder seen{}, unseen{};       ///< of open rows, of locked rows: the written model's
};

}  // namespace toftwin::loop
