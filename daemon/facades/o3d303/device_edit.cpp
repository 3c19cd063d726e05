// SPDX-License-Identifier: Apache-2.0
// What a client does in edit mode.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "daemon/facades/o3d303/answers.h"
#include "daemon/facades/o3d303/commands.h"
#include "daemon/facades/o3d303/defaults.h"
#include "daemon/facades/o3d303/device.h"

namespace toftwin::daemon::o3d303 {
namespace {

using toftwin::o3d303::XmlRpcAnswer;
using toftwin::o3d303::XmlRpcCall;
using toftwin::o3d303::XmlRpcValue;

constexpr int kMostApplications = 32;
constexpr std::size_t kLongestText = 500;

bool isFreeText(const std::string& name) { return name == "Name" || name == "Description"; }

XmlRpcAnswer readOnly(const std::string& name) {
  return fault(Fault::kReadOnly,
               name + " cannot be changed: the source behind this camera has nothing like it");
}

XmlRpcAnswer noSuchParameter(const std::string& name) {
  return fault(Fault::kNoSuchParameter, "there is no parameter " + name);
}

}  // namespace

Device::Outcome Device::onEdit(const XmlRpcCall& call) {
  const auto index = numberIn(paramText(call, 0));
  const bool is_known = index && applications_.contains(*index);
  if (call.method == "availableApplicationTypes") {
    return {XmlRpcValue{XmlRpcValue::Array{XmlRpcValue{"Camera"}}}};
  }
  if (call.method == "stopEditingApplication") return edited_.reset(), Outcome{nothing()};
  if (call.method == "factoryReset") {
    applications_.clear();
    edited_.reset();
    const Parameters now = std::exchange(device_, defaultDevice());
    for (const char* kept :
         {"PcicTcpPort", "OperatingMode", "TemperatureIllu", "UpTime", "ImageTimestampReference"}) {
      device_[kept] = now.at(kept);
    }
    device_["Name"] = identity_.name;
    password_ = identity_.password;
    device_["PasswordActivated"] = password_.empty() ? "false" : "true";
    edited_device_ = device_;
    createApplication(1);
    return {nothing()};
  }
  if (call.method == "createApplication") {
    if (paramText(call, 0) != "Camera")
      return {fault(Fault::kWrongApplicationType, "the only type is Camera")};
    if (applications_.size() >= kMostApplications)
      return {fault(Fault::kTooManyApplications, "there are too many")};
    const int made = freeIndex();
    createApplication(made);
    return {XmlRpcValue{made}};
  }
  if (call.method == "editApplication") {
    if (!is_known) return {fault(Fault::kNoSuchApplication, "there is no such application")};
    if (edited_) return {fault(Fault::kApplicationInEdit, "an application is being edited already")};
    edited_.emplace(*index, applications_.at(*index));
    return {nothing()};
  }
  if (call.method == "copyApplication") {
    if (!is_known) return {fault(Fault::kNoSuchApplication, "there is no such application")};
    if (applications_.size() >= kMostApplications)
      return {fault(Fault::kTooManyApplications, "there are too many")};
    const int made = freeIndex();
    applications_[made] = applications_.at(*index);
    return {XmlRpcValue{made}};
  }
  if (call.method == "deleteApplication") {
    if (!is_known) return {fault(Fault::kNoSuchApplication, "there is no such application")};
    const bool is_edited = edited_ && edited_->first == *index;
    if (is_edited || *index == activeApplication()) {
      return {fault(Fault::kApplicationInEdit, "that application is in use")};
    }
    applications_.erase(*index);
    return {nothing()};
  }
  return {noSuchMethod(call)};
}

int Device::freeIndex() const {
  int index = 1;
  while (applications_.contains(index)) ++index;
  return index;
}

// ---- the device ----------------------------------------------------------------------------------

Device::Outcome Device::onDeviceParameters(const XmlRpcCall& call) {
  if (call.method == "getParameter" || call.method == "getAllParameters") return {look(edited_device_, call)};
  if (call.method == "setParameter") {
    auto refused = setDeviceParameter(paramText(call, 0), paramText(call, 1));
    return {refused ? *std::move(refused) : nothing()};
  }
  if (call.method == "activatePassword") {
    password_ = paramText(call, 0);
    device_["PasswordActivated"] = edited_device_["PasswordActivated"] = password_.empty() ? "false" : "true";
    return {nothing()};
  }
  if (call.method == "disablePassword") {
    password_.clear();
    device_["PasswordActivated"] = edited_device_["PasswordActivated"] = "false";
    return {nothing()};
  }
  if (call.method == "save") return saveDevice();
  return {noSuchMethod(call)};
}

std::optional<XmlRpcAnswer> Device::setDeviceParameter(const std::string& name, const std::string& value) {
  const auto found = edited_device_.find(name);
  if (found == edited_device_.end()) return noSuchParameter(name);
  if (found->second == value) return std::nullopt;
  if (name == "ActiveApplication") {
    const auto index = numberIn(value);
    if (!index) return fault(Fault::kWrongType, "ActiveApplication is a number");
    if (!applications_.contains(*index))
      return fault(Fault::kNoSuchApplication, "there is no such application");
  } else if (name == "SessionTimeout") {
    const auto seconds = numberIn(value);
    if (!seconds) return fault(Fault::kWrongType, "SessionTimeout is a number of seconds");
    if (*seconds < 5 || *seconds > 300)
      return fault(Fault::kOutOfRange, "SessionTimeout is 5 to 300 seconds");
  } else if (name.starts_with("ExtrinsicCalibTrans")) {
    const auto mm = realIn(value);
    if (!mm) return fault(Fault::kWrongType, name + " is a number of millimetres");
    if (std::abs(*mm) > 10'000.0) return fault(Fault::kOutOfRange, name + " is within 10000 mm");
  } else if (!isFreeText(name)) {
    return readOnly(name);
  } else if (value.size() > kLongestText) {
    return fault(Fault::kOutOfRange, name + " is too long");
  }
  found->second = value;
  return std::nullopt;
}

Device::Outcome Device::saveDevice() {
  const int before = activeApplication();
  Parameters saved = edited_device_;
  saved["ActiveApplication"] = device_["ActiveApplication"];
  for (const char* of_now : {"TemperatureIllu", "UpTime", "ImageTimestampReference", "OperatingMode"}) {
    saved[of_now] = device_.at(of_now);
  }
  const int wanted = numberIn(edited_device_.at("ActiveApplication")).value_or(before);
  device_ = std::move(saved);
  if (wanted == before) return {nothing()};
  if (!applications_.contains(wanted))
    return {fault(Fault::kNoSuchApplication, "there is no such application")};
  return activate(wanted);
}

Device::Outcome Device::activate(int index) {
  Outcome outcome{.answer = nothing(), .changes = changesTo(applications_.at(index)), .has_saved = true};
  device_["ActiveApplication"] = std::to_string(index);
  refreshSchema();
  return outcome;
}

Device::Outcome Device::onNetwork(const XmlRpcCall& call) {
  Parameters all = defaultNetwork();
  all["MACAddress"] = identity_.mac;
  all["StaticIPv4Address"] = identity_.address;
  if (call.method == "setParameter") {
    const auto found = all.find(paramText(call, 0));
    if (found == all.end()) return {noSuchParameter(paramText(call, 0))};
    return {found->second == paramText(call, 1) ? nothing() : readOnly(found->first)};
  }
  if (call.method == "saveAndActivateConfig") return cancelSession();
  return {look(all, call)};
}

Device::Outcome Device::onTime(const XmlRpcCall& call) const {
  Parameters all = defaultTime();
  all["CurrentTime"] = std::to_string(facts_.device_s);
  if (call.method == "setParameter") {
    const auto found = all.find(paramText(call, 0));
    if (found == all.end()) return {noSuchParameter(paramText(call, 0))};
    return {found->second == paramText(call, 1) ? nothing() : readOnly(found->first)};
  }
  if (call.method == "setCurrentTime") return {readOnly("the clock")};
  if (call.method == "saveAndActivateConfig") return {nothing()};
  return {look(all, call)};
}

// ---- the application and its imager --------------------------------------------------------------

Device::Outcome Device::onApplication(const XmlRpcCall& call) {
  if (call.method == "save") return saveApplication();
  if (call.method != "setParameter") return {look(edited_->second.application, call)};
  auto refused = setApplicationParameter(paramText(call, 0), paramText(call, 1));
  return {refused ? *std::move(refused) : nothing()};
}

std::optional<XmlRpcAnswer> Device::setApplicationParameter(const std::string& name,
                                                            const std::string& value) {
  Parameters& all = edited_->second.application;
  const auto found = all.find(name);
  if (found == all.end()) return noSuchParameter(name);
  if (found->second == value) return std::nullopt;
  if (name == "TriggerMode") {
    if (!numberIn(value)) return fault(Fault::kWrongType, "TriggerMode is a number");
    if (value != "1" && value != "2")
      return fault(Fault::kOutOfRange, "there is no wire to trigger by: 1 or 2");
    if (parameterOf(kTriggered) == nullptr) return readOnly(name);
  } else if (name == "PcicTcpResultSchema") {
    const auto schema = toftwin::o3d303::readSchema(value);
    if (!schema || !isServed(*schema))
      return fault(Fault::kWrongFormat, "frames cannot be made after that schema");
  } else if (!isFreeText(name)) {
    return readOnly(name);
  } else if (value.size() > kLongestText) {
    return fault(Fault::kOutOfRange, name + " is too long");
  }
  found->second = value;
  return std::nullopt;
}

Device::Outcome Device::saveApplication() {
  const auto& [index, wanted] = *edited_;
  const bool is_active = index == activeApplication();
  Outcome outcome{.answer = nothing(),
                  .changes = is_active ? changesTo(wanted) : SourceChanges{},
                  .has_saved = is_active};
  applications_[index] = wanted;
  refreshSchema();
  return outcome;
}

Device::Outcome Device::onImager(const XmlRpcCall& call) {
  Parameters& all = edited_->second.imager;
  if (call.method == "availableTypes") {
    return {XmlRpcValue{XmlRpcValue::Array{XmlRpcValue{all.at("Type")}}}};
  }
  const bool is_type = call.method == "changeType";
  if (!is_type && call.method != "setParameter") return {look(all, call)};
  auto refused =
      setImagerParameter(all, is_type ? "Type" : paramText(call, 0), paramText(call, is_type ? 0 : 1));
  return {refused ? *std::move(refused) : nothing()};
}

std::optional<XmlRpcAnswer> Device::setImagerParameter(Parameters& imager, const std::string& name,
                                                       const std::string& value) {
  const auto found = imager.find(name);
  if (found == imager.end()) return noSuchParameter(name);
  if (found->second == value) return std::nullopt;
  if (name == "Type") {
    return fault(Fault::kWrongImagerType, "the source's frequencies and exposures are " + found->second);
  }
  const auto binding = std::ranges::find(imagerBindings(), std::string_view{name}, &Binding::name);
  if (binding == imagerBindings().end()) return readOnly(name);
  if (auto refused = checkBound(binding->source_name, value, binding->is_integral)) return refused;
  found->second = value;
  return std::nullopt;
}

std::optional<XmlRpcAnswer> Device::checkBound(std::string_view source_name, const std::string& value,
                                               bool is_integral) const {
  const Parameter* parameter = parameterOf(source_name);
  if (parameter == nullptr) return readOnly(std::string{source_name});
  const auto number = realIn(value);
  if (!number || (is_integral && *number != std::floor(*number))) {
    return fault(Fault::kWrongType,
                 fmt::format("\"{}\" is not {} number", value, is_integral ? "a whole" : "a"));
  }
  if (parameter->bounds.contains(*number)) return std::nullopt;
  return fault(Fault::kOutOfRange, fmt::format("{} is out of range: {} to {} is possible", value,
                                               parameter->bounds.min, parameter->bounds.max));
}

void Device::refreshSchema() {
  const auto active = applications_.find(activeApplication());
  if (active == applications_.end()) return;
  if (auto schema = toftwin::o3d303::readSchema(active->second.application.at("PcicTcpResultSchema"))) {
    default_schema_ = *std::move(schema);
  }
}

}  // namespace toftwin::daemon::o3d303
