// SPDX-License-Identifier: Apache-2.0
// The application that a client edits, its imager and its filters.
#include <fmt/format.h>

#include <algorithm>

#include "daemon/facades/o3d303/answers.h"
#include "daemon/facades/o3d303/schemas.h"
#include "daemon/facades/o3d303/device.h"

namespace toftwin::daemon::o3d303 {

using toftwin::o3d303::XmlRpcAnswer;
using toftwin::o3d303::XmlRpcCall;
using toftwin::o3d303::XmlRpcValue;

namespace {

std::span<const Rule> rulesOf(Binding::Object object) {
  switch (object) {
    case Binding::Object::SpatialFilter:
      return spatialFilterRules();
    case Binding::Object::TemporalFilter:
      return temporalFilterRules();
    case Binding::Object::Imager:
      break;
  }
  return imagerRules();
}

/// A mask is of the filters 1 to 3, a number of images of 1 alone.
bool hasParameters(const Parameters& imager, Binding::Object object) {
  if (object == Binding::Object::SpatialFilter) return imager.at("SpatialFilterType") != "0";
  return imager.at("TemporalFilterType") == "1";
}

std::optional<XmlRpcAnswer> checkTriggerMode(const std::string& value) {
  if (!numberIn(value)) return fault(Fault::kWrongType, "TriggerMode is a number");
  const int mode = numberIn(value).value_or(0);
  if (mode >= 1 && mode <= 5) return std::nullopt;
  return fault(
      Fault::kOutOfRange,
      "TriggerMode is 1 free run, 2 by command, or 3 to 5 by edges of the wire: rising, falling, both");
}

std::optional<XmlRpcAnswer> checkSchema(const std::string& value) {
  const auto schema = toftwin::o3d303::readSchema(value);
  if (schema && isServed(*schema)) return std::nullopt;
  return fault(Fault::kWrongFormat, "frames cannot be made after that schema");
}

}  // namespace

Device::Outcome Device::onApplication(const XmlRpcCall& call) {
  if (call.method == "save") return saveApplication();
  if (call.method != "setParameter") return {look(edited_->second.application, call)};
  auto refused = setApplicationParameter(edited_->second, paramText(call, 0), paramText(call, 1));
  return {refused ? *std::move(refused) : nothing()};
}

Device::Refusal Device::setApplicationParameter(Application& one, const std::string& name,
                                                std::string value) const {
  const Rule* rule = ruleOf(applicationRules(), name);
  if (rule == nullptr) return noSuchParameter(name);
  std::string& now = one.application.at(name);
  if (now == value) return std::nullopt;
  Refusal refused;
  if (name == "TriggerMode") {
    refused = checkTriggerMode(value);
    if (!refused && parameterOf(kTriggered) == nullptr) refused = readOnly(name);
  } else {
    refused = name == "PcicTcpResultSchema" ? checkSchema(value) : check(*rule, value);
  }
  if (!refused) now = std::move(value);
  return refused;
}

Device::Refusal Device::checkFilter(const Application& application) {
  if (application.imager.at("TemporalFilterType") == "0" || application.application.at("TriggerMode") == "1")
    return std::nullopt;
  return fault(Fault::kFilterAgainstTrigger, "a temporal filter needs free run (TriggerMode 1)");
}

Device::Outcome Device::saveApplication() {
  const auto& [index, wanted] = *edited_;
  if (auto refused = checkFilter(wanted)) return {*std::move(refused)};
  const bool is_active = index == activeApplication();
  Outcome outcome{.answer = nothing(),
                  .changes = is_active ? changesTo(wanted) : SourceChanges{},
                  .has_saved = is_active};
  applications_[index] = wanted;
  refreshActive();
  return outcome;
}

// ---- the imager ----------------------------------------------------------------------------------

Device::Outcome Device::onImager(const XmlRpcCall& call) {
  Application& one = edited_->second;
  if (call.method == "availableTypes") {
    XmlRpcValue::Array types;
    for (std::string& type : availableTypes()) types.emplace_back(std::move(type));
    return {XmlRpcValue{std::move(types)}};
  }
  if (call.method == "getAllParameterLimits")
    return {limitsOf(boundsOf(one.imager, Binding::Object::Imager, imagerRules()))};
  const bool is_type = call.method == "changeType";
  if (!is_type && call.method != "setParameter") return {look(one.imager, call)};
  auto refused = is_type ? setType(one, paramText(call, 0))
                         : setImagerParameter(one, paramText(call, 0), paramText(call, 1));
  return {refused ? *std::move(refused) : nothing()};
}

std::vector<std::string> Device::availableTypes() const {
  std::vector<std::string> all;
  const auto most = [&](std::string_view name) {
    const Parameter* parameter = parameterOf(name);
    return parameter == nullptr ? 0 : static_cast<int>(std::clamp(parameter->bounds.max, 0.0, 3.0));
  };
  const auto now = ImagerType::of(live_.imager.at("Type")).value_or(ImagerType{});
  const int frequencies = most(kFrequencies), exposures = most(kExposures);
  for (int f = 1; f <= 3; ++f) {
    for (int e = 1; e <= 3; ++e) {
      const bool has_frequencies = frequencies == 0 ? f == now.frequencies : f <= frequencies;
      const bool has_exposures = exposures == 0 ? e == now.exposures : e <= exposures;
      if (has_frequencies && has_exposures) all.push_back(ImagerType{f, e}.text());
    }
  }
  return all;
}

Device::Refusal Device::setType(Application& one, std::string_view text) const {
  const auto all = availableTypes();
  if (std::ranges::find(all, text) == all.end()) {
    return fault(Fault::kWrongImagerType,
                 fmt::format("\"{}\" is no type of this imager; there are: {}", text, fmt::join(all, ", ")));
  }
  one.imager["Type"] = text;
  fitExposures(one);
  return std::nullopt;
}

Device::Refusal Device::setImagerParameter(Application& one, const std::string& name,
                                           std::string value) const {
  const auto found = one.imager.find(name);
  if (found == one.imager.end()) return noSuchParameter(name);
  if (found->second == value) return std::nullopt;
  if (name == "Type") return setType(one, value);
  const Rule& rule = *ruleOf(imagerRules(), name);
  if (rule.kind == Rule::Kind::Source) {
    auto refused = setBound(one.imager, Binding::Object::Imager, rule, std::move(value));
    if (!refused) fitExposures(one);
    return refused;
  }
  if (rule.kind == Rule::Kind::Special) return setSpecial(one, name, std::move(value));
  auto refused = check(rule, value);
  if (!refused) found->second = std::move(value);
  return refused;
}

Device::Refusal Device::setSpecial(Application& one, const std::string& name, std::string value) const {
  if (name == "Resolution") return setResolution(one, value);
  Refusal refused;
  if (name == "ContinuousAutoExposure") {
    const Rule is_switch{name, "false", Rule::Kind::Switch};
    refused = check(is_switch, value);
    if (!refused && value == "true" && !boundOf(Binding::Object::Imager, "ExposureTime"))
      refused = fault(Fault::kNoAutoExposure, "the source behind this camera has no exposure time to choose");
  } else if (name == "ClippingCuboid") {
    Clipping read;
    if (!readCuboid(value, read))
      refused = fault(Fault::kWrongFormat, "ClippingCuboid is JSON with XMin to ZMax");
  } else if (name == "AutoExposureReferenceROI") {
    if (!readExposureRegion(value))
      refused = fault(Fault::kWrongFormat, "AutoExposureReferenceROI is JSON with ROIs, each a rectangle");
  } else {
    const bool is_column = name == "ClippingLeft" || name == "ClippingRight";
    const double last = (is_column ? one.width : one.height) - 1;
    refused = checkNumber(name, value, {0.0, last}, true);
  }
  if (!refused) one.imager.at(name) = std::move(value);
  return refused;
}

/// 0: half the rows and columns of a source that has those of resolution 1.
Device::Refusal Device::setResolution(Application& one, const std::string& value) const {
  if (!numberIn(value)) return fault(Fault::kWrongType, "Resolution is a number");
  const bool is_possible = value == "0" || (value == "1" && facts_.width >= kFineWidth);
  if (!is_possible) {
    return fault(Fault::kOutOfRange,
                 fmt::format("the source has {} x {} pixels: Resolution is 0{}", facts_.width, facts_.height,
                             facts_.width >= kFineWidth ? " or 1" : ""));
  }
  one.imager.at("Resolution") = value;
  one.has_resolution = true;
  showSize(one);
  return std::nullopt;
}

/// Where the source has nothing of the kind, the parameter stands as it is.
Device::Refusal Device::setBound(Parameters& all, Binding::Object object, const Rule& rule,
                                 std::string value) const {
  const auto bound = boundOf(object, rule.name);
  if (!bound) {
    return fault(
        Fault::kReadOnly,
        fmt::format("{} cannot be changed: the source behind this camera has nothing like it", rule.name));
  }
  std::string& now = all.at(std::string{rule.name});
  if (bound->binding->form == Binding::Form::Switch) {
    const Rule is_switch{rule.name, rule.initial, Rule::Kind::Switch};
    if (auto refused = check(is_switch, value)) return refused;
    now = std::move(value);
    return std::nullopt;
  }
  const bool is_whole = bound->binding->form == Binding::Form::Whole;
  if (auto refused = checkNumber(rule.name, value, rule.bounds, is_whole)) return refused;
  if (auto refused = checkNumber(rule.name, value, bound->bounds(), is_whole)) return refused;
  now = std::move(value);
  return std::nullopt;
}

std::map<std::string, Bounds> Device::boundsOf(const Parameters& all, Binding::Object object,
                                               std::span<const Rule> rules) const {
  std::map<std::string, Bounds> limits;
  for (const Rule& rule : rules) {
    const auto bound = boundOf(object, rule.name);
    if (!bound || bound->binding->form == Binding::Form::Switch || !all.contains(std::string{rule.name}))
      continue;
    const Bounds sources = bound->bounds();
    limits.emplace(rule.name,
                   Bounds{std::max(rule.bounds.min, sources.min), std::min(rule.bounds.max, sources.max)});
  }
  return limits;
}

// ---- its filters ---------------------------------------------------------------------------------

Device::Outcome Device::onFilter(const XmlRpcCall& call, Binding::Object object) {
  Application& one = edited_->second;
  const Parameters all = hasParameters(one.imager, object) ? of(one, object) : Parameters{};
  if (call.method == "getAllParameterLimits") return {limitsOf(boundsOf(all, object, rulesOf(object)))};
  if (call.method != "setParameter") return {look(all, call)};
  auto refused = setFilterParameter(one, object, paramText(call, 0), paramText(call, 1));
  return {refused ? *std::move(refused) : nothing()};
}

Device::Refusal Device::setFilterParameter(Application& one, Binding::Object object, const std::string& name,
                                           std::string value) const {
  const Rule* rule = ruleOf(rulesOf(object), name);
  if (rule == nullptr || !hasParameters(one.imager, object)) return noSuchParameter(name);
  return setBound(of(one, object), object, *rule, std::move(value));
}

}  // namespace toftwin::daemon::o3d303
