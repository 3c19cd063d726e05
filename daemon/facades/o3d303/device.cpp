// SPDX-License-Identifier: Apache-2.0
// The objects that anybody may ask, and sessions; what is changed in edit mode is in device_edit.cpp.
#include "daemon/facades/o3d303/device.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <random>

#include "daemon/facades/o3d303/answers.h"
#include "daemon/facades/o3d303/defaults.h"

namespace toftwin::daemon::o3d303 {
namespace {

using toftwin::o3d303::XmlRpcCall;
using toftwin::o3d303::XmlRpcValue;

constexpr std::string_view kMain = "/api/rpc/v1/com.ifm.efector";
constexpr double kSecondsPerHour = 3600.0;
constexpr int kShortestTimeout_s = 5, kLongestTimeout_s = 300;

std::string anySessionId() {
  std::random_device random;
  std::string id;
  for (int i = 0; i < 4; ++i) id += fmt::format("{:08x}", random());
  return id;
}

/// What comes into the path of each later call.
bool isSessionId(std::string_view id) {
  return id.size() == 32 && id.find_first_not_of("0123456789abcdefABCDEF") == std::string_view::npos;
}

std::string typeOf(const SourceFacts& facts) {
  const int range = std::clamp(facts.frequencies, 1, 3);
  const auto exposures = std::clamp<std::size_t>(facts.exposures_us.size(), 1, 3);
  return fmt::format("{}_{}",
                     range == 1   ? "under5m"
                     : range == 2 ? "upto30m"
                                  : "morethan30m",
                     exposures == 1   ? "low"
                     : exposures == 2 ? "moderate"
                                      : "high");
}

}  // namespace

Device::Device(Identity identity) : identity_(std::move(identity)), password_(identity_.password) {
  device_ = defaultDevice();
  device_["Name"] = identity_.name;
  device_["PcicTcpPort"] = std::to_string(identity_.pcic_port);
  device_["PasswordActivated"] = password_.empty() ? "false" : "true";
  createApplication(1);
}

void Device::createApplication(int index) {
  Application fresh{defaultApplication(), defaultImager()};
  show(fresh);
  applications_[index] = std::move(fresh);
  refreshSchema();
}

Device::Outcome Device::answer(std::string_view path, const XmlRpcCall& call, SteadyTime now) {
  while (path.ends_with('/')) path.remove_suffix(1);
  if (path == kMain) return onMain(call, now);
  if (!path.starts_with(kMain) || path[kMain.size()] != '/')
    return {fault(Fault::kNoSuchObject, "no such object")};
  path.remove_prefix(kMain.size() + 1);
  const std::string mine = "session_" + (session_ ? session_->id : std::string{});
  if (!session_ || !path.starts_with(mine)) return {fault(Fault::kNoSuchObject, "no such session")};
  path.remove_prefix(mine.size());
  if (!path.empty() && path.front() != '/') return {fault(Fault::kNoSuchObject, "no such session")};
  session_->ends = now + session_->timeout;
  return inSession(path.substr(path.empty() ? 0 : 1), call, now);
}

Device::Outcome Device::onMain(const XmlRpcCall& call, SteadyTime now) {
  if (call.method == "getParameter" || call.method == "getAllParameters") return {look(device_, call)};
  if (call.method == "requestSession") return requestSession(call, now);
  if (call.method == "getSWVersion") {
    return {structOf({{"Algorithm_Version", "2.0.45"},
                      {"Calibration_Device", identity_.mac},
                      {"Calibration_Version", "0.9.0"},
                      {"Diagnostic_Controller", "1.0.69"},
                      {"ELDK", "toftwin " TOFTWIN_VERSION},
                      {"IFM_Software", "1.30.6153"},
                      {"Linux", "toftwin " TOFTWIN_VERSION},
                      {"Main_Application", "1.0.69"}})};
  }
  if (call.method == "getHWInfo") {
    return {structOf({{"Connector", "toftwin"},
                      {"Diagnose", "toftwin"},
                      {"Frontend", "toftwin"},
                      {"Illumination", "toftwin"},
                      {"MACAddress", identity_.mac},
                      {"Mainboard", "toftwin"},
                      {"MiraSerial", identity_.mac}})};
  }
  if (call.method == "getApplicationList") {
    XmlRpcValue::Array list;
    for (const auto& [index, one] : applications_) {
      list.push_back(XmlRpcValue::Struct{{"Index", index},
                                         {"Id", 10'000 + index},
                                         {"Name", one.application.at("Name")},
                                         {"Description", one.application.at("Description")}});
    }
    return {XmlRpcValue{std::move(list)}};
  }
  if (call.method == "getTraceLogs") return {XmlRpcValue{XmlRpcValue::Array{}}};
  if (call.method == "reboot") return {.answer = nothing(), .is_reboot = true};
  return {noSuchMethod(call)};
}

Device::Outcome Device::requestSession(const XmlRpcCall& call, SteadyTime now) {
  if (session_) return {fault(Fault::kSessionExists, "another client has a session; wait until it ends")};
  if (!password_.empty() && paramText(call, 0) != password_)
    return {fault(Fault::kWrongPassword, "wrong password")};
  std::string id = paramText(call, 1);
  if (id.empty()) id = anySessionId();
  if (!isSessionId(id)) return {fault(Fault::kWrongFormat, "a session id is 32 hexadecimal digits")};
  const std::chrono::seconds timeout{numberIn(device_.at("SessionTimeout")).value_or(kShortestTimeout_s)};
  session_ = Session{id, timeout, now + timeout, {}};
  return {XmlRpcValue{id}};
}

Device::Outcome Device::onSession(const XmlRpcCall& call, SteadyTime now) {
  if (call.method == "heartbeat") {
    const int wanted = numberIn(paramText(call, 0)).value_or(kShortestTimeout_s);
    const int granted = std::clamp(wanted, kShortestTimeout_s, kLongestTimeout_s);
    session_->timeout = std::chrono::seconds{granted};
    session_->ends = now + session_->timeout;
    return {XmlRpcValue{granted}};
  }
  if (call.method == "cancelSession") return cancelSession();
  if (call.method == "setOperatingMode") return setMode(call);
  if (call.method == "setTemporaryApplicationParameters") return setTemporarily(call);
  return {noSuchMethod(call)};
}

Device::Outcome Device::inSession(std::string_view object, const XmlRpcCall& call, SteadyTime now) {
  if (object.empty()) return onSession(call, now);
  if (!is_editing_) return {fault(Fault::kNoSuchObject, "the camera is not in edit mode")};
  if (object == "edit") return onEdit(call);
  if (object == "edit/device") return onDeviceParameters(call);
  if (object == "edit/device/network") return onNetwork(call);
  if (object == "edit/device/time") return onTime(call);
  if (!object.starts_with("edit/application")) return {fault(Fault::kNoSuchObject, "no such object")};
  if (!edited_) return {fault(Fault::kNoApplicationInEdit, "no application is being edited")};
  if (object == "edit/application") return onApplication(call);
  if (object == "edit/application/imager_001") return onImager(call);
  if (object == "edit/application/imager_001/spatialfilter" ||
      object == "edit/application/imager_001/temporalfilter") {
    return {look({}, call)};  // both are off, and what is off has no parameters
  }
  return {fault(Fault::kNoSuchObject, "no such object")};
}

Device::Outcome Device::setMode(const XmlRpcCall& call) {
  const std::string mode = paramText(call, 0);
  if (mode != "0" && mode != "1") return {fault(Fault::kOutOfRange, "the mode is 0 (run) or 1 (edit)")};
  is_editing_ = mode == "1";
  device_["OperatingMode"] = mode;
  edited_.reset();
  edited_device_ = device_;
  return {nothing()};
}

/// What it set for itself is undone, what it did not save is forgotten.
Device::Outcome Device::cancelSession() {
  SourceChanges changes;
  if (session_ && !session_->before.empty()) {
    Application as_before = applications_.at(activeApplication());
    for (const auto& [name, value] : session_->before) as_before.imager[name] = value;
    changes = changesTo(as_before);
  }
  restart();
  return {.answer = nothing(), .changes = std::move(changes)};
}

void Device::restart() {
  session_.reset();
  is_editing_ = false;
  device_["OperatingMode"] = "0";
  edited_.reset();
}

SourceChanges Device::expire(SteadyTime now) {
  if (!session_ || now < session_->ends) return {};
  return cancelSession().changes;
}

Device::Outcome Device::setTemporarily(const XmlRpcCall& call) {
  const auto* wanted =
      call.params.empty() ? nullptr : std::get_if<XmlRpcValue::Struct>(&call.params[0].value);
  if (wanted == nullptr) return {fault(Fault::kWrongType, "a struct of parameters is wanted")};
  Application changed = applications_.at(activeApplication());
  Parameters before;
  for (const auto& [path, value] : *wanted) {
    constexpr std::string_view kImager = "imager_001/";
    if (!path.starts_with(kImager)) return {fault(Fault::kNoSuchParameter, "no parameter " + path)};
    const std::string name = path.substr(kImager.size());
    if (const auto found = changed.imager.find(name); found != changed.imager.end()) before.insert(*found);
    if (auto refused = setImagerParameter(changed.imager, name, value.text())) return {*std::move(refused)};
  }
  session_->before.merge(before);  // what was first is what is put back
  return {.answer = nothing(), .changes = changesTo(changed)};
}

// ---- what the source says ------------------------------------------------------------------------

void Device::update(const SourceFacts& facts) {
  facts_ = facts;
  device_["TemperatureIllu"] = facts.illumination_c ? fmt::format("{:.1f}", *facts.illumination_c) : "3276.7";
  device_["UpTime"] = fmt::format("{:.6f}", facts.since_power_on_s / kSecondsPerHour);
  device_["ImageTimestampReference"] = std::to_string(facts.device_s);
  show(applications_.at(activeApplication()));
}

void Device::show(Application& one) const {
  Parameters& imager = one.imager;
  if (facts_.frame_rate_hz) imager["FrameRate"] = fmt::format("{:g}", *facts_.frame_rate_hz);
  if (!facts_.exposures_us.empty()) {
    imager["ExposureTime"] = std::to_string(facts_.exposures_us.back());
    imager["ExposureTimeList"] = fmt::format("{}", fmt::join(facts_.exposures_us, ";"));
  }
  for (const Binding& binding : imagerBindings()) {
    const Parameter* parameter = parameterOf(binding.source_name);
    if (parameter == nullptr || !parameter->value) continue;
    imager[std::string{binding.name}] = binding.is_integral ? fmt::format("{:.0f}", *parameter->value)
                                                            : fmt::format("{:g}", *parameter->value);
  }
  one.application["TriggerMode"] = facts_.can_trigger ? "2" : "1";
  imager["Type"] = typeOf(facts_);
  imager["Resolution"] = facts_.width >= 352 ? "1" : "0";
  imager["ClippingRight"] = std::to_string(facts_.width - 1);
  imager["ClippingBottom"] = std::to_string(facts_.height - 1);
}

const Parameter* Device::parameterOf(std::string_view source_name) const {
  const auto found = std::ranges::find(facts_.parameters, source_name, &Parameter::name);
  return found == facts_.parameters.end() ? nullptr : &*found;
}

SourceChanges Device::changesTo(const Application& wanted) const {
  const Application& now = applications_.at(activeApplication());
  SourceChanges changes;
  for (const Binding& binding : imagerBindings()) {
    const std::string name{binding.name};
    const auto value = realIn(wanted.imager.at(name));
    if (parameterOf(binding.source_name) == nullptr || !value ||
        wanted.imager.at(name) == now.imager.at(name)) {
      continue;
    }
    changes.emplace_back(binding.source_name, *value);
  }
  if (parameterOf(kTriggered) != nullptr &&
      wanted.application.at("TriggerMode") != now.application.at("TriggerMode")) {
    changes.emplace_back(kTriggered, wanted.application.at("TriggerMode") == "2" ? 1.0 : 0.0);
  }
  return changes;
}

int Device::activeApplication() const { return numberIn(device_.at("ActiveApplication")).value_or(1); }

std::vector<int> Device::applications() const {
  std::vector<int> all;
  for (const auto& [index, one] : applications_) all.push_back(index);
  return all;
}

std::array<float, 3> Device::translation_mm() const {
  std::array<float, 3> t{};
  const char* names[] = {"ExtrinsicCalibTransX", "ExtrinsicCalibTransY", "ExtrinsicCalibTransZ"};
  for (std::size_t i = 0; i < t.size(); ++i)
    t[i] = static_cast<float>(realIn(device_.at(names[i])).value_or(0.0));
  return t;
}

}  // namespace toftwin::daemon::o3d303
