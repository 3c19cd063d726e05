// SPDX-License-Identifier: Apache-2.0
// The objects that anybody may ask, and sessions. The other device_*.cpp: what is changed in edit mode, what
// the source has, and what is exported.
#include "daemon/facades/o3d303/device.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <random>
#include <utility>

#include "daemon/facades/o3d303/answers.h"

namespace toftwin::daemon::o3d303 {
namespace {

using toftwin::o3d303::XmlRpcCall;
using toftwin::o3d303::XmlRpcValue;

constexpr std::string_view kMain = "/api/rpc/v1/com.ifm.efector";
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

}  // namespace

Device::Device(Identity identity)
    : identity_(std::move(identity)),
      device_(initialOf(deviceRules())),
      network_(initialOf(networkRules())),
      time_(initialOf(timeRules())),
      password_(identity_.password) {
  device_["Name"] = identity_.name;
  device_["PcicTcpPort"] = std::to_string(identity_.pcic_port);
  device_["PasswordActivated"] = password_.empty() ? "false" : "true";
  network_["StaticIPv4Address"] = identity_.address;
  live_ = freshApplication();
  createApplication(live_);
  refreshActive();
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
  if (call.method == "getParameter" || call.method == "getAllParameters") return {look(shownDevice(), call)};
  if (call.method == "requestSession") return requestSession(call, now);
  if (call.method == "getSWVersion") return {structOf(versions())};
  if (call.method == "getHWInfo") {
    return {structOf({{"Connector", "toftwin"},
                      {"Diagnose", "toftwin"},
                      {"Frontend", "toftwin"},
                      {"Illumination", "toftwin"},
                      {"MACAddress", identity_.mac},
                      {"Mainboard", "toftwin"},
                      {"MiraSerial", identity_.mac}})};
  }
  if (call.method == "getApplicationList") return {applicationList()};
  if (call.method == "getTraceLogs") return {XmlRpcValue{XmlRpcValue::Array{}}};
  if (call.method == "reboot") return reboot(call);
  return {noSuchMethod(call)};
}

Parameters Device::versions() const {
  return {{"Algorithm_Version", "2.0.45"},       {"Calibration_Device", identity_.mac},
          {"Calibration_Version", "0.9.0"},      {"Diagnostic_Controller", "1.0.69"},
          {"ELDK", "toftwin " TOFTWIN_VERSION},  {"IFM_Software", "1.30.6153"},
          {"Linux", "toftwin " TOFTWIN_VERSION}, {"Main_Application", "1.0.69"}};
}

XmlRpcValue Device::applicationList() const {
  XmlRpcValue::Array list;
  for (const auto& [index, one] : applications_) {
    list.push_back(XmlRpcValue::Struct{{"Index", index},
                                       {"Id", 10'000 + index},
                                       {"Name", one.application.at("Name")},
                                       {"Description", one.application.at("Description")}});
  }
  return XmlRpcValue{std::move(list)};
}

Device::Outcome Device::reboot(const XmlRpcCall& call) {
  constexpr int kProductive = 0, kRecovery = 1;
  const auto mode = numberIn(paramText(call, 0));
  if (!call.params.empty() && !mode) return {fault(Fault::kWrongType, "the mode of reboot is a number")};
  if (mode.value_or(kProductive) == kProductive) return {.answer = nothing(), .is_reboot = true};
  return {fault(Fault::kNoReboot, *mode == kRecovery ? "there is no firmware to recover; reboot with 0"
                                                     : "the mode of reboot is 0")};
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
  if (call.method == "heartbeat") return heartbeat(call, now);
  if (call.method == "cancelSession") return cancelSession();
  if (call.method == "setOperatingMode") return setMode(call);
  if (call.method == "setTemporaryApplicationParameters") return setTemporarily(call);
  if (call.method == "exportApplication") return exportApplication(call);
  if (call.method == "importApplication") return importApplication(call);
  if (call.method == "exportConfig") return exportConfiguration();
  if (call.method == "importConfig") return importConfiguration(call);
  return {noSuchMethod(call)};
}

Device::Outcome Device::heartbeat(const XmlRpcCall& call, SteadyTime now) {
  const auto wanted = numberIn(paramText(call, 0));
  if (!wanted) return {fault(Fault::kWrongType, "heartbeat wants a number of seconds")};
  const int granted = std::clamp(*wanted, kShortestTimeout_s, kLongestTimeout_s);
  session_->timeout = std::chrono::seconds{granted};
  session_->ends = now + session_->timeout;
  return {XmlRpcValue{granted}};
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
  if (object == "edit/application/imager_001/spatialfilter")
    return onFilter(call, Binding::Object::SpatialFilter);
  if (object == "edit/application/imager_001/temporalfilter")
    return onFilter(call, Binding::Object::TemporalFilter);
  return {fault(Fault::kNoSuchObject, "no such object")};
}

Device::Outcome Device::setMode(const XmlRpcCall& call) {
  const std::string mode = paramText(call, 0);
  if (mode != "0" && mode != "1") return {fault(Fault::kOutOfRange, "the mode is 0 (run) or 1 (edit)")};
  is_editing_ = mode == "1";
  device_["OperatingMode"] = mode;
  edited_.reset();
  edited_device_ = device_;
  edited_network_ = network_;
  edited_time_ = time_;
  edited_password_ = password_;
  if (!is_editing_) return {nothing()};
  return {.answer = nothing(), .changes = std::exchange(session_->before, {})};  // temporary is until here
}

/// What it set for itself is undone, what it did not save is forgotten.
Device::Outcome Device::cancelSession() { return {.answer = nothing(), .changes = restart()}; }

SourceChanges Device::restart() {
  SourceChanges undone = session_ ? std::move(session_->before) : SourceChanges{};
  session_.reset();
  is_editing_ = false;
  device_["OperatingMode"] = "0";
  edited_.reset();
  return undone;
}

SourceChanges Device::expire(SteadyTime now) {
  if (!session_ || now < session_->ends) return {};
  return cancelSession().changes;
}

/// What is out of range is taken to the nearest that is not, as the camera does here alone.
Device::Outcome Device::setTemporarily(const XmlRpcCall& call) {
  const auto* wanted =
      call.params.empty() ? nullptr : std::get_if<XmlRpcValue::Struct>(&call.params[0].value);
  if (wanted == nullptr) return {fault(Fault::kWrongType, "a struct of parameters is wanted")};
  if (is_editing_) return {fault(Fault::kApplicationInEdit, "nothing is set for a while in edit mode")};
  SourceChanges changes, before;
  Application wished = live_;
  for (const auto& [path, value] : *wanted) {
    constexpr std::string_view kImager = "imager_001/";
    if (!path.starts_with(kImager)) return {noSuchParameter(path)};
    const std::string name = path.substr(kImager.size());
    if (name != "ExposureTime" && name != "ExposureTimeRatio" && name != "Channel")
      return {noSuchParameter(name)};
    const auto number = numberIn(value.text());
    if (!number) return {fault(Fault::kWrongType, name + " is a whole number")};
    const auto bound = boundOf(Binding::Object::Imager, name);
    if (!bound || !bound->parameter->value) {
      if (live_.imager.contains(name) && live_.imager.at(name) == value.text()) continue;
      return {readOnly(name)};
    }
    const Bounds own = ruleOf(imagerRules(), name)->bounds, sources = bound->bounds();
    const double least = std::max(own.min, sources.min),
                 most = std::max(least, std::min(own.max, sources.max));
    const double clamped = std::clamp(static_cast<double>(*number), least, most);
    changes.emplace_back(bound->binding->source_name, bound->toSource(clamped));
    before.emplace_back(bound->binding->source_name, *bound->parameter->value);
    wished.imager[name] = fmt::format("{:.0f}", clamped);
  }
  // Exposures that take longer than the frames are apart slow the camera down.
  fitExposures(wished);
  const auto rate = boundOf(Binding::Object::Imager, "FrameRate");
  const auto slower = frameRateFor(wished);
  if (rate && rate->parameter->value && slower && *slower < *rate->parameter->value) {
    changes.emplace_back(rate->binding->source_name, *slower);
    before.emplace_back(rate->binding->source_name, *rate->parameter->value);
  }
  for (auto& one : before) {  // what was first is what is put back
    const auto is_same = [&](const auto& other) { return other.first == one.first; };
    if (std::ranges::none_of(session_->before, is_same)) session_->before.push_back(std::move(one));
  }
  return {.answer = nothing(), .changes = std::move(changes)};
}

int Device::activeApplication() const { return numberIn(device_.at("ActiveApplication")).value_or(0); }

std::vector<int> Device::applications() const {
  std::vector<int> all;
  for (const auto& [index, one] : applications_) all.push_back(index);
  return all;
}

toftwin::o3d303::ExtrinsicCalibration Device::extrinsics() const {
  toftwin::o3d303::ExtrinsicCalibration extrinsics{};
  std::size_t i = 0;
  for (const char* kind : {"Trans", "Rot"}) {
    for (const char axis : {'X', 'Y', 'Z'}) {
      const auto number = realIn(device_.at(fmt::format("ExtrinsicCalib{}{}", kind, axis)));
      extrinsics[i++] = static_cast<float>(number.value_or(0.0));
    }
  }
  return extrinsics;
}

}  // namespace toftwin::daemon::o3d303
