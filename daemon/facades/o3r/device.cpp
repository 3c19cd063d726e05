// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3r/device.h"

#include <fmt/format.h>

#include <algorithm>

namespace toftwin::daemon::o3r {
namespace {

using toftwin::o3d303::XmlRpcAnswer;
using toftwin::o3d303::XmlRpcFault;
using toftwin::o3d303::XmlRpcValue;

constexpr std::string_view kMain = "/api/rpc/v1/com.ifm.efector/",
                           kDiagnostic = "/api/rpc/v1/com.ifm.diagnostic/";
constexpr const char *kBox = "/device/crypto/sealedbox", *kKeys = "/device/network/authorized_keys";
constexpr std::size_t kMostPointers = 64, kLongestPassword = 256;

XmlRpcAnswer fault(int code, std::string text) { return XmlRpcFault{code, std::move(text)}; }
XmlRpcAnswer nothing() { return XmlRpcValue{""}; }
XmlRpcAnswer texted(const Result<Json>& json) {
  if (!json) return faultOf(json.error());
  return XmlRpcValue{textOf(*json)};
}

std::string textParam(const toftwin::o3d303::XmlRpcCall& call, std::size_t index) {
  return index < call.params.size() ? call.params[index].text() : std::string{};
}

/// A list of texts, or one text; none: all of it.
std::vector<std::string> pointersIn(const toftwin::o3d303::XmlRpcCall& call) {
  std::vector<std::string> pointers;
  if (call.params.empty()) return pointers;
  const auto* list = std::get_if<XmlRpcValue::Array>(&call.params.front().value);
  if (list == nullptr) return {call.params.front().text()};
  for (const XmlRpcValue& one : *list) {
    if (pointers.size() < kMostPointers) pointers.push_back(one.text());
  }
  return pointers;
}

}  // namespace

XmlRpcFault faultOf(const Error& error) {
  using Code = Error::Code;
  const int code = error.code == Code::NotFound                                    ? Fault::kNoSuchParameter
                   : error.code == Code::InvalidArgument                           ? Fault::kOutOfRange
                   : error.code == Code::Unsupported                               ? Fault::kReadOnly
                   : error.code == Code::PermissionDenied                          ? Fault::kWrongPassword
                   : error.code == Code::Malformed || error.code == Code::TooLarge ? Fault::kWrongFormat
                                                                                   : Fault::kInternal;
  return {code, error.message};
}

Device::Device(const Identity& identity, std::vector<PortIdentity> ports, double electrons_per_count)
    : ports_(std::move(ports)), electrons_per_count_(electrons_per_count) {
  addUnit(configuration_, identity);
  configuration_.add(std::string{kBox} + "/message",
                     {.value = "", .schema = {{"type", "string"}, {"maxLength", 65'536}}, .factory = {}});
  const auto shown = [&](const char* name, Json value, const char* type) {
    configuration_.add(
        std::string{kBox} + name,
        {.value = std::move(value), .schema = {{"type", type}}, .factory = {}, .is_read_only = true});
  };
  shown("/public_key", box_.publicKey(), "string");
  shown("/passwordProtected", false, "boolean");
  for (const PortIdentity& port : ports_) addPort(configuration_, port);
}

void Device::update(const UnitFacts& facts) {
  host_ns_ = facts.host_ns;
  configuration_.at("/device/clock/currentTime").value = facts.host_ns;
  configuration_.at("/device/diagnostic/upTime").value = facts.since_boot_ns;
  Json temperatures = Json::array();
  for (const auto& [where, celsius] : facts.temperatures_c)
    temperatures.push_back({{"sensor", where}, {"temperature", celsius}});
  configuration_.at("/device/diagnostic/temperatures").value = std::move(temperatures);
  for (const PortIdentity& port : ports_) {
    const auto found = facts.ports.find(port.number);
    if (found == facts.ports.end()) continue;
    showSource(configuration_, port, found->second, electrons_per_count_, !facts_.contains(port.number));
    facts_[port.number] = found->second;
  }
}

HeadSettings Device::head(int port) const {
  const std::string at = portPointer(port);
  HeadSettings settings{.is_running = configuration_.valueAt(at + "/state") == "RUN",
                        .mode = configuration_.valueAt(at + "/mode").get<std::string>()};
  const auto flag = configuration_.leaves().find(at + "/data/algoDebugFlag");
  settings.tells_algorithm = flag != configuration_.leaves().end() && flag->second.value == true;
  const auto number = [&](const char* name) {
    return configuration_.valueAt(at + "/processing/extrinsicHeadToUser/" + name).get<float>();
  };
  settings.optic_to_user = {{number("transX"), number("transY"), number("transZ")},
                            {number("rotX"), number("rotY"), number("rotZ")}};
  return settings;
}

Device::Outcome Device::answer(std::string_view path, const Call& call) {
  if (path == kDiagnostic) return {answerDiagnostic(call)};
  if (path != kMain) return {fault(Fault::kNoSuchObject, fmt::format("there is no object \"{}\"", path))};
  return answerMain(call);
}

Device::Outcome Device::answerMain(const Call& call) {
  if (auto done = answerConfiguration(call)) return *std::move(done);
  if (auto told = answerQuestion(call)) return {*std::move(told)};
  if (call.method == "reboot") return {.answer = nothing(), .is_reboot = true};
  if (call.method == "rebootToRecovery")
    return {fault(Fault::kNoReboot, "there is no recovery system here: no firmware is to be flashed")};
  if (call.method == "factoryReset") {
    init_ = Json::object();
    return {.answer = nothing(), .is_reboot = true};
  }
  if (call.method == "lock") return {lock(textParam(call, 0))};
  if (call.method == "unlock") return {unlock(textParam(call, 0))};
  return {fault(Fault::kNoSuchMethod, fmt::format("there is no method \"{}\"", call.method))};
}

std::optional<Device::Outcome> Device::answerConfiguration(const Call& call) {
  if (call.method == "get") return Outcome{texted(configuration_.get(pointersIn(call)))};
  if (call.method == "getSchema") return Outcome{texted(configuration_.schema(pointersIn(call)))};
  if (call.method == "getInit") return Outcome{texted(init_)};
  if (call.method == "saveInit") return Outcome{saveInit(pointersIn(call))};
  if (call.method == "set") return set(textParam(call, 0));
  if (call.method == "reset") {
    if (is_locked_) return Outcome{fault(Fault::kWrongPassword, "the configuration is locked")};
    return make(configuration_.resetOf(textParam(call, 0)));
  }
  if (call.method == "remove") {
    return Outcome{fault(
        Fault::kNoSuchParameter,
        fmt::format("there is no \"{}\" that can be removed: no applications run here", textParam(call, 0)))};
  }
  return std::nullopt;
}

std::optional<Device::Answer> Device::answerQuestion(const Call& call) const {
  using Struct = XmlRpcValue::Struct;
  const auto valueAt = [&](const char* pointer) {
    return configuration_.valueAt(pointer).get<std::string>();
  };
  if (call.method == "getSWVersion") {
    return XmlRpcValue{Struct{{"IFM_Software", kFirmware},
                              {"Linux", ""},
                              {"Main_Application", kFirmware},
                              {"Diagnostic_Controller", "v0.0.11"}}};
  }
  if (call.method == "getHWInfo") {
    return XmlRpcValue{Struct{{"MACAddress", valueAt("/device/network/macEth0").c_str()},
                              {"Mainboard", valueAt("/device/info/serialNumber").c_str()}}};
  }
  if (call.method == "getTraceLogs") return XmlRpcValue{XmlRpcValue::Array{}};
  if (call.method == "getInitStatus") {
    const auto now = configuration_.settable({});
    return XmlRpcValue{textOf({{"changedSince", now ? Json::diff(init_, *now).size() : 0U}})};
  }
  if (call.method != "getParameter") return std::nullopt;
  const std::string name = textParam(call, 0);
  if (name == "DeviceType") return XmlRpcValue{fmt::format("1:{}", kDeviceNumber)};
  if (name == "ArticleNumber") return XmlRpcValue{valueAt("/device/info/partNumber")};
  if (name == "Name") return XmlRpcValue{valueAt("/device/info/name")};
  if (name == "Description") return XmlRpcValue{valueAt("/device/info/description")};
  return fault(Fault::kNoSuchParameter,
               fmt::format("there is no parameter \"{}\"; ask `get` for the configuration", name));
}

Device::Outcome Device::set(const std::string& text) {
  const auto tree = readJson(text);
  if (!tree) return {faultOf(tree.error())};
  return setTree(*tree, false);
}

Device::Outcome Device::setTree(const Json& tree, bool is_sealed) {
  const auto changes = configuration_.changesOf(tree);
  if (!changes) return {faultOf(changes.error())};
  const auto changed = [&](const std::string& pointer) {
    return std::ranges::find(*changes, pointer, &Configuration::Changes::value_type::first);
  };
  const auto message = changed(std::string{kBox} + "/message");
  if (message != changes->end()) {
    if (is_sealed || changes->size() > 1)
      return {fault(Fault::kWrongFormat, "a sealed message comes alone, and holds no other")};
    return setSealed(message->second.get<std::string>());
  }
  if (is_locked_ && !is_sealed && !changes->empty())
    return {fault(Fault::kWrongPassword, "the configuration is locked")};
  if (box_.isProtected() && !is_sealed && changed(kKeys) != changes->end())
    return {
        fault(Fault::kWrongPassword, "authorized_keys is set by a sealed message only: there is a password")};
  return make(changes);
}

Device::Outcome Device::setSealed(const std::string& message) {
  const auto tree = box_.open(message);
  showBox();
  if (!tree) return {faultOf(tree.error())};
  return setTree(*tree, true);
}

void Device::showBox() {
  configuration_.at(std::string{kBox} + "/passwordProtected").value = box_.isProtected();
}

Device::Outcome Device::make(const Result<Configuration::Changes>& changes) {
  if (!changes) return {faultOf(changes.error())};
  Outcome outcome{nothing()};
  for (const PortIdentity& port : ports_) {
    const auto facts = facts_.find(port.number);
    if (facts == facts_.end()) continue;
    auto wanted = sourceChangesOf(configuration_, *changes, port, facts->second, electrons_per_count_);
    if (!wanted) return {faultOf(wanted.error())};
    if (!wanted->empty()) outcome.changes.emplace(port.number, *std::move(wanted));
  }
  configuration_.apply(*changes);
  return outcome;
}

Device::Answer Device::saveInit(const std::vector<std::string>& pointers) {
  const auto saved = configuration_.settable(pointers);
  if (!saved) return faultOf(saved.error());
  init_.merge_patch(*saved);
  return nothing();
}

std::map<int, SourceChanges> Device::restart() {
  is_locked_ = !lock_password_.empty();
  auto changes = configuration_.resetOf("");
  std::map<int, SourceChanges> all;
  if (changes) all = make(changes).changes;
  const auto saved = configuration_.changesOf(init_);
  if (!saved) return all;  // it was of a source that took more
  for (auto& [port, more] : make(saved).changes) all[port].insert(all[port].end(), more.begin(), more.end());
  return all;
}

Device::Answer Device::lock(const std::string& password) {
  if (is_locked_) return fault(Fault::kWrongPassword, "the configuration is locked already");
  if (password.size() > kLongestPassword)
    return fault(Fault::kOutOfRange, "a password has at most 256 bytes");
  lock_password_ = password;
  is_locked_ = !password.empty();
  return nothing();
}

Device::Answer Device::unlock(const std::string& password) {
  if (password != lock_password_) return fault(Fault::kWrongPassword, "wrong password");
  is_locked_ = false;
  return nothing();
}

/// No event is ever told: what befalls a source stands in the daemon's health.
Json Device::diagnostic() const {
  return {{"bootid", configuration_.valueAt("/device/info/serialNumber")},
          {"events", Json::array()},
          {"timestamp", host_ns_},
          {"version", {{"diagnostics", "v0.0.11"}, {"euphrates", kFirmware}}}};
}

Device::Answer Device::answerDiagnostic(const Call& call) const {
  if (call.method == "get") return texted(diagnostic());
  if (call.method == "getFiltered") {
    const auto filter = readJson(textParam(call, 0));
    if (!filter) return faultOf(filter.error());
    return texted(diagnostic());
  }
  if (call.method == "getFilterSchema") {
    const Json state = {{"type", "string"}, {"enum", {"active", "dormant"}}};
    return texted(Json{{"$schema", "http://json-schema.org/draft-07/schema#"},
                       {"type", "object"},
                       {"properties", {{"state", state}, {"id", {{"type", "integer"}}}}}});
  }
  return fault(Fault::kNoSuchMethod, fmt::format("there is no method \"{}\"", call.method));
}

}  // namespace toftwin::daemon::o3r
