// SPDX-License-Identifier: Apache-2.0
// What a client does in edit mode with the list of applications and with the device itself.
#include <boost/asio/ip/address_v4.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "daemon/facades/o3d303/answers.h"
#include "daemon/facades/o3d303/schemas.h"
#include "daemon/facades/o3d303/device.h"

namespace toftwin::daemon::o3d303 {

using toftwin::o3d303::XmlRpcAnswer;
using toftwin::o3d303::XmlRpcCall;
using toftwin::o3d303::XmlRpcValue;

namespace {

bool isAddress(const std::string& text) {
  boost::system::error_code is_none;
  boost::asio::ip::make_address_v4(text, is_none);
  return !is_none;
}

}  // namespace

Device::Application Device::freshApplication() const {
  if (factory_) return *factory_;
  Application fresh{initialOf(applicationRules()), initialOf(imagerRules()), initialOf(spatialFilterRules()),
                    initialOf(temporalFilterRules())};
  fitExposures(fresh);
  return fresh;
}

int Device::createApplication(Application made) {
  int index = 1;
  while (applications_.contains(index)) ++index;
  applications_[index] = std::move(made);
  return index;
}

Device::Outcome Device::onEdit(const XmlRpcCall& call) {
  if (call.method == "availableApplicationTypes") {
    return {XmlRpcValue{XmlRpcValue::Array{XmlRpcValue{"Camera"}}}};
  }
  if (call.method == "stopEditingApplication") return edited_.reset(), Outcome{nothing()};
  if (call.method == "factoryReset") return factoryReset();
  if (call.method == "createApplication") {
    if (!call.params.empty() && paramText(call, 0) != "Camera")
      return {fault(Fault::kWrongApplicationType, "the only type is Camera")};
    return addApplication(call);
  }
  if (call.method == "changeNameAndDescription") return nameApplication(call);
  const bool has_index = call.method == "editApplication" || call.method == "copyApplication" ||
                         call.method == "deleteApplication";
  if (!has_index) return {noSuchMethod(call)};
  const auto index = numberIn(paramText(call, 0));
  if (!index || !applications_.contains(*index))
    return {fault(Fault::kNoSuchApplication, "there is no such application")};
  if (call.method == "copyApplication") return addApplication(call);
  if (call.method == "deleteApplication") return deleteApplication(*index);
  if (edited_) return {fault(Fault::kApplicationInEdit, "an application is being edited already")};
  edited_.emplace(*index, applications_.at(*index));
  return {nothing()};
}

Device::Outcome Device::addApplication(const XmlRpcCall& call) {
  if (std::ssize(applications_) >= kMostApplications)
    return {fault(Fault::kTooManyApplications, fmt::format("there are {} already", kMostApplications))};
  const bool is_copy = call.method == "copyApplication";
  const int made = createApplication(is_copy ? applications_.at(numberIn(paramText(call, 0)).value_or(0))
                                             : freshApplication());
  return {XmlRpcValue{made}};
}

/// At once, as the camera does it beside what is edited.
Device::Outcome Device::nameApplication(const XmlRpcCall& call) {
  const auto index = numberIn(paramText(call, 0));
  const auto found = index ? applications_.find(*index) : applications_.end();
  if (found == applications_.end()) return {fault(Fault::kNoSuchApplication, "there is no such application")};
  Application named = found->second;
  for (const auto& [name, value] :
       {std::pair{"Name", paramText(call, 1)}, {"Description", paramText(call, 2)}}) {
    if (auto refused = setApplicationParameter(named, name, value)) return {*std::move(refused)};
  }
  found->second = std::move(named);
  if (edited_ && edited_->first == *index) {
    for (const char* name : {"Name", "Description"})
      edited_->second.application[name] = found->second.application[name];
  }
  return {nothing()};
}

/// Without an active one the camera takes no frames until another is made active.
Device::Outcome Device::deleteApplication(int index) {
  if (edited_ && edited_->first == index)
    return {fault(Fault::kApplicationInEdit, "that application is being edited")};
  applications_.erase(index);
  if (index == activeApplication()) device_["ActiveApplication"] = edited_device_["ActiveApplication"] = "0";
  return {nothing()};
}

namespace {

/// What is measured, or as it is whatever is saved.
constexpr std::array<const char*, 6> kOfNow{"OperatingMode",   "TemperatureIllu", "TemperatureFront1",
                                            "TemperatureIMX6", "UpTime",          "ImageTimestampReference"};

}  // namespace

Device::Outcome Device::factoryReset() {
  edited_.reset();
  const Parameters now = std::exchange(device_, initialOf(deviceRules()));
  for (const char* of_now : kOfNow) device_[of_now] = now.at(of_now);
  device_["PcicTcpPort"] = now.at("PcicTcpPort");
  device_["Name"] = identity_.name;
  password_ = edited_password_ = identity_.password;
  device_["PasswordActivated"] = password_.empty() ? "false" : "true";
  edited_device_ = device_;
  network_ = initialOf(networkRules());
  network_["StaticIPv4Address"] = identity_.address;
  edited_network_ = network_;
  time_ = edited_time_ = initialOf(timeRules());
  clock_shift_s_ = 0;
  host_shift_ns_.reset();
  applications_.clear();
  const Application fresh = freshApplication();
  createApplication(fresh);
  refreshActive();
  return {.answer = nothing(), .changes = changesTo(fresh), .has_saved = true};
}

// ---- the device ----------------------------------------------------------------------------------

/// In edit mode what is set is seen before it is saved, by the main object, too.
Parameters Device::shownDevice() const {
  if (!is_editing_) return device_;
  Parameters all = edited_device_;
  for (const char* of_now : kOfNow) all[of_now] = device_.at(of_now);
  return all;
}

Device::Outcome Device::onDeviceParameters(const XmlRpcCall& call) {
  if (call.method == "getParameter" || call.method == "getAllParameters") return {look(shownDevice(), call)};
  if (call.method == "setParameter") {
    auto refused = setDeviceParameter(paramText(call, 0), paramText(call, 1));
    return {refused ? *std::move(refused) : nothing()};
  }
  if (call.method == "activatePassword" || call.method == "disablePassword") {
    edited_password_ = call.method == "activatePassword" ? paramText(call, 0) : std::string{};
    edited_device_["PasswordActivated"] = edited_password_.empty() ? "false" : "true";
    return {nothing()};
  }
  if (call.method == "save") return saveDevice();
  return {noSuchMethod(call)};
}

Device::Refusal Device::setDeviceParameter(const std::string& name, std::string value) {
  const Rule* rule = ruleOf(deviceRules(), name);
  if (rule == nullptr) return noSuchParameter(name);
  std::string& now = edited_device_.at(name);
  if (now == value) return std::nullopt;
  Refusal refused;
  if (rule->kind == Rule::Kind::Special) {
    const auto index = numberIn(value);
    if (!index) return fault(Fault::kWrongType, name + " is a number");
    if (!applications_.contains(*index))
      return fault(Fault::kNoSuchApplication, "there is no such application");
  } else {
    refused = check(*rule, value);
  }
  if (!refused) now = std::move(value);
  return refused;
}

Device::Outcome Device::saveDevice() {
  const int before = activeApplication();
  const int wanted = numberIn(edited_device_.at("ActiveApplication")).value_or(before);
  if (wanted != before && !applications_.contains(wanted))  // it was deleted since
    return {fault(Fault::kNoSuchApplication, "there is no such application")};
  Parameters saved = edited_device_;
  saved["ActiveApplication"] = device_["ActiveApplication"];
  for (const char* of_now : kOfNow) saved[of_now] = device_.at(of_now);
  device_ = std::move(saved);
  password_ = edited_password_;
  return wanted == before ? Outcome{nothing()} : activate(wanted);
}

Device::Outcome Device::activate(int index) {
  Outcome outcome{.answer = nothing(), .changes = changesTo(applications_.at(index)), .has_saved = true};
  device_["ActiveApplication"] = edited_device_["ActiveApplication"] = std::to_string(index);
  refreshActive();
  return outcome;
}

/// The parameter IOExternApplicationSwitch leaves the choice to the camera's wires.
std::optional<Device::Outcome> Device::select(int index) {
  const bool is_left_to_wires = device_.at("IOExternApplicationSwitch") != "0";
  if (is_editing_ || is_left_to_wires || !applications_.contains(index)) return std::nullopt;
  return index == activeApplication() ? Outcome{nothing()} : activate(index);
}

// ---- network and time ----------------------------------------------------------------------------

Parameters Device::shownNetwork() const {
  Parameters all = edited_network_;
  all["MACAddress"] = identity_.mac;
  return all;
}

/// They are kept and shown; where the facade listens is the configuration's to say.
Device::Outcome Device::onNetwork(const XmlRpcCall& call) {
  if (call.method == "setParameter") {
    auto refused = setNetworkParameter(paramText(call, 0), paramText(call, 1));
    return {refused ? *std::move(refused) : nothing()};
  }
  if (call.method == "saveAndActivateConfig") {
    network_ = edited_network_;
    return cancelSession();  // as the camera does: its address may be another now
  }
  return {look(shownNetwork(), call)};
}

Device::Refusal Device::setNetworkParameter(const std::string& name, std::string value) {
  const Rule* rule = ruleOf(networkRules(), name);
  if (rule == nullptr) return noSuchParameter(name);
  if (shownNetwork().at(name) == value) return std::nullopt;
  Refusal refused;
  if (rule->kind == Rule::Kind::Special) {
    if (!isAddress(value))
      refused = fault(Fault::kWrongNetwork, name + " is an IPv4 address, as 192.168.0.69");
  } else {
    refused = check(*rule, value);
  }
  if (!refused) edited_network_[name] = std::move(value);
  return refused;
}

Parameters Device::shownTime() const {
  Parameters all = edited_time_;
  all["CurrentTime"] = std::to_string(clockNow_s());
  return all;
}

Device::Outcome Device::onTime(const XmlRpcCall& call) {
  if (call.method == "setParameter") {
    auto refused = setTimeParameter(paramText(call, 0), paramText(call, 1));
    return {refused ? *std::move(refused) : nothing()};
  }
  if (call.method == "setCurrentTime") return setClock(call);
  if (call.method == "saveAndActivateConfig") {
    time_ = edited_time_;
    return {nothing()};
  }
  return {look(shownTime(), call)};
}

Device::Refusal Device::setTimeParameter(const std::string& name, std::string value) {
  const Rule* rule = ruleOf(timeRules(), name);
  if (rule == nullptr) return noSuchParameter(name);
  if (shownTime().at(name) == value) return std::nullopt;
  auto refused = check(*rule, value);
  if (!refused) edited_time_[name] = std::move(value);
  return refused;
}

Device::Outcome Device::setClock(const XmlRpcCall& call) {
  const auto seconds = numberIn(paramText(call, 0));
  if (!seconds)
    return {fault(Fault::kWrongType, "setCurrentTime wants a whole number of seconds since 1970")};
  if (*seconds < 0) return {fault(Fault::kOutOfRange, "the time is not before 1970")};
  clock_shift_s_ = *seconds - facts_.device_s;
  host_shift_ns_.reset();
  constexpr std::int64_t kPerSecond = 1'000'000'000;  // nanoseconds
  if (facts_.host_ns) host_shift_ns_ = *seconds * kPerSecond - *facts_.host_ns;
  return {nothing()};
}

}  // namespace toftwin::daemon::o3d303
