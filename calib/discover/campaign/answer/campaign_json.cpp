// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/answer/campaign_json.h"

#include <ctime>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "calib/discover/campaign/answer/locked_section.h"
#include "calib/discover/campaign/rows/pose_errors.h"

namespace toftwin::discover {
namespace {

using compare::Json;

Json toJson(const RangeErrors& errors) {
  Json json = Json::object();
  json.set("pixels", errors.pixels).set("bias_mm", errors.bias_mm).set("rms_mm", errors.rms_mm);
  json.set("p95_mm", errors.p95_mm).set("chi2_per_row", errors.per_row);
  json.set("neighbour_correlation", errors.neighbour_correlation)
      .set("masks_agree", errors.masks_agree);
  return json;
}

Json toJson(const std::vector<StoodOff>& off) {
  Json all = Json::array();
  for (const StoodOff& place : off) {
    Json one = Json::object();
    one.set("capture", place.number).set("name", place.name).set("captures_there", place.captures.size());
    one.set("shift_mm", place.shift_mm).set("turn_deg", place.turn_deg).set("is_set_aside", place.is_set_aside);
    all.push(std::move(one));
  }
  return all;
}

Json toJson(const JudgedRegion& region) {
  Json json = Json::object();
  json.set("name", region.name).set("pixels", region.pixels);
  json.set("bias_before_mm", region.bias_before_mm).set("bias_after_mm", region.bias_after_mm);
  json.set("rms_before_mm", region.rms_before_mm).set("rms_after_mm", region.rms_after_mm);
  json.set("p95_before_mm", region.p95_before_mm).set("p95_after_mm", region.p95_after_mm);
  return json.set("noise_mm", region.noise_mm);
}

Json toJson(const Judgement& judged) {
  Json locked = Json::object();
  locked.set("raw", toJson(judged.raw)).set("before", toJson(judged.before)).set("after", toJson(judged.after));
  locked.set("with_zero", toJson(judged.with_zero)).set("removed_by_zero", judged.removed_by_zero);
  locked.set("removed", judged.removed).set("removed_low", judged.removed_low);
  locked.set("removed_high", judged.removed_high).set("explainable_chi2", judged.explainable);
  Json regions = Json::array();
  for (const JudgedRegion& region : judged.regions) regions.push(toJson(region));
  locked.set("regions", std::move(regions));
  locked.set("cells", judged.cells).set("noise_chi2_per_row", judged.noise).set("gained_chi2", judged.gained);
  return locked;
}

Json toJson(const FoundEffect& one) {
  Json json = Json::object(), numbers = Json::array();
  json.set("name", one.found.name);
  json.set("kind", one.found.is_catalogue ? "catalogue" : isOfPoses(one.found.covariates) ? "poses" : "undeclared");
  Json alike = Json::array();
  for (const Stage stage : one.found.stages_alike) alike.push(std::string{discover::nameOf(stage)});
  json.set("stage", one.found.stage ? std::string{discover::nameOf(*one.found.stage)} : "not told");
  json.set("or_stage", std::move(alike)).set("covariates", Json::arrayOf(one.found.covariates));
  json.set("is_rest", one.found.is_rest);
  json.set("p", one.found.p)
      .set("gain", one.found.gain.mean)
      .set("gain_error", one.found.gain.error);
  json.set("frequency", one.found.frequency).set("in_model", one.fitted.has_value());
  for (const FittedNumber& number : numbersIn(one)) {
    Json each = Json::object();
    each.set("key", number.key).set("value", number.value).set("error", number.error);
    numbers.push(std::move(each));
  }
  json.set("numbers", std::move(numbers));
  Json others = Json::array();
  for (const Alternative& other : one.found.alternatives) others.push(other.name);
  json.set("or", std::move(others)).set("refused", Json::arrayOf(one.found.refused));
  if (one.raw) {
    Json raw = Json::object();
    if (const auto& share = one.raw->share)
      raw.set("share_before_decoding", share->mean).set("share_error", share->error);
    raw.set("contradiction_sd", one.raw->contradiction);
    json.set("raw_exposures", std::move(raw));
  }
  if (one.next) json.set("next_experiment", adviceOf(*one.next)).set("next_experiment_chi2", one.next->chi2);
  return json;
}

}  // namespace

std::string stageInWords(const Effect& effect) {
  if (isOfPoses(effect.covariates)) return "poses";
  if (!effect.stage) return "not told";
  std::string words{discover::nameOf(*effect.stage)};
  for (const Stage stage : effect.stages_alike) words += fmt::format(" or {}", discover::nameOf(stage));
  return words;
}

std::vector<FittedNumber> numbersIn(const FoundEffect& one) {
  std::vector<FittedNumber> numbers = one.fitted ? one.fitted->numbers : std::vector<FittedNumber>{};
  for (const FittedEffect& more : one.more) numbers.insert(numbers.end(), more.numbers.begin(), more.numbers.end());
  return numbers;
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(now));
}

std::string adviceOf(const NextCapture& next) {
  return fmt::format("take capture \"{}\" again{}; there {} would differ by {:.3g} in χ², in those that were taken by "
                     "{:.3g} at most",
                     next.like, next.change.empty() ? "" : " " + next.change, next.other, next.chi2, next.taken_chi2);
}

Json jsonOf(const CampaignJob& job, const CampaignFinding& finding) {
  Json data = Json::object(), effects = Json::array(), updates = Json::array();
  data.set("verdict", verdictOf(finding)).set("run", job.run.string()).set("model", job.model);
  data.set("captures", finding.captures)
      .set("frames", finding.frames)
      .set("locked", finding.locked);
  data.set("p", finding.finding.first_p).set("p_left", finding.finding.last_p);
  if (finding.alike_p) data.set("p_frames_alike", *finding.alike_p);
  if (finding.steps_p) data.set("p_no_steps", *finding.steps_p);
  data.set("offset_mm", finding.zero.offset_mm).set("offset_error_mm", finding.zero.offset_error_mm);
  data.set("delay_of_light_mm", finding.zero.delay_mm);
  data.set("scales", Json::arrayOf(finding.finding.scales)).set("chi2_per_row", finding.dispersion);
  for (const FoundEffect& one : finding.effects) effects.push(toJson(one));
  for (const FittedEffect& one : finding.updates) updates.push(nameOf(one.effect));
  if (!finding.off.empty()) data.set("off_their_poses", toJson(finding.off));
  data.set("effects", std::move(effects)).set("parameter_updates", std::move(updates));
  if (const auto& judged = finding.judgement) {
    Json locked = toJson(*judged);
    if (!finding.locked_off.empty()) locked.set("off_their_poses", toJson(finding.locked_off));
    if (finding.without_off) locked.set("without_these", toJson(*finding.without_off));
    data.set("locked_captures", std::move(locked));
    data.set("ladder", loop::ladderJson(ladderOf(*judged, hasDelay(finding))));
  }
  data.set("notes", Json::arrayOf(finding.notes)).set("seconds", finding.seconds);
  return data.set("software", "toftwin " TOFTWIN_VERSION)
      .set("date", today())
      .set("note", job.note);
}

}  // namespace toftwin::discover
