// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "daemon/facades/o3d303/device.h"

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

  O3d303Configuration() {
    facts_.parameters = {{"exposure_us", 1000.0, {1.0, 20'000.0}},
                         {"frame_rate_hz", 10.0, {0.001, 1000.0}},
                         {"triggered", 0.0, {0.0, 1.0}},
                         {"frequencies", 1.0, {1.0, 3.0}},
                         {"exposures", 1.0, {1.0, 3.0}},
                         {"exposure_ratio", 40.0, {2.0, 50.0}},
                         {"minimum_amplitude_electrons", 252.0, {0.0, 1e9}},
                         {"asymmetry_threshold", 0.4, {0.0, 1e9}},
                         {"spatial_filter", 0.0, {0.0, 3.0}},
                         {"spatial_filter_reach", 1.0, {1.0, 2.0}},
                         {"temporal_filter", 0.0, {0.0, 2.0}},
                         {"temporal_filter_images", 2.0, {2.0, 25.0}},
                         {"filters_range", 1.0, {0.0, 1.0}},
                         {"filters_amplitude", 1.0, {0.0, 1.0}}};
    facts_.frame_rate_hz = 10.0;
    facts_.exposures_us = {1000};
    device_.update(facts_);
  }

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
  SourceFacts facts_;
  SteadyTime now_{};
};

}  // namespace toftwin::daemon::o3d303
