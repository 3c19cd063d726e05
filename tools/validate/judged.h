// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "calib/compare/finding.h"
#include "calib/compare/named_traits.h"
#include "calib/compare/progress.h"
#include "calib/compare/statistics.h"
#include "tools/validate/dataset.h"

namespace toftwin::validate {

inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// One line of the summary, RMS over the judged half of the data, mm. NaN: there is none.
struct Outcome {
  std::string data{};
  std::size_t judged = 0;     ///< rows
  double ideal_mm = kNone;    ///< a camera without error
  double constant_mm = kNone; ///< that and the best constant of the fitted half
  double other_mm = kNone;    ///< another simulator
  double as_is_mm = kNone;    ///< ours, from the camera file alone
  double fitted_mm = kNone;   ///< ours, fitted on the other half
};
/// A cause left out of the fitted model, the rest fitted again; RMS over the judged half.
struct Ablation {
  std::string cause{}, data{};
  double with = 0.0, without = 0.0;
};

/// What one judgement gave: its part of the report, and its lines of the summary.
struct Judged {
  compare::Finding finding{};
  std::vector<Outcome> outcomes{};
  std::vector<Ablation> ablations{};
};

/// What the judgements of one dataset share.
struct Task {
  const Dataset& set;
  double effort = 1.0;                     ///< factor on the paths that are traced
  compare::Progress* progress = nullptr;
  std::map<std::string, double> constant_mm{};  ///< by camera: measured − simulated, mean over its distances

  void at(double share) const {
    if (progress != nullptr) progress->at(share);
  }
  [[nodiscard]] int paths(int samples) const;
};

Result<Judged> judge(const Distances& what, const EffectGroup& fitted, const Subject& camera, Task& task);
Result<Judged> judge(const Series& what, const EffectGroup& fitted, const Subject& camera, Task& task);
Result<Judged> judge(const Noise& what, const EffectGroup& fitted, const Subject& camera, Task& task);
Result<Judged> judge(const Line& what, const EffectGroup& fitted, const Subject& camera, Task& task);
Result<Judged> judge(const Edges& what, const EffectGroup& fitted, const Subject& camera, Task& task);

/// The section of a judgement with its id and title.
Judged begun(const Heading& heading, const Subject& camera);
/// "Kinect v2, corner".
std::string dataOf(const Heading& heading, const Subject& camera);
/// Adds the notes of the description to the section.
void addNotes(const Heading& heading, Judged& judged);

/// One column of a table of the data, or more. Errors name file, line and column.
Result<std::vector<double>> columnOf(const Task& task, const std::string& file, const std::string& column);
Result<std::vector<std::vector<double>>> columnsOf(const Task& task, const std::string& file,
                                                   const std::vector<std::string>& columns);

/// The traits of measured data (A) and, where there are any, of simulated ones (B), as a run has them: their
/// table, and which of them differ.
void addCharacteristics(const compare::NamedTraits& traits, Judged& judged);

/// Rows "prediction, RMS left, shape left, explained" for tables.
std::vector<std::string> explainedRow(const std::string& name, const compare::Explained& explained);
extern const std::vector<std::string> kExplainedHeader;
compare::Tone toneOf(double explained_fraction);
std::vector<double> plus(std::vector<double> values, double constant);

/// The two tables over all judgements: what is left, and what each cause is worth. `other`: who the other simulator is.
compare::Section summarySection(const std::vector<Judged>& all, const std::string& other);

}  // namespace toftwin::validate
