// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/loop/explain.h"
#include "calib/loop/table_evidence.h"

namespace toftwin::loop {

/// Terms that belong together, as a section of a file: `[[effect]] type = "learned"`.
struct LearnedEffect {
  std::string title{};  ///< for people: "speed_m_per_s: straight line"
  std::string role{};   ///< rung of the ladder: "constant", "gain", "series", "effect"
  std::vector<terms::Term> terms{};
  double p = 0.0;       ///< chance of seeing it without any effect; 0 where it was not tested
};

/// A simpler model, for the ladder.
struct Rung {
  std::string name{};
  std::vector<terms::Term> terms{};
};

/// What was learned of an error: measured = true + the sum of all terms. `model.toml` says it, and what reads it there is what
/// was judged.
struct Model {
  std::string data{}, unit{}, measured{}, reference{};
  std::string data_id{};  ///< of the rows it was found in (dataIdOf); empty: not known
  std::vector<LearnedEffect> effects{};
  /// Ladder of simpler models, each fitted by itself: a constant; with a gain; with series.
  std::vector<Rung> rungs{};
};

/// Of a table's rows: their lines, what was measured and what it should have been. 32 hex digits; equal only for the same rows.
std::string dataIdOf(const table::Readings& readings);

/// All terms of the model.
std::vector<terms::Term> termsOf(const Model& model);

std::string toToml(const Model& model);
Result<Model> parseModel(std::string_view toml, const std::filesystem::path& name);
Result<Model> loadModel(const std::filesystem::path& file);

/// An effect's columns with their coefficients as terms; hats over one covariate become one curve.
std::vector<terms::Term> termsOf(const Shape& shape, const Eigen::VectorXd& coefficient, terms::Quantity quantity);

/// The error that these effects predict for each row, at the reference's own values.
Eigen::VectorXd predicted(const Evidence& evidence, const std::vector<terms::Term>& terms);

/// What was measured less its error. The error is that of the corrected value, which is found by turns, since a table that is to
/// be corrected need not have a reference. Where the table gives errors alone, the errors that are left are given.
/// Errors: a covariate or a level of the model that the table lacks, by name; a unit other than the model's.
Result<Eigen::VectorXd> corrected(const TableEvidence& table, const table::Readings& readings, const Model& model,
                                  const std::vector<terms::Term>& terms);

}  // namespace toftwin::loop
