// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/progress.h"
#include "calib/suit/simulate.h"
#include "calib/suit/use_case.h"
#include "calib/suit/values.h"

namespace toftwin::suit {

/// A requirement at one pose under one lighting.
struct AtCondition {
  std::size_t pose = 0, lighting = 0;
  std::size_t pixels = 0;
  Verdict verdict{};
};

/// A requirement on one camera: it holds where it holds at every condition, and is as good as at the worst.
struct RequirementResult {
  Verdict verdict{};
  std::vector<AtCondition> conditions{};  ///< none for a frame rate
  std::size_t worst = 0;                  ///< of `conditions`
  bool is_judged = true;
  std::string why_not{};
};

/// What a requirement gains in margin, at its worst condition, when this is left out of the simulation.
struct Spoiler {
  std::string what{};
  /// In the unit of valueOf(); more is better without it. All gains of a camera hold together with 95 %.
  Estimate gain{};
  bool is_met_without = false;
  bool is_certain_without = false;     ///< of that verdict: its interval is on one side of the limit
  bool is_valid_only_without = false;  ///< with it there is no value to gain from: nothing is valid
  [[nodiscard]] bool isSpoiling() const { return is_valid_only_without || gain.low > 0.0; }
};

/// A mode and exposure that was tried with one simulation of its own.
struct Try {
  std::string mode{};
  double exposure_us = 0.0;  ///< NaN where the raw exposures differ
  std::size_t failed = 0;
  double shortfall = 0.0;  ///< sum of the relative margins that are missing
  double worst = 0.0;      ///< least relative margin
};

struct CameraResult {
  std::string name{}, model{}, id{};
  bool is_recording = false;
  std::string cannot{};  ///< why it cannot be judged, or empty
  std::vector<RequirementResult> requirements{};
  std::vector<std::vector<Spoiler>>
      spoilers{};  ///< of each requirement, greatest gain first; empty where it is met
  std::vector<Try> tries{};
  std::size_t best = 0;  ///< of `tries`: what the rest is about
  std::size_t failed = 0, unknown = 0;
  double shortfall = 0.0, worst = 0.0;
  std::vector<std::string> notes{};

  [[nodiscard]] bool isFit() const { return cannot.empty() && failed == 0 && unknown == 0; }
};

struct Suit {
  Case use{};
  std::string scene_id{};
  std::vector<CameraResult> cameras{};  ///< best first
};

struct SuitOptions {
  std::vector<std::string> only{};  ///< names of cameras; empty: all
  bool find_spoilers = true;
  std::function<bool()> interrupted{};
};

/// Runs all cameras through the use case and ranks them: fewest requirements failed, then least missing, then
/// largest margin. Errors: a name in `only` that is none, a scene that cannot be loaded, no camera that can
/// be judged, interruption.
Result<Suit> judge(const Case& use, const SuitOptions& options, compare::Progress& progress);

/// Verdicts of all requirements from their values; `frame_rate_hz` NaN: not known.
std::vector<RequirementResult> resultsOf(const Case& use, const std::vector<ConditionValues>& conditions,
                                         double frame_rate_hz);

/// Of one requirement at one condition, by the rule for its kind.
Estimate estimateAt(const RequirementSpec& requirement, const ConditionValues& values, std::size_t r);

/// Fills in what the ranking goes by.
void sumUp(const Case& use, CameraResult& camera);

/// What spoils the requirements that a variant fails: each effect, light over several surfaces, mixed pixels
/// and motion are left out one after the other, and then all of them. Same light, same noise. `kept`: light
/// of the simulation that the results are from.
Result<std::vector<std::vector<Spoiler>>> spoilersOf(const Case& use, const sim::Scene& scene,
                                                     const Variant& variant,
                                                     const std::vector<RequirementResult>& results,
                                                     const Watch& watch, KeptLight* kept = nullptr);

/// A recording of a real camera in the place of simulations. Groups of its frames stand for repeats.
Result<CameraResult> judgeRecording(const Case& use, const sim::Scene& scene, const CameraSpec& camera,
                                    const std::string& place, const Watch& watch);

/// Writes index.html, report.json and report.md into the folder; gives the page's path.
Result<std::filesystem::path> writeSuit(const Suit& suit, const std::filesystem::path& folder,
                                        const std::string& note);
/// One sentence.
std::string inWords(const Suit& suit);

}  // namespace toftwin::suit
