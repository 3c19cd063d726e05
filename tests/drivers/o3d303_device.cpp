// SPDX-License-Identifier: Apache-2.0
#include "o3d303_device.h"

#include <utility>

namespace toftwin::test {
namespace {

using o3d303::XmlRpcAnswer;
using o3d303::XmlRpcCall;
using o3d303::XmlRpcFault;
using o3d303::XmlRpcValue;

constexpr std::string_view kMain = "/api/rpc/v1/com.ifm.efector/";
const XmlRpcAnswer kNothing = XmlRpcValue{""};

XmlRpcValue structOf(const O3d303Device::Parameters& all) {
  XmlRpcValue::Struct members;
  for (const auto& [name, value] : all) members.emplace_back(name, XmlRpcValue{value});
  return members;
}

std::string param(const XmlRpcCall& call, std::size_t index) {
  return index < call.params.size() ? call.params[index].text() : std::string{};
}

XmlRpcAnswer unknownMethod(const XmlRpcCall& call) {
  return XmlRpcFault{100'001, "no method " + call.method};
}

}  // namespace

O3d303Device::O3d303Device() { reset(); }

void O3d303Device::reset() {
  device = {{"ActiveApplication", "1"},
            {"ArticleNumber", "O3D303"},
            {"DeviceType", "1:2"},
            {"Name", "emulated"},
            {"PcicTcpPort", "50010"},
            {"PcicProtocolVersion", "3"},
            {"OperatingMode", "0"},
            {"SessionTimeout", "30"},
            {"TemperatureFront1", "3276.7"},
            {"TemperatureFront2", "3276.7"},
            {"TemperatureIMX6", "24.5"},
            {"TemperatureIllu", "28.6"},
            {"UpTime", "0.5"}};
  active_ = {.application = {{"Name", "Sample"}, {"TriggerMode", "1"}, {"Type", "Camera"}},
             .imager = {{"Type", "under5m_low"},
                        {"ExposureTime", "1000"},
                        {"FrameRate", "20"},
                        {"Channel", "0"},
                        {"MinimumAmplitude", "42"},
                        {"SymmetryThreshold", "0.4"}}};
  restart();
}

void O3d303Device::restart() {
  session_.reset();
  is_editing_ = has_application_ = false;
}

XmlRpcAnswer O3d303Device::answer(std::string_view path, const XmlRpcCall& call) {
  if (!path.starts_with(kMain)) return XmlRpcFault{100'002, "no such object"};
  const std::string_view object = path.substr(kMain.size());
  if (object.empty()) return main(call);
  const std::string prefix = "session_" + session_.value_or("") + "/";
  if (!session_ || !object.starts_with(prefix)) return XmlRpcFault{100'000, "no such session"};
  return inSession(object.substr(prefix.size()), call);
}

XmlRpcAnswer O3d303Device::main(const XmlRpcCall& call) {
  if (call.method == "getParameter" || call.method == "getAllParameters")
    return parameters(device, call);
  if (call.method == "getHWInfo") {
    return XmlRpcValue{XmlRpcValue::Struct{{"MACAddress", "00:02:01:40:7D:96"}}};
  }
  if (call.method == "getSWVersion") {
    return XmlRpcValue{XmlRpcValue::Struct{{"IFM_Software", "1.23.1522"}}};
  }
  if (call.method == "requestSession") {
    if (session_) return XmlRpcFault{101'004, "Session already exists"};
    session_ = param(call, 1);
    ++sessions_;
    return XmlRpcValue{*session_};
  }
  return unknownMethod(call);
}

XmlRpcAnswer O3d303Device::inSession(std::string_view object, const XmlRpcCall& call) {
  if (object.empty()) return session(call);
  if (!is_editing_) return XmlRpcFault{101'002, "not in edit mode"};
  if (object == "edit/") return edit(call);
  if (!has_application_) return XmlRpcFault{101'016, "no application in edit mode"};
  if (object == "edit/application/") return application(call);
  if (object == "edit/application/imager_001/") return parameters(edited_.imager, call);
  return XmlRpcFault{100'002, "no such object"};
}

XmlRpcAnswer O3d303Device::session(const XmlRpcCall& call) {
  if (call.method == "setOperatingMode") {
    is_editing_ = param(call, 0) == "1";
    if (!is_editing_) has_application_ = false;
    return kNothing;
  }
  if (call.method == "heartbeat") return XmlRpcValue{300};
  if (call.method == "cancelSession") return restart(), kNothing;
  return unknownMethod(call);
}

XmlRpcAnswer O3d303Device::edit(const XmlRpcCall& call) {
  if (call.method == "editApplication") {
    if (param(call, 0) != "1") return XmlRpcFault{101'013, "no such application"};
    has_application_ = true;
    edited_ = active_;
    return kNothing;
  }
  if (call.method == "stopEditingApplication") return has_application_ = false, kNothing;
  return unknownMethod(call);
}

XmlRpcAnswer O3d303Device::application(const XmlRpcCall& call) {
  if (call.method != "save") return parameters(edited_.application, call);
  active_ = edited_;
  ++saves_;
  return kNothing;
}

XmlRpcAnswer O3d303Device::parameters(Parameters& all, const XmlRpcCall& call) {
  if (call.method == "getAllParameters") return structOf(all);
  const auto found = all.find(param(call, 0));
  if (found == all.end()) return XmlRpcFault{101'000, "unknown parameter"};
  if (call.method == "getParameter") return XmlRpcValue{found->second};
  if (call.method != "setParameter") return unknownMethod(call);
  found->second = param(call, 1);
  return kNothing;
}

}  // namespace toftwin::test
