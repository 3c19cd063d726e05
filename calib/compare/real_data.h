// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/named_traits.h"
#include "calib/compare/progress.h"
#include "calib/compare/report.h"
#include "calib/compare/scan_line.h"
#include "calib/compare/statistics.h"

/// The simulator against measurements of a Kinect v2 and an O3D303 (docs/compare.md, "Real input").
/// Every finding says what was assumed; nothing is fitted to the data that it is judged on, unless
/// the finding says so.
namespace toftwin::compare {

/// One line of the summary, RMS over the judged half of a data set, mm. NaN: there is none.
struct Outcome {
  std::string data{};
  std::size_t judged = 0;     ///< rows
  double ideal_mm = 0.0;      ///< a camera without error
  double constant_mm = 0.0;   ///< that and the best constant of the fitted half
  double published_mm = 0.0;  ///< the published simulator
  double as_is_mm = 0.0;      ///< ours, preset
  double fitted_mm = 0.0;     ///< ours, fitted on the other half
};
/// An effect left out of the fitted model, the rest fitted again; RMS over the judged half.
struct Ablation {
  std::string effect{}, data{};
  double with = 0.0, without = 0.0;
};

/// One part of the report with its numbers.
struct Finding {
  Section section;
  std::vector<Card> cards{};
  std::string headline{};  ///< a clause for the report's verdict, or empty
  std::vector<std::string> notes{};  ///< what a reader must know; in the section, too
  Json data = Json::object();
  std::vector<Outcome> outcomes{};
  std::vector<Ablation> ablations{};
};

struct RealDataJob {
  std::filesystem::path folder;  ///< tof-thesis-2018
  double effort = 1.0;           ///< factor on the paths that are traced
  Progress* progress = nullptr;
};

/// A camera of the set, by its name there, and the preset that simulates it.
struct RealCamera {
  std::string name;   ///< "kinect_v2": file names and preset
  std::string title;  ///< "Kinect v2"
  /// Mean of measured − simulated range in the distance-error table; used on the other data sets.
  double delay_mm = 0.0;
};

Result<Finding> judgeDistance(const RealDataJob& job, RealCamera& camera);  ///< sets delay_mm
Result<Finding> judgeCorner(const RealDataJob& job, const RealCamera& camera);
Result<Finding> judgeBox(const RealDataJob& job);
Result<Finding> judgeWarmUp(const RealDataJob& job, const RealCamera& camera);
Result<Finding> judgeNoise(const RealDataJob& job, const RealCamera& camera);
Result<Finding> judgeScatter(const RealDataJob& job);
/// The edge of the corner: ray offset, physics, halo (docs/edge-of-the-corner.md).
Result<Finding> judgeEdge(const RealDataJob& job);
Result<Finding> judgeMixedPixels(const RealDataJob& job);
Result<Finding> judgePublished(const RealDataJob& job);
/// That section's id and title, for links to it.
inline constexpr const char* kPublishedSection = "published";
inline constexpr const char* kPublishedTitle = "Against the published simulator";
/// The geometry of the published simulator's corner.
Result<CornerFit> publishedCorner(const std::filesystem::path& data_folder);

/// The two tables over all findings: what is left, and what each effect is worth.
Section summarySection(const std::vector<Finding>& findings);

/// All of them, in the report's order. The plan is added to the job's progress by `planRealData`.
void planRealData(Progress& progress, double effort);
Result<std::vector<Finding>> judgeRealData(const RealDataJob& job);

/// The traits of measured data (A) and, where there are any, of simulated ones (B), as a run has them: their
/// table, and which of them differ.
void addCharacteristics(const NamedTraits& traits, Finding& finding);

/// Rows "prediction, RMS left, shape left, explained" for tables.
std::vector<std::string> explainedRow(const std::string& name, const Explained& explained);
inline const std::vector<std::string> kExplainedHeader{"prediction",
                                                       "n",
                                                       "RMS left [mm]",
                                                       "explained",
                                                       "constant missing [mm]",
                                                       "spread left [mm]",
                                                       "spread explained"};
Tone toneOf(double explained_fraction);

}  // namespace toftwin::compare
