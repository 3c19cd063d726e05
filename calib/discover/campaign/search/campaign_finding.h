// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/discover/campaign/answer/judgement.h"
#include "calib/discover/campaign/rows/refit.h"
#include "calib/discover/finding.h"

namespace toftwin::discover {

/// What a campaign is to be searched with.
struct CampaignJob {
  std::filesystem::path run;  ///< a run's folder, or a recording
  std::filesystem::path poses_of{};  ///< of a recording: another one, whose frames have the poses
  std::string model;  ///< a camera file, or a preset's name with "preset:" before it or without
  std::filesystem::path scene;
  std::map<std::string, std::filesystem::path> scene_of_block{};
  std::filesystem::path output{"discovery"};
  Side side = Side::A;
  TraceOptions trace{};
  FinderOptions finder{};
  std::vector<std::string> left_out{};  ///< effects that are no candidates
  bool open_locked = true;
  std::string note{};
};

/// A capture that would tell an effect from something else that it may be.
struct NextCapture {
  std::string other{};   ///< that it tells the effect from
  std::string like{};    ///< the name of a capture that was taken
  std::string change{};  ///< how to take it again; empty: as it was
  double chi2 = 0.0;     ///< by which the two differ in it
  double taken_chi2 = 0.0;  ///< and at most in one that was taken
};

/// What the raw exposures say of an effect (raw_witness.h), where they were recorded.
struct RawSays {
  /// Of what it does to the range, the share that their phase shows, with its standard error; none: it does nothing.
  std::optional<Difference> share{};
  /// By how many standard deviations of noise they contradict each other more than the camera file says, and more than
  /// it says with all that was found.
  double contradiction = 0.0;

  /// Whether it acts before they are decoded: near to the one, to a quarter or two standard errors, and three of
  /// these from the other.
  [[nodiscard]] std::optional<bool> isBeforeDecoding() const;
  [[nodiscard]] bool contradicts() const { return contradiction > 4.0; }
};

/// What an effect that was found became in the model.
struct FoundEffect {
  Effect found;
  std::optional<FittedEffect> fitted{};  ///< none: the simulator has no form for it
  std::vector<FittedEffect> more{};      ///< where one form is not enough
  std::optional<NextCapture> next{};     ///< where these captures do not tell it from something else
  std::optional<RawSays> raw{};          ///< none: nothing
  /// Single frames say it (step_effect.h): noise smears it where frames are averaged, as they are for the
  /// judgement.
  bool is_of_single_frames = false;
};

/// A place where the camera stood off its pose by more than at all others: it was bumped.
struct StoodOff {
  std::vector<std::size_t> captures{};  ///< that were taken there, by their places among the open ones
  std::string name{};                   ///< of the first
  std::size_t number = 0;
  double shift_mm = 0.0, turn_deg = 0.0;
  std::string alone{};        ///< what no other capture was taken at, as "40 klx"; empty: nothing
  bool is_set_aside = false;  ///< what was found is found without them; of locked ones: whether it is worse is told so

  /// "capture 17 ("distance: 0.9 m") stood 14.6 mm and 1.78° from its pose"
  [[nodiscard]] std::string inWords() const;
};

/// All that is known when a campaign was searched.
struct CampaignFinding {
  std::string camera{}, plan{};
  std::size_t captures = 0, locked = 0, frames = 0;
  Finding finding{};
  /// Single frames are tested by themselves: that they are alike, that no steps are in them. None: nothing was told.
  std::optional<double> alike_p{}, steps_p{};
  std::vector<FoundEffect> effects{};
  std::vector<FittedEffect> updates{};  ///< declared effects whose numbers were wrong
  Zero zero{};  ///< with what was found; its delay whole
  std::vector<StoodOff> off{};  ///< places that are off by more than chance
  double dispersion = 1.0;
  std::optional<Judgement> judgement{};  ///< on the locked captures
  std::vector<StoodOff> locked_off{};    ///< of these, places that are off by more than any open one
  std::optional<Judgement> without_off{};  ///< the judgement without them
  std::string model_toml{};
  bool is_worse = false;  ///< on the locked captures: model_toml is the camera file as it was
  std::vector<std::string> notes{};
  double seconds = 0.0;

  /// The least of all tests: of all groups together, and of single frames.
  [[nodiscard]] double leastP() const {
    return std::min({finding.first_p, alike_p.value_or(1.0), steps_p.value_or(1.0)});
  }
  /// Whether anything was found that means over frames show, so that locked captures can judge it.
  [[nodiscard]] bool hasJudged() const {
    return !std::ranges::all_of(updates, &FittedEffect::is_of_single_frames) ||
           !std::ranges::all_of(effects, &FoundEffect::is_of_single_frames);
  }
};

}  // namespace toftwin::discover
