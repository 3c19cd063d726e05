// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "daemon/facades/o3d303/device.h"
#include "o3d303_operable.h"

namespace toftwin::daemon::o3d303 {

using toftwin::o3d303::XmlRpcAnswer;
using toftwin::o3d303::XmlRpcFault;
using toftwin::o3d303::XmlRpcValue;

/// A camera whose source takes whatever lies within its bounds.
class O3d303Configuration : public testing::Test {
 protected:
  using Params = std::vector<XmlRpcValue>;
  static constexpr const char* kSession = "0123456789abcdef0123456789abcdef";
  static constexpr const char* kApplication = "edit/application/";
  static constexpr const char* kImager = "edit/application/imager_001/";
  static constexpr const char* kSpatial = "edit/application/imager_001/spatialfilter";
  static constexpr const char* kTemporal = "edit/application/imager_001/temporalfilter";

  O3d303Configuration() { device_.update(facts_); }

  double& source(std::string_view name) {
    return *std::ranges::find(facts_.parameters, name, &Parameter::name)->value;
  }
  XmlRpcAnswer ask(const std::string& object, const std::string& method, Params params) {
    const bool is_main = object == "/";
    const std::string path = std::string{"/api/rpc/v1/com.ifm.efector/"} +
                             (is_main ? "" : fmt::format("session_{}/{}", kSession, object));
    auto outcome = device_.answer(path, {method, std::move(params)}, now_);
    for (const auto& [name, value] : outcome.changes) {
      const auto of = std::ranges::find(facts_.parameters, name, &Parameter::name);
      if (of == facts_.parameters.end() || !of->bounds.contains(value)) {
        ADD_FAILURE() << name << " = " << value << " is nothing that the source takes";
        continue;
      }
      of->value = value;
    }
    facts_.frame_rate_hz = source("frame_rate_hz");
    facts_.can_trigger = source("triggered") == 1.0;
    device_.update(facts_);
    return outcome.answer;
  }
  XmlRpcValue call(const std::string& object, const std::string& method, Params params = {}) {
    const auto answer = ask(object, method, std::move(params));
    if (const auto* fault = std::get_if<XmlRpcFault>(&answer)) {
      ADD_FAILURE() << object << " " << method << ": " << fault->code << " " << fault->text;
      return {};
    }
    return std::get<XmlRpcValue>(answer);
  }
  int faultOf(const std::string& object, const std::string& method, Params params = {}) {
    const auto answer = ask(object, method, std::move(params));
    const auto* fault = std::get_if<XmlRpcFault>(&answer);
    return fault == nullptr ? 0 : fault->code;
  }
  void begin() { call("/", "requestSession", {"", kSession}); }
  void edit() {
    begin();
    call("", "setOperatingMode", {1});
  }
  void editApplication(int index = 1) {
    edit();
    call("edit/", "editApplication", {index});
  }
  void end() { call("", "cancelSession"); }
  /// Sets it in the application, saves, and ends the session.
  void set(const std::string& object, const std::string& name, const std::string& value) {
    editApplication();
    call(object, "setParameter", {name, value});
    call(kApplication, "save");
    end();
  }
  Parameters all(const std::string& object) {
    Parameters texts;
    const auto value = call(object, "getAllParameters");
    if (const auto* members = std::get_if<XmlRpcValue::Struct>(&value.value)) {
      for (const auto& [name, one] : *members) texts[name] = one.text();
    }
    return texts;
  }
  /// Of an object of application 1, in a session of its own.
  Parameters dump(const std::string& object) {
    editApplication();
    Parameters texts = all(object);
    end();
    return texts;
  }
  std::vector<int> applicationIndices() {
    std::vector<int> indices;
    const auto list = call("/", "getApplicationList");
    for (const auto& one : std::get<XmlRpcValue::Array>(list.value))
      indices.push_back(std::stoi(one.textAt("Index")));
    return indices;
  }

  Device device_{{.name = "test", .password = "", .mac = "02:00:00:00:00:01", .address = "127.0.0.1"}};
  SourceFacts facts_ = operableFacts({0.001, 1000.0});
  SteadyTime now_{};
};

}  // namespace toftwin::daemon::o3d303
