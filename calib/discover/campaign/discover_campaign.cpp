// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/discover_campaign.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "calib/discover/campaign/before_search.h"
#include "calib/discover/campaign/carriers.h"
#include "calib/discover/campaign/found_model.h"
#include "calib/discover/campaign/model_file.h"
#include "calib/discover/campaign/next_capture.h"
#include "calib/discover/campaign/reading.h"
#include "calib/discover/campaign/step_effect.h"
#include "calib/discover/marginal.h"

namespace toftwin::discover {
namespace {

bool isRecording(const CampaignJob& job) { return std::filesystem::is_regular_file(job.run); }

struct DeclaredFiles {
  Declared declared;
  std::string text;  ///< of the camera file
};

Result<std::string> textOf(const std::filesystem::path& file) {
  std::ifstream in{file, std::ios::binary};
  std::ostringstream text;
  if (in) text << in.rdbuf();
  if (in) return text.str();
  return Error{Error::Code::NotFound, fmt::format("{}: cannot be read", file.string())};
}

Result<DeclaredFiles> loadDeclared(const CampaignJob& job) {
  constexpr std::string_view kPreset = "preset:";  // as `toftwin info` has it
  const auto names = sim::SensorModel::presetNames();
  const std::string name = job.model.starts_with(kPreset) ? job.model.substr(kPreset.size()) : job.model;
  const bool is_preset = std::ranges::find(names, name) != names.end();
  auto text = is_preset ? sim::SensorModel::presetText(name) : textOf(job.model);
  if (!text) {
    return Error{text.error().code,
                 fmt::format("{}; --model takes a camera file or one of the presets {}",
                             text.error().message, fmt::join(names, ", "))};
  }
  auto model = sim::SensorModel::parse(*text, is_preset ? name + ".toml" : job.model);
  if (!model) return model.error();
  auto scene = sim::Scene::load(job.scene);
  if (!scene) return scene.error();
  std::map<std::string, sim::Scene> scene_of_block;
  for (const auto& [block, file] : job.scene_of_block) {
    auto other = sim::Scene::load(file);
    if (!other) return other.error();
    scene_of_block.emplace(block, *std::move(other));
  }
  return DeclaredFiles{{*std::move(model), *std::move(scene), std::move(scene_of_block)}, *std::move(text)};
}

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

/// Effects of the declared model whose numbers the data move by so much that it is no chance: χ² of
/// their columns, with everything that was found, over 25 more than their number (5 standard
/// errors).
std::vector<std::size_t> wrongNumbers(const Evidence& evidence, const Finding& finding,
                                      const std::vector<sim::AnyEffect>& effects) {
  const Marginal marginal = marginalise(evidence, finding.scales);
  Columns columns = nuisanceColumns(marginal);
  for (const Group& group : marginal.groups) {
    const bool is_found = std::ranges::any_of(finding.effects, [&](const Effect& effect) {
      return effect.is_catalogue && effect.name == group.name;
    });
    if (is_found || group.kind == Kind::Generic) append(columns, group);
  }
  const Fit all = fit(marginal, columns);
  std::vector<std::size_t> places;
  for (const Group& group : marginal.groups) {
    if (group.kind != Kind::Declared) continue;
    Columns without;
    for (const Eigen::Index column : columns) {
      const auto c = static_cast<std::size_t>(column);
      if (c < group.first || c >= group.first + group.count) without.push_back(column);
    }
    const double gain =
        (fit(marginal, without).deviance - all.deviance) / std::max(1.0, all.dispersion());
    if (gain < 25.0 + static_cast<double>(group.count)) continue;
    const auto place = std::ranges::find_if(
        effects, [&](const auto& effect) { return nameOf(effect) == group.name; });
    if (place != effects.end()) places.push_back(static_cast<std::size_t>(place - effects.begin()));
  }
  return places;
}

bool isQuantisation(const sim::AnyEffect& effect) {
  return std::holds_alternative<sim::Quantisation>(effect);
}

/// The effects without noise, with what was found in them.
struct WithFound {
  std::vector<sim::AnyEffect> effects;
  std::vector<std::size_t> fitted;  ///< places of those whose numbers are to be fitted
  std::map<std::size_t, std::vector<std::string>> only{};  ///< of those without a name, the numbers
};

std::size_t insert(WithFound& inserted, const sim::AnyEffect& effect) {
  const auto behind = std::ranges::find_if(inserted.effects, [&](const sim::AnyEffect& other) {
    return placeOf(other) > placeOf(effect);
  });
  const auto place = static_cast<std::size_t>(behind - inserted.effects.begin());
  inserted.effects.insert(behind, effect);
  for (std::size_t& other : inserted.fitted) other += other >= place ? 1 : 0;
  std::map<std::size_t, std::vector<std::string>> only;
  for (auto& [other, keys] : inserted.only) only.emplace(other + (other >= place ? 1 : 0), std::move(keys));
  inserted.only = std::move(only);
  return place;
}

WithFound insertFound(const CampaignRows& rows, const Declared& declared,
                      const std::vector<std::size_t>& updates, CampaignFinding& finding) {
  WithFound inserted{declaredEffects(declared), updates};
  std::vector<const NamedFit*> fits;
  for (const Effect& effect : finding.finding.effects)
    if (effect.fit) fits.push_back(effect.fit.get());
  const auto included = rows.including(fits, false);
  const auto& with_found = dynamic_cast<const CampaignRows&>(*included);
  for (const Effect& effect : finding.finding.effects) {
    FoundEffect found{effect, {}};
    if (effect.fit) {
      const CampaignFit& fit = campaignFitOf(*effect.fit);
      const std::size_t place = insert(inserted, fit.effect);
      // All of its numbers: one that was not needed is not known to be nothing.
      inserted.fitted.push_back(place);
      found.fitted = FittedEffect{fit.effect, {}};
    } else {
      for (const LearnedEffect& learned : learnedEffectsOf(effect, with_found, declared.model)) {
        const std::size_t place = insert(inserted, learned.effect);
        if (!learned.free.empty()) inserted.fitted.push_back(place), inserted.only[place] = learned.free;
        (found.fitted ? found.more.emplace_back(FittedEffect{learned.effect, {}})
                      : found.fitted.emplace(FittedEffect{learned.effect, {}}));
      }
    }
    finding.effects.push_back(std::move(found));
  }
  return inserted;
}

/// Whether two are of one kind, and of one raw exposure where there are several.
bool isSameForm(const sim::AnyEffect& a, const sim::AnyEffect& b) {
  if (a.index() != b.index()) return false;
  const auto* x = std::get_if<sim::SampleOffset>(&a);
  const auto* y = std::get_if<sim::SampleOffset>(&b);
  return x == nullptr || (x->step == y->step && x->tap == y->tap);
}

/// The form of a found effect that was fitted; null: it is of a declared one.
FittedEffect* formOf(const FittedEffect& fitted, CampaignFinding& finding) {
  for (FoundEffect& found : finding.effects) {
    if (found.fitted && isSameForm(found.fitted->effect, fitted.effect)) return &*found.fitted;
    for (FittedEffect& more : found.more)
      if (isSameForm(more.effect, fitted.effect)) return &more;
  }
  return nullptr;
}

void takeFitted(const Refitted& refitted, double known_delay_mm, CampaignFinding& finding) {
  for (const FittedEffect& one : refitted.fitted) {
    if (FittedEffect* form = formOf(one, finding))
      *form = one;
    else
      finding.updates.push_back(one);
  }
  finding.zero = zeroOf(refitted, known_delay_mm);
  finding.dispersion = refitted.dispersion;
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

Result<> judgeLocked(const CampaignJob& job, const Campaign& campaign, const JudgedCampaign& searched,
                     const JudgedModels& models, CampaignFinding& finding) {
  const Declared& declared = searched.declared;
  if (auto opened = openLockedOf(job, campaign); !opened) return opened;
  auto captures = readLocked(campaign);
  if (!captures) return captures.error();
  takeNoiseOff(declared.model, *captures);
  TraceOptions options = job.trace;
  options.seed +=
      0x5bd1e995U;  // light of its own: what the open captures' light has by chance must not help
  const auto at_poses = traceAll(declared, *captures, options);
  if (!at_poses) return at_poses.error();
  const auto traced = traceWhereTheyStood(declared, *captures, *at_poses, options);
  if (!traced) return traced.error();
  const Lit lit{*captures, *traced, *at_poses};
  auto judgement = judge({declared, lit, finding.finding.scales}, searched, models);
  if (!judgement) return judgement.error();
  finding.judgement = *std::move(judgement);
  return {};
}

/// What does worse on captures that it was not fitted to does not go into the model, whatever it is called.
/// What single frames show stays: these captures do not judge it.
void keepIfWorse(const std::string& text, const Declared& declared, CampaignFinding& finding) {
  if (!finding.judgement) return;
  finding.is_worse = finding.judgement->after.per_row > finding.judgement->before.per_row;
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
  auto campaign = isRecording(job) ? readRecording(job.run, job.poses_of) : readCampaign(job.run, job.side);
  if (!campaign) return campaign.error();
  if (auto whole = checkLockedFiles(job, *campaign); !whole) return whole.error();
  CampaignFinding finding;
  finding.notes = campaign->notes;
  if (auto taken = takeLens(*campaign, declared, finding.notes); !taken) return taken.error();
  if (auto same = checkFrequencies(*campaign, declared.model); !same) return same.error();
  takeNoiseOff(declared.model, campaign->captures);
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
  const auto late = delayThatFits({declared, {campaign->captures, *at_poses, *at_poses}, {}});
  if (!late) return late.error();
  declared.delay_mm = *late;
  progress.begin();
  const auto traced = traceWhereTheyStood(declared, campaign->captures, *at_poses, job.trace, tell);
  if (!traced) return traced.error();
  progress.begin();
  const Lit lit{campaign->captures, *traced, *at_poses};
  // What single frames tell, means over frames need not guess.
  const auto steps = stepsIn(declared.model, campaign->captures);
  std::vector<std::string> left_out = job.left_out;
  if (steps) left_out.emplace_back(sim::Quantisation::about.name);
  const auto rows = CampaignRows::make(declared, lit, {.left_out = left_out});
  if (!rows) return rows.error();
  progress.begin();
  finding.finding = find(*rows, job.finder);
  progress.begin();
  std::vector<TermGroup> terms;
  for (const Effect& effect : finding.finding.effects) {
    if (!effect.is_catalogue) terms.push_back({effect.name, Kind::Generic, termsOf(effect), 0});
  }
  auto updates = wrongNumbers(rows->evidence(terms), finding.finding, declaredEffects(declared));
  if (steps)
    std::erase_if(updates,
                  [&](std::size_t place) { return isQuantisation(declaredEffects(declared)[place]); });
  WithFound inserted = insertFound(*rows, declared, updates, finding);
  const auto refitted = refit(*rows, inserted.effects, inserted.fitted,
                              {.scales = finding.finding.scales, .only = inserted.only});
  if (!refitted) return refitted.error();
  takeFitted(*refitted, *late, finding);
  addNextCaptures({declared, lit, finding.finding.scales}, *rows, finding.effects);
  if (steps) addSteps(job, declared.model, *steps, finding);
  const Zero beyond = finding.zero;
  finding.zero.delay_mm += *late;
  finding.model_toml = modelText(files->text, declared, finding);
  progress.begin();
  if (job.open_locked && !campaign->locked.empty()) {
    const JudgedCampaign searched{declared, lit, finding.finding.scales};
    const auto before = fileWith(searched, 0.0);
    if (!before) return before.error();
    const auto with_zero = fileWith(searched, finding.zero.delay_mm);
    if (!with_zero) return with_zero.error();
    const JudgedModel after{withDelay(declared.model, refitted->effects, beyond.delay_mm),
                            beyond.hasOffset() ? beyond.offset_mm : 0.0, beyond.gain_percent};
    if (auto done = judgeLocked(job, *campaign, searched, {*before, *with_zero, after}, finding); !done)
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
  std::ofstream out{job.output / "model.toml"};
  out << finding->model_toml;
  out.flush();
  if (!out)
    return Error{Error::Code::StorageFull,
                 fmt::format("{}: cannot be written", (job.output / "model.toml").string())};
  progress.end();
  return CampaignAnswer{*std::move(page), verdictOf(*finding), std::move(finding->notes)};
}

}  // namespace toftwin::discover
