// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/compare/report.h"
#include "calib/discover/campaign/answer/campaign_json.h"
#include "calib/discover/campaign/answer/discover_campaign.h"
#include "calib/discover/campaign/answer/locked_section.h"
#include "calib/discover/campaign/captures/gather_capture.h"
#include "calib/discover/campaign/rows/carriers.h"
#include "calib/discover/campaign/rows/pose_errors.h"

namespace toftwin::discover {
namespace {

using compare::shown;

/// What it goes with: a gain and a delay are what it does.
std::string coveredInWords(const Effect& effect) {
  std::vector<std::string> names = effect.covariates;
  std::erase_if(names, [](const std::string& name) { return name == kGainCarrier || name == kDelayCarrier; });
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string nameInWords(const Effect& effect) {
  const std::string covered = coveredInWords(effect);
  return covered.empty() ? effect.name : fmt::format("{} ({})", effect.name, covered);
}

std::string titleOf(const Effect& effect) {
  if (effect.is_rest) return "what the form above leaves: " + nameInWords(effect);
  if (isOfPoses(effect.covariates)) return fmt::format("an error of the poses, not of the camera: {}", effect.name);
  const std::string place = effect.fit ? placeInWords(campaignFitOf(*effect.fit).effect) : "";
  return effect.is_catalogue
             ? effect.name + (place.empty() ? "" : fmt::format(" ({})", place))
             : "undeclared: " + nameInWords(effect);
}

/// Whether all it says is that the poses err, and nothing of the camera.
bool isOnlyOfPoses(const FoundEffect& one) {
  return isOfPoses(one.found.covariates) && one.found.alternatives.empty();
}

/// Effects with a cause of their own.
std::size_t countOf(const CampaignFinding& finding) {
  const auto rests = std::ranges::count_if(finding.effects, [](const FoundEffect& one) { return one.found.is_rest; });
  return finding.effects.size() - static_cast<std::size_t>(rests);
}

/// How sure its choice is, where it is told alone and captures drawn anew mostly choose another.
std::string againInWords(const FoundEffect& one) {
  constexpr double kSeldom = 0.5;
  if (one.is_of_single_frames || !one.found.alternatives.empty() || !(one.found.frequency < kSeldom)) return "";
  return fmt::format(" (of captures drawn anew only {} say so)", compare::shownPercent(one.found.frequency));
}

/// Its title, and what else it may be.
std::string answerOf(const FoundEffect& found) {
  const Effect& effect = found.found;
  std::string answer = titleOf(effect) + againInWords(found);
  for (const Alternative& other : effect.alternatives)
    answer += " or " + (other.group.terms.empty() ? other.name : fmt::format("undeclared: {}", other.name));
  return effect.alternatives.empty() ? answer : answer + " (these captures do not tell them apart)";
}

std::string withError(const std::string& name, double value, double error) {
  // Of a jump's place only the captures on both sides are known.
  return error > 0.0 ? fmt::format("{} = {:.4g} ± {:.2g}", name, value, error) : fmt::format("{} = {:.4g}", name, value);
}

std::string numbersInWords(const FoundEffect& one) {
  constexpr std::size_t kMost = 6;
  std::vector<std::string> fitted, found;
  for (const FittedNumber& number : numbersIn(one)) fitted.push_back(withError(number.key, number.value, number.error));
  for (const Estimate& number : one.found.numbers) found.push_back(withError(number.name, number.value, number.error));
  const std::string numbers = found.size() > kMost ? "" : fmt::format("{}", fmt::join(found, "; "));
  if (!one.fitted) {
    const bool is_of_poses = isOfPoses(one.found.covariates);
    const std::string why = is_of_poses ? "the camera is as it was" : "the simulator has no form for it";
    return fmt::format("{}{}{}; it is not in model.toml", numbers, numbers.empty() ? "" : "; ", why);
  }
  if (!fitted.empty()) return fmt::format("{}", fmt::join(fitted, "; "));
  return numbers.empty() ? "see its terms in model.toml" : numbers;
}

compare::TableBlock effectTable(const CampaignFinding& finding) {
  compare::TableBlock table{
      "What the model lacked. Gain: how much less χ² is left of captures that it was not fitted "
      "to; again: how often it is the best when captures are drawn anew",
      {"effect", "acts on", "goes with", "numbers", "gain", "again"},
      {}};
  for (const FoundEffect& one : finding.effects) {
    table.rows.push_back({titleOf(one.found), stageInWords(one.found),
                          coveredInWords(one.found), numbersInWords(one),
                          one.is_of_single_frames
                              ? "–"
                              : compare::shownWithError(one.found.gain.mean, one.found.gain.error, 0),
                          one.is_of_single_frames ? "–" : compare::shownPercent(one.found.frequency)});
  }
  for (const FittedEffect& one : finding.updates) {
    std::vector<std::string> words;
    for (const FittedNumber& number : one.numbers)
      words.push_back(withError(number.key, number.value, number.error));
    table.rows.push_back({"parameter update: " + nameOf(one.effect),
                          std::string{discover::nameOf(discover::stageOf(one.effect))}, "",
                          fmt::format("{}", fmt::join(words, "; ")), "–", "–"});
  }
  return table;
}

compare::TableBlock seenTable(const CampaignFinding& finding) {
  compare::TableBlock table{
      "What explains most of the difference, each by itself: χ² of its columns, and how unlikely "
      "it "
      "is where nothing is there, as a normal deviate",
      {"group", "z", "χ²", "numbers"},
      {}};
  for (const SeenGroup& one : seenFirst(finding))
    table.rows.push_back(
        {one.name, shown(one.z, 1), shown(one.statistic, 1), std::to_string(one.rank)});
  return table;
}

/// What the raw exposures say of where an effect acts; empty: nothing.
std::string rawInWords(const FoundEffect& one) {
  constexpr double kSays = 0.5;  // a share that is known worse says nothing
  std::vector<std::string> words;
  const auto is_before = one.raw->isBeforeDecoding();
  if (const auto& share = one.raw->share; share && share->error < kSays) {
    words.push_back(fmt::format("Of what {} does to the range, the raw exposures' phase shows {}: {}", one.found.name,
                                compare::shownWithError(share->mean, share->error, 2),
                                !is_before   ? "not enough to say whether it acts before they are decoded"
                                : *is_before ? "it acts before they are decoded"
                                             : "it acts on what is decoded from them"));
  }
  if (one.raw->contradicts())
    words.push_back(fmt::format("The raw exposures contradict each other by {:.1f} standard deviations more than all "
                                "that was found says",
                                one.raw->contradiction));
  return fmt::format("{}", fmt::join(words, ". "));
}

/// The tests of single frames that told something, each after `between`.
std::string singleFramesInWords(const CampaignFinding& finding, const std::string& between) {
  std::string words;
  if (finding.alike_p) words += fmt::format("{}that all frames are alike: p = {:.3g}", between, *finding.alike_p);
  if (finding.steps_p) words += fmt::format("{}that they have no steps: p = {:.3g}", between, *finding.steps_p);
  return words;
}

compare::Section foundSection(const CampaignFinding& finding) {
  compare::Section section{
      .id = "effects", .title = "What was found", .verdict = verdictOf(finding)};
  section.tone = compare::Tone::Neutral;
  if (!finding.effects.empty() || !finding.updates.empty())
    section.blocks.emplace_back(effectTable(finding));
  for (const FoundEffect& one : finding.effects) {
    for (const Alternative& other : one.found.alternatives) {
      section.blocks.emplace_back(compare::Paragraph{
          fmt::format("{} or {}: these captures hardly tell them apart (correlation {:.2f}).",
                      titleOf(one.found), other.name, other.correlation)});
    }
    if (one.raw)
      if (const std::string words = rawInWords(one); !words.empty())
        section.blocks.emplace_back(compare::Paragraph{words + "."});
    if (!one.found.refused.empty()) {
      section.blocks.emplace_back(compare::Paragraph{
          fmt::format("Fitted and not named. {}.", fmt::join(one.found.refused, "; ")), true});
    }
    if (const auto& next = one.next) {
      section.blocks.emplace_back(compare::Paragraph{"Next experiment: " + adviceOf(*next) + "."});
    } else if (const auto& change = one.found.experiment) {
      section.blocks.emplace_back(compare::Paragraph{
          fmt::format("Next experiment: hold {} at {:.4g} and change {} from {:.4g} to {:.4g}.", change->hold,
                      change->held_at, change->vary, change->from, change->to)});
    }
  }
  section.blocks.emplace_back(compare::Paragraph{fmt::format(
      "Is there anything? p = {:.3g} for all {} groups together, against {} campaigns with nothing "
      "in "
      "them{}; of what is left p = {:.3g}{}. Offset of the device against its poses: {}.",
      finding.finding.first_p, finding.finding.score_names.size(), finding.finding.draws,
      finding.finding.null_model == NullModel::SignFlips ? " (sign flips of captures)" : "",
      finding.finding.last_p, singleFramesInWords(finding, "; of single frames, "),
      compare::shownWithError(finding.zero.offset_mm, finding.zero.offset_error_mm, 2) + " mm" +
          (finding.zero.delay_mm == 0.0
               ? ""
               : fmt::format("; delay of its light: {:.2f} mm", finding.zero.delay_mm)) +
          ". Behind ± stands one standard error, on this page and in model.toml")});
  section.blocks.emplace_back(seenTable(finding));
  if (finding.finding.scales.size() >= 2) {
    section.blocks.emplace_back(compare::Paragraph{
        fmt::format("Poses are off by {:.2g} times 1 mm and 0.1°, the light by {:.2g} times 1 %, "
                    "as the captures "
                    "themselves say. χ² per row of what is left: {:.2f}.",
                    finding.finding.scales[0], finding.finding.scales[1], finding.dispersion),
        true});
  }
  for (const std::string& note : finding.notes)
    section.blocks.emplace_back(compare::Paragraph{note, true});
  return section;
}

std::vector<compare::Card> cardsOf(const CampaignFinding& finding) {
  std::vector<compare::Card> cards{
      {"effects found", std::to_string(countOf(finding) + finding.updates.size()),
       fmt::format("{}, {}", howMany(finding.captures, "capture"), howMany(finding.frames, "frame"))},
      {"p of nothing being there", fmt::format("{:.3g}", finding.finding.first_p),
       fmt::format("of what is left: {:.3g}{}", finding.finding.last_p, singleFramesInWords(finding, "; "))}};
  if (const auto& judged = finding.judgement) {
    cards.push_back(
        {"RMS, locked captures",
         fmt::format("{} → {} mm", shown(judged->before.rms_mm, 2), shown(judged->after.rms_mm, 2)),
         fmt::format("bias {} → {} mm", shown(judged->before.bias_mm, 2),
                     shown(judged->after.bias_mm, 2))});
    if (finding.hasJudged()) {
      cards.push_back({"explainable error removed", compare::shownPercent(judged->removed),
                       fmt::format("95 %: {} to {}", compare::shownPercent(judged->removed_low),
                                   compare::shownPercent(judged->removed_high)),
                       judged->removed_low > 0.0 ? compare::Tone::Good : compare::Tone::Fair});
    }
  }
  return cards;
}

}  // namespace

std::vector<SeenGroup> seenFirst(const CampaignFinding& finding, std::size_t most) {
  std::vector<SeenGroup> all;
  const auto& scores = finding.finding.scores;
  for (std::size_t i = 0; i < std::min(scores.size(), finding.finding.score_names.size()); ++i)
    all.push_back(
        {finding.finding.score_names[i], scores[i].z, scores[i].statistic, scores[i].rank});
  std::ranges::sort(all, std::greater<>{}, &SeenGroup::z);
  all.resize(std::min(all.size(), most));
  return all;
}

namespace {

/// How often the noise what is left is, where nobody can overlook it; empty where noise is all, or nearly.
std::string leftInWords(const CampaignFinding& finding) {
  constexpr double kSeen = 2.0, kAnother = 100.0;
  if (!finding.judgement) return "";
  const double per_row = finding.judgement->after.per_row / std::max(1.0, finding.judgement->noise);
  if (!(per_row > kSeen)) return "";
  const std::string left = fmt::format(
      ". The locked captures still differ from the model by {:.3g} times the noise (χ² per row {:.3g})",
      std::sqrt(per_row), finding.judgement->after.per_row);
  return per_row > kAnother && !(finding.judgement->removed > 0.5)
             ? left + ": the scene or the poses are perhaps not those of what was measured"
             : left;
}

/// What no effect holds for, beside those that were found.
std::string restInWords(const CampaignFinding& finding) {
  constexpr double kAlpha = 0.005;  // of each test but the first
  return finding.finding.last_p > kAlpha
             ? ""
             : fmt::format(". Something else is left (p = {:.2g}) that holds on no captures it was not fitted to",
                           finding.finding.last_p);
}

std::string nothingInWords(const CampaignFinding& finding) {
  const std::string beside = hasDelay(finding) ? ", beside it," : "";
  const std::string rest =
      finding.finding.first_p > 0.01
          ? fmt::format("nothing{} is left above the noise (p = {:.2g})", beside, finding.finding.first_p)
          : fmt::format(
                "something{} is left (p = {:.2g}), but nothing that holds on captures it was not fitted to",
                beside, finding.finding.first_p);
  return capitalised(hasDelay(finding) ? delayInWords(finding) + "; " + rest : rest) + leftInWords(finding);
}

/// Without what is set aside.
std::string foundInWords(const CampaignFinding& finding) {
  if (finding.effects.empty() && finding.updates.empty()) return nothingInWords(finding);
  std::vector<std::string> names, poses;
  for (const FoundEffect& one : finding.effects)
    if (!one.found.is_rest) (isOnlyOfPoses(one) ? poses : names).push_back(answerOf(one));
  for (const FittedEffect& one : finding.updates)
    names.push_back("parameter update: " + nameOf(one.effect));
  if (names.empty())
    return fmt::format("The model of the camera lacks nothing that these captures show. There is {}{}",
                       fmt::join(poses, "; "), leftInWords(finding));
  names.insert(names.end(), poses.begin(), poses.end());
  if (finding.is_worse && finding.hasJudged())
    return fmt::format(
               "Something is left that looks like {}, but with it the locked captures fit worse (RMS {} → {} "
               "mm): it is not in model.toml",
               fmt::join(names, "; "), shown(finding.judgement->before.rms_mm, 2),
               shown(finding.judgement->after.rms_mm, 2)) +
           leftInWords(finding);
  std::string verdict = fmt::format("The model lacks {}", fmt::join(names, "; "));
  if (finding.effects.empty())
    verdict = fmt::format("The model has wrong numbers: {}", fmt::join(names, "; "));
  if (!finding.hasJudged()) verdict += ", which single frames show and their means do not";
  if (hasDelay(finding)) verdict += ". " + capitalised(delayInWords(finding));
  if (!finding.hasJudged()) return verdict + restInWords(finding);
  if (const auto& judged = finding.judgement) {
    verdict += fmt::format(". On the locked captures: RMS {} → {} mm, {} of what {} is removed",
                           shown(judged->before.rms_mm, 2), shown(judged->after.rms_mm, 2),
                           compare::shownPercent(judged->removed),
                           hasDelay(finding) ? "the delay leaves" : "can be explained");
  }
  return verdict + restInWords(finding) + leftInWords(finding);
}

}  // namespace

std::string verdictOf(const CampaignFinding& finding) {
  std::vector<std::string> words;
  for (const StoodOff& one : finding.off)
    if (one.is_set_aside) words.push_back(one.inWords());
  const std::string verdict = foundInWords(finding);
  return words.empty() ? verdict : fmt::format("{}. Set aside: {}", verdict, fmt::join(words, "; "));
}

Result<std::filesystem::path> writeReport(const CampaignJob& job, const CampaignFinding& finding) {
  compare::Report report{.title = "What the camera model lacks"};
  report.subtitle = fmt::format("{}: {} open and {} locked {} of {}", finding.camera, finding.captures,
                                finding.locked, finding.locked == 1 ? "capture" : "captures", finding.plan);
  report.verdict = verdictOf(finding) + ".";
  report.cards = cardsOf(finding);
  if (finding.judgement) report.sections.push_back(ladderSection(finding));
  report.sections.push_back(foundSection(finding));
  if (finding.judgement) report.sections.push_back(lockedSection(finding));
  report.colophon = fmt::format("toftwin {}, {}{}{}; {:.0f} s", TOFTWIN_VERSION, today(),
                                job.note.empty() ? "" : ", ", job.note, finding.seconds);
  report.data = jsonOf(job, finding);
  report.written_by = "toftwin discover", report.explained_in = "docs/discover-campaigns.md";
  return compare::write(report, job.output);
}

}  // namespace toftwin::discover
