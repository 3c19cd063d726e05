// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/answer/discover_campaign.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>

#include "calib/discover/campaign/answer/before_search.h"
#include "calib/discover/campaign/answer/judge.h"
#include "calib/discover/campaign/answer/locked_places.h"
#include "calib/discover/campaign/answer/locked_section.h"
#include "calib/discover/campaign/captures/amplitude_unit.h"
#include "calib/discover/campaign/captures/gather_capture.h"
#include "calib/discover/campaign/captures/light_delay.h"
#include "calib/discover/campaign/captures/light_noise.h"
#include "calib/discover/campaign/captures/pool_noise.h"
#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/search/found_model.h"
#include "calib/discover/campaign/search/frames_apart.h"
#include "calib/discover/campaign/search/frames_beat.h"
#include "calib/discover/campaign/search/model_file.h"
#include "calib/discover/campaign/search/next_capture.h"
#include "calib/discover/campaign/search/search_rounds.h"
#include "calib/discover/campaign/search/step_effect.h"
#include "calib/discover/campaign/search/stood_off.h"
#include "calib/discover/marginal.h"
#include "calib/loop/camera_text.h"

namespace toftwin::discover {
namespace {

bool isRecording(const CampaignJob& job) { return std::filesystem::is_regular_file(job.run); }

Result<Campaign> readFor(const CampaignJob& job, const std::optional<FrameClass>& without) {
  return isRecording(job) ? readRecording(job.run, job.poses_of, without) : readCampaign(job.run, job.side, without);
}

struct DeclaredFiles {
  Declared declared;
  std::string text;  ///< of the camera file
};

// GCC 12 takes the emptied map of what was moved for one that never was.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
Result<DeclaredFiles> loadDeclared(const CampaignJob& job) {
  auto camera = loop::loadCamera(job.model);
  if (!camera) return camera.error();
  auto scene = sim::Scene::load(job.scene);
  if (!scene) return scene.error();
  DeclaredFiles files{{std::move(camera->model), *std::move(scene)}, std::move(camera->text)};
  for (const auto& [block, file] : job.scene_of_block) {
    auto other = sim::Scene::load(file);
    if (!other) return other.error();
    files.declared.scene_of_block.emplace(block, *std::move(other));
  }
  return files;
}
#pragma GCC diagnostic pop

/// The measured camera's lens, if the camera file's has the same size.
Result<> takeLens(const Campaign& campaign, Declared& declared, std::vector<std::string>& notes) {
  const CameraInfo &measured = campaign.camera, &own = declared.model.camera();
  if (measured.width != own.width || measured.height != own.height) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format(
            "the run's images have {} x {} pixels, the camera file's camera has {} x {}: these are "
            "not the same camera, or a region or a decimation of it was recorded; give the camera "
            "file of the camera that was measured (--model)",
            measured.width, measured.height, own.width, own.height)};
  }
  const bool is_same = measured.fx == own.fx && measured.fy == own.fy && measured.cx == own.cx &&
                       measured.cy == own.cy && measured.distortion == own.distortion;
  if (is_same) return {};
  declared.model = declared.model.withLens(measured);
  notes.emplace_back("The recording's lens is not the camera file's; the recording's was taken.");
  return {};
}

Error unknownBlock(const std::string& block, const Campaign& campaign) {
  std::vector<std::string> names;
  for (const MeasuredCapture& capture : campaign.captures) {
    if (std::ranges::find(names, capture.record.block) == names.end())
      names.push_back(capture.record.block);
  }
  return {Error::Code::InvalidArgument,
          fmt::format("--scene-of {}: the run has no such block; there are: {}", block,
                      fmt::join(names, ", "))};
}

/// The camera file with a delay of the light, and what its device's offset and gain then are.
Result<JudgedModel> fileWith(const JudgedCampaign& judged, double delay_mm) {
  const sim::SensorModel& file = judged.declared.model;
  JudgedModel model{withDelay(file, effectsWithoutNoise(file), delay_mm)};
  const auto evidence = residualEvidence(judged, model.effects);
  if (!evidence) return evidence.error();
  const Marginal marginal = marginalise(*evidence, judged.scales);
  const Fit common = fit(marginal, nuisanceColumns(marginal));  // offset, gain
  model.offset_mm = common.coefficient[0], model.gain_percent = common.coefficient[1];
  return model;
}

/// The camera file that was written, read as whoever loads it reads it: that is what is judged, not what it was made of.
/// An offset of the range stands in it.
Result<JudgedModel> asWritten(const std::string& model_toml) {
  const auto model = sim::SensorModel::parse(model_toml, "model.toml");
  if (!model)
    return Error{Error::Code::Internal, "what was found cannot be written as a camera file: " + model.error().message};
  return JudgedModel{.effects = effectsWithoutNoise(*model)};
}

/// What the judgement is without locked captures that stood off their poses, where others are left.
Result<> tellLockedOff(const JudgedCampaign& locked, const JudgedCampaign& open, const JudgedModels& models,
                       CampaignFinding& finding) {
  std::size_t gone = 0;
  for (const StoodOff& one : finding.locked_off) gone += one.captures.size();
  if (gone == 0) return {};
  if (gone < locked.lit.captures.size()) {
    auto without = judgeWithout(finding.locked_off, locked, open, models);
    if (!without) return without.error();
    finding.without_off = *std::move(without);
  }
  finding.notes.push_back(noteOf(finding.locked_off, *finding.judgement,
                                 finding.without_off ? &*finding.without_off : nullptr));
  return {};
}

/// How noisy the captures are, beside the light where they were said to be taken, and what noise adds to their means.
Result<> knowNoise(const Declared& declared, const std::vector<std::shared_ptr<const TracedCapture>>& traced,
                   std::vector<MeasuredCapture>& captures) {
  shareLightNoise(traced, captures);
  if (auto pooled = poolNoise(declared, traced, captures); !pooled) return pooled;
  takeNoiseOff(declared.model, captures);
  return {};
}

/// Frames that are apart stay where no others would be left.
void noteWhole(const std::vector<MeasuredCapture>& captures, const std::string& what, CampaignFinding& finding) {
  const auto whole = static_cast<std::size_t>(std::ranges::count_if(captures, &MeasuredCapture::keeps_all));
  if (whole == 0) return;
  finding.notes.push_back(
      fmt::format("{} {} all frames, those that differ from the others, too: fewer than two others would be left.",
                  howMany(whole, what), whole == 1 ? "keeps" : "keep"));
}

Result<> judgeLocked(const CampaignJob& job, const Campaign& campaign, const JudgedCampaign& searched,
                     const JudgedModels& models, CampaignFinding& finding) {
  const Declared& declared = searched.declared;
  if (auto opened = openLockedOf(job, campaign); !opened) return opened;
  auto captures = readLocked(campaign);
  if (!captures) return captures.error();
  noteWhole(*captures, "locked capture", finding);
  TraceOptions options = job.trace;
  options.seed +=
      0x5bd1e995U;  // light of its own: what the open captures' light has by chance must not help
  const auto at_poses = traceAll(declared, *captures, options);
  if (!at_poses) return at_poses.error();
  if (auto known = knowNoise(declared, *at_poses, *captures); !known) return known;
  takeUnitOff(declared.unit_percent, *captures);
  const auto traced = traceWhereTheyStood(declared, models.after.effects, *captures, *at_poses, options);
  if (!traced) return traced.error();
  const Lights varied = traceBeside(declared, *captures, *traced, options);
  const Lit lit{*captures, *traced, varied};
  const JudgedCampaign locked{declared, lit, finding.finding.scales};
  auto judgement = judge(locked, searched, models);
  if (!judgement) return judgement.error();
  finding.judgement = *std::move(judgement);
  auto off = lockedOff(locked, searched, models);
  if (!off) return off.error();
  finding.locked_off = *std::move(off);
  return tellLockedOff(locked, searched, models, finding);
}

/// Captures of one place err alike, which neither their signs nor their dispersions show: what their rows state counts.
FinderOptions finderFor(const CampaignJob& job, const std::vector<MeasuredCapture>& captures) {
  FinderOptions finder = job.finder;
  const bool has_light_noise =
      std::ranges::any_of(captures, [](const MeasuredCapture& one) { return !one.light_variance.empty(); });
  if (has_light_noise && finder.null_model == NullModel::Automatic)
    finder.null_model = NullModel::Noise, finder.least_dispersion = 1.0;
  return finder;
}

void noteHiddenLightNoise(const std::vector<MeasuredCapture>& captures, std::vector<std::string>& notes) {
  const auto hidden = std::ranges::count_if(captures, &MeasuredCapture::hides_light_noise);
  if (hidden == 0) return;
  notes.emplace_back(
      "The camera is simulated, and its frames do not say what noise their light has, which is the same in all frames "
      "from one place: it counts as the camera's. Have light_sigma among the source's planes and record it (toftwin "
      "measure … --planes light_sigma), or take more paths (samples_per_pixel).");
}

void takeFound(Round& round, CampaignFinding& finding) {
  finding.finding = std::move(round.finding);
  finding.effects = std::move(round.effects), finding.updates = std::move(round.updates);
  finding.zero = round.zero, finding.dispersion = round.refitted.dispersion;
}

/// Raw exposures would say where something without a name acts, and of several names which it cannot be.
void noteMissingRawExposures(const sim::SensorModel& model, CampaignFinding& finding) {
  const bool would_say = std::ranges::any_of(finding.effects, [](const FoundEffect& one) {
    return !one.raw && (!one.found.is_catalogue || !one.found.alternatives.empty());
  });
  if (would_say && model.hasPhasors())
    finding.notes.emplace_back(
        "Raw exposures were not recorded with all frames: they would say more of where this acts, and perhaps which "
        "name is wrong. A camera that gives them is measured with toftwin measure … --planes samples.");
}

std::vector<const PixelPattern*> patternsIn(const FoundEffect& one, const CampaignRows& rows) {
  std::vector<const PixelPattern*> patterns;
  if (one.found.is_catalogue) return patterns;
  for (const Term& term : termsOf(one.found))
    if (const PixelPattern* pattern = rows.patternOf(term.carrier)) patterns.push_back(pattern);
  return patterns;
}

/// A pattern of pixels is known as well as each pixel's own noise lets it be: what stays is not the form's fault.
void notePatterns(const CampaignRows& rows, CampaignFinding& finding) {
  constexpr double kNearlyAll = 0.9, kTimes = 4.0;
  for (const FoundEffect& one : finding.effects) {
    for (const PixelPattern* pattern : patternsIn(one, rows)) {
      if (pattern->knownShare() > kNearlyAll) continue;
      finding.notes.push_back(fmt::format(
          "{}: each pixel tells its own value alone, so that of its χ² these captures can remove {:.0f} %; {:.0f} "
          "times as many, at other places, {:.0f} %.",
          one.found.name, 100.0 * pattern->knownShare(), kTimes, 100.0 * pattern->knownShare(kTimes)));
    }
  }
}

double fittedShareOf(const Round& round, const std::vector<FoundEffect>& effects) {
  double freedom = 0.0;
  for (const FoundEffect& one : effects)
    for (const PixelPattern* pattern : patternsIn(one, *round.rows)) freedom += pattern->freedom();
  return std::min(0.5, freedom / std::max(1.0, round.refitted.marginal.rows));
}

/// What does worse on captures that it was not fitted to does not go into the model, whatever it is called.
/// What single frames show stays: these captures do not judge it.
void keepIfWorse(const std::string& text, const Declared& declared, CampaignFinding& finding) {
  // Of what has no form the model is as it was, and so is what it does.
  const bool is_changed = !finding.updates.empty() || finding.zero.delay_mm != 0.0 ||
                          std::ranges::any_of(finding.effects, [](const auto& one) { return one.fitted.has_value(); });
  if (!finding.judgement || !is_changed) return;
  // Where a camera was bumped, what its capture says is of its pose.
  const bool is_bumped = finding.without_off && std::ranges::all_of(finding.locked_off, &StoodOff::is_set_aside);
  finding.is_worse = (is_bumped ? *finding.without_off : *finding.judgement).gained < 0.0;
  if (!finding.is_worse) return;
  CampaignFinding kept{.plan = finding.plan,
                       .captures = finding.captures,
                       .effects = finding.effects,
                       .updates = finding.updates};
  std::erase_if(kept.effects, [](const FoundEffect& one) { return !one.is_of_single_frames; });
  std::erase_if(kept.updates, [](const FittedEffect& one) { return !one.is_of_single_frames; });
  const bool is_as_it_was = kept.effects.empty() && kept.updates.empty();
  finding.model_toml =
      is_as_it_was
          ? "# Left as it was by toftwin discover: what it found does worse on the locked captures.\n" + text
          : modelText(text, declared, kept);
  finding.notes.emplace_back(
      "With what was found, the locked captures fit worse than before: it is not in model.toml, which is the "
      "camera file as it was" +
      std::string{is_as_it_was ? "." : ", but for what single frames show."});
}

void addFramesApart(const FramesApart& apart, CampaignFinding& finding) {
  finding.effects.push_back(effectOf(apart));
  finding.alike_p = apart.p;
  if (apart.isMinority())
    finding.notes.push_back(fmt::format("What else is told is of the other frames: {} is left out of all means.",
                                        apart.inWords()));
}

}  // namespace

Result<CampaignFinding> searchCampaign(const CampaignJob& job, compare::Progress& progress) {
  const auto began = std::chrono::steady_clock::now();
  auto files = loadDeclared(job);
  if (!files) return files.error();
  if (auto closed = checkStillClosed(job); !closed) return closed.error();
  Declared& declared = files->declared;
  progress.plan("read", 2.0);
  progress.plan("trace", 8.0);
  progress.plan("trace again where the cameras stood", 8.0);
  progress.plan("what each effect would do", 15.0);
  progress.plan("find", 15.0);
  progress.plan("fit", 8.0);
  progress.plan("judge", 5.0);
  progress.begin();
  auto campaign = readFor(job, {});
  if (!campaign) return campaign.error();
  const auto apart = framesApart(campaign->captures, job.finder.seed);
  const auto beat = apart ? std::nullopt : framesBeat(campaign->captures, job.finder.seed);
  if (apart && apart->isMinority()) campaign = readFor(job, apart->which);
  if (!campaign) return campaign.error();
  if (auto whole = checkLockedFiles(job, *campaign); !whole) return whole.error();
  CampaignFinding finding;
  finding.notes = campaign->notes;
  noteWhole(campaign->captures, "open capture", finding);
  noteHiddenLightNoise(campaign->captures, finding.notes);
  noteNoiseDrawnAlike(campaign->captures, finding.notes);
  if (auto taken = takeLens(*campaign, declared, finding.notes); !taken) return taken.error();
  if (auto same = checkFrequencies(*campaign, declared.model); !same) return same.error();
  for (const auto& [block, scene] : declared.scene_of_block) {
    const auto is_of = [&](const MeasuredCapture& capture) {
      return capture.record.block == block;
    };
    if (std::ranges::none_of(campaign->captures, is_of)) return unknownBlock(block, *campaign);
  }
  finding.camera = declared.model.model(), finding.plan = campaign->name;
  finding.captures = campaign->captures.size(), finding.locked = campaign->locked.size();
  for (const MeasuredCapture& capture : campaign->captures) finding.frames += capture.frames;
  progress.begin();
  const auto tell = [&](double share) { progress.at(share); };
  const auto at_poses = traceAll(declared, campaign->captures, job.trace, tell);
  if (!at_poses) return at_poses.error();
  if (auto known = knowNoise(declared, *at_poses, campaign->captures); !known) return known.error();
  const auto unit = unitOf(declared, campaign->captures, *at_poses);
  if (!unit) return unit.error();
  declared.unit_percent = *unit;
  takeUnitOff(*unit, campaign->captures);
  const auto late = delayThatFits({declared, {campaign->captures, *at_poses, lightsOf(*at_poses)}, {}});
  if (!late) return late.error();
  declared.delay_mm = *late;
  // What single frames tell, means over frames need not guess.
  const auto steps = stepsIn(declared.model, campaign->captures);
  const FinderOptions finder = finderFor(job, campaign->captures);
  OpenCaptures open{campaign->captures, *at_poses, job.trace, finder, job.left_out, steps.has_value()};
  if (steps) open.left_out.emplace_back(sim::Quantisation::about.name);
  const auto searched_for = searchBesideBumped(
      declared, open, [&] { progress.begin(); }, tell);
  if (!searched_for) return searched_for.error();
  Round& round = *searched_for->round;
  const SomeCaptures* some = searched_for->without.get();
  finding.off = searched_for->off;
  for (const StoodOff& one : finding.off) finding.notes.push_back(noteOf(one));
  declared.delay_mm = round.declared.delay_mm;
  const Lit lit{some != nullptr ? some->captures : campaign->captures, round.traced, round.varied};
  takeFound(round, finding);
  notePatterns(*round.rows, finding);
  noteMissingRawExposures(declared.model, finding);
  addNextCaptures({round.declared, lit, finding.finding.scales}, *round.rows, finding.effects);
  const double gain_percent = finding.zero.gain_percent;
  finding.zero.delay_mm += declared.delay_mm, finding.zero.gain_percent += declared.unit_percent;
  if (steps) addSteps(job, declared.model, *steps, finding);
  if (apart) addFramesApart(*apart, finding);
  if (beat) finding.effects.push_back(effectOf(*beat)), finding.alike_p = beat->p;
  finding.model_toml = modelText(files->text, declared, finding);
  progress.begin();
  if (job.open_locked && !campaign->locked.empty()) {
    const JudgedCampaign searched{declared, lit, finding.finding.scales};
    const auto before = fileWith(searched, 0.0);
    if (!before) return before.error();
    const auto with_zero = fileWith(searched, finding.zero.delay_mm);
    if (!with_zero) return with_zero.error();
    auto after = asWritten(finding.model_toml);
    if (!after) return after.error();
    after->gain_percent = gain_percent, after->fitted_share = fittedShareOf(round, finding.effects);
    if (auto done = judgeLocked(job, *campaign, searched, {*before, *with_zero, *std::move(after)}, finding); !done)
      return done.error();
    keepIfWorse(files->text, declared, finding);
  } else {
    finding.notes.emplace_back(
        campaign->locked.empty()
            ? "The run has no locked captures, so nothing is said of captures that the search "
              "has not seen: lock some in the plan."
            : "The locked captures stay closed, as asked.");
  }
  finding.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return finding;
}

Result<CampaignAnswer> discoverCampaign(const CampaignJob& job, compare::Progress& progress) {
  if (auto writable = checkCanWrite(job.output); !writable) return writable.error();
  auto finding = searchCampaign(job, progress);
  if (!finding) return finding.error();
  auto page = writeReport(job, *finding);
  if (!page) return page.error();
  if (auto written = compare::writeFile(job.output / "model.toml", finding->model_toml); !written) return written.error();
  progress.end();
  const auto& judged = finding->judgement;
  return CampaignAnswer{.page = *std::move(page), .verdict = verdictOf(*finding),
                        .ladder = judged ? loop::ladderText(ladderOf(*judged, hasDelay(*finding)), "mm") : "",
                        .notes = std::move(finding->notes)};
}

}  // namespace toftwin::discover
