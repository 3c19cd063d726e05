// SPDX-License-Identifier: Apache-2.0
#include "calib/suit/suit_json.h"

namespace toftwin::suit {
namespace {

using compare::Json;

Json toJson(Kind kind, const Verdict& verdict) {
  const double scale = shownScale(kind);
  Json json = Json::object();
  json.set("value", verdict.estimate.value * scale).set("low", verdict.estimate.low * scale);
  json.set("high", verdict.estimate.high * scale).set("margin", verdict.margin * scale);
  json.set("unit", unitOf(kind)).set("met", verdict.is_met).set("certain", verdict.is_certain);
  return json;
}

Json toJson(const Case& use, const CameraResult& camera, std::size_t r) {
  const auto& requirement = use.spec.requirements[r];
  const auto& result = camera.requirements[r];
  Json json = toJson(requirement.kind, result.verdict);
  json.set("name", requirement.name)
      .set("kind", std::string{nameOf(requirement.kind)})
      .set("judged", result.is_judged);
  json.set("limit", limitOf(requirement) * shownScale(requirement.kind)).set("why_not", result.why_not);
  Json conditions = Json::array();
  for (const AtCondition& at : result.conditions) {
    conditions.push(toJson(requirement.kind, at.verdict)
                        .set("pose", use.spec.poses[at.pose].name)
                        .set("lighting", use.spec.lightings[at.lighting].name)
                        .set("pixels", at.pixels));
  }
  Json spoilers = Json::array();
  for (const Spoiler& one : camera.spoilers.empty() ? std::vector<Spoiler>{} : camera.spoilers[r]) {
    const double scale = shownScale(requirement.kind);
    spoilers.push(Json::object()
                      .set("left_out", one.what)
                      .set("gain", one.gain.value * scale)
                      .set("low", one.gain.low * scale)
                      .set("high", one.gain.high * scale)
                      .set("spoils", one.isSpoiling())
                      .set("valid_only_without", one.is_valid_only_without)
                      .set("met_without", one.is_met_without)
                      .set("certain_without", one.is_certain_without));
  }
  json.set("conditions", std::move(conditions)).set("spoilers", std::move(spoilers));
  return json;
}

}  // namespace

compare::Json toJson(const Suit& suit) {
  Json cameras = Json::array();
  for (const CameraResult& camera : suit.cameras) {
    Json json = Json::object();
    json.set("name", camera.name)
        .set("model", camera.model)
        .set("id", camera.id)
        .set("recording", camera.is_recording);
    json.set("cannot", camera.cannot)
        .set("fits", camera.isFit())
        .set("failed", camera.failed)
        .set("unknown", camera.unknown);
    json.set("worst_relative_margin", camera.worst);
    Json tries = Json::array();
    for (const Try& one : camera.tries)
      tries.push(Json::object()
                     .set("mode", one.mode)
                     .set("exposure_us", one.exposure_us)
                     .set("failed", one.failed)
                     .set("shortfall", one.shortfall)
                     .set("worst_relative_margin", one.worst));
    json.set("tries", std::move(tries)).set("best_try", camera.best);
    Json requirements = Json::array();
    for (std::size_t r = 0; r < camera.requirements.size(); ++r)
      requirements.push(toJson(suit.use, camera, r));
    cameras.push(std::move(json.set("requirements", std::move(requirements))));
  }
  return std::move(Json::object()
                       .set("use_case", suit.use.spec.title)
                       .set("scene_id", suit.scene_id)
                       .set("cameras", std::move(cameras)));
}

}  // namespace toftwin::suit
