// SPDX-License-Identifier: Apache-2.0
// Applications and whole configurations as bytes, for a client to keep and bring back: XML-RPC's own form of
// their parameters. The real camera's files are of another form, and are refused.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <variant>

#include "daemon/facades/o3d303/answers.h"
#include "daemon/facades/o3d303/device.h"
#include "drivers/o3d303/wire/base64.h"

namespace toftwin::daemon::o3d303 {

using toftwin::o3d303::Base64;
using toftwin::o3d303::XmlRpcAnswer;
using toftwin::o3d303::XmlRpcCall;
using toftwin::o3d303::XmlRpcValue;

namespace {

using Members = XmlRpcValue::Struct;

constexpr std::string_view kExportFormat = "toftwin o3d303", kApplicationFile = "application",
                           kWholeFile = "configuration";
/// Four thirds of it, in base64, fit into a call (http_server.cpp).
constexpr std::size_t kLongestExport = std::size_t{5} << 20;
constexpr unsigned kDeviceFlag = 0x1, kNetworkFlag = 0x2, kApplicationsFlag = 0x10;

/// A parameter's name and value.
using Entry = std::pair<std::string, std::string>;

XmlRpcValue structOfTexts(const Parameters& all) {
  Members members;
  for (const auto& [name, value] : all) members.emplace_back(name, XmlRpcValue{value});
  return XmlRpcValue{std::move(members)};
}

XmlRpcAnswer packed(std::string_view kind, Members content) {
  content.emplace_back("format", XmlRpcValue{std::string{kExportFormat}});
  content.emplace_back("content", XmlRpcValue{std::string{kind}});
  const std::string xml = encodeXmlRpc(XmlRpcAnswer{XmlRpcValue{std::move(content)}});
  if (xml.size() > kLongestExport) {
    return fault(Fault::kInternal, fmt::format("the {} takes {} bytes, of {} that could be imported again; "
                                               "shorten schemas, LogicGraph and TemplateInfo",
                                               kind, xml.size(), kLongestExport));
  }
  return XmlRpcValue{Base64{toftwin::o3d303::toBase64(xml)}};
}

const XmlRpcValue* memberOf(const XmlRpcValue& value, std::string_view name) {
  const auto* members = std::get_if<Members>(&value.value);
  if (members == nullptr) return nullptr;
  const auto found = std::ranges::find(*members, name, &Members::value_type::first);
  return found == members->end() ? nullptr : &found->second;
}

std::vector<Entry> entriesOf(const XmlRpcValue& value, std::string_view name) {
  std::vector<Entry> all;
  const XmlRpcValue* member = memberOf(value, name);
  const auto* members = member == nullptr ? nullptr : std::get_if<Members>(&member->value);
  if (members == nullptr) return all;
  for (const auto& [key, one] : *members) all.emplace_back(key, one.text());
  // Which exposures there are to set depends on the type, and what a filter has on the filter.
  std::stable_partition(all.begin(), all.end(), [](const Entry& one) { return one.first == "Type"; });
  return all;
}

XmlRpcAnswer wrongFormat(std::string_view why) {
  return fault(Fault::kWrongFormat, fmt::format("the bytes are not what this camera exports: {}", why));
}

std::variant<XmlRpcValue, XmlRpcAnswer> unpacked(const XmlRpcCall& call, std::string_view kind) {
  const auto bytes = toftwin::o3d303::fromBase64(paramText(call, 0));
  if (!bytes) return wrongFormat("they are no base64");
  const auto read = toftwin::o3d303::readXmlRpcAnswer(*bytes);
  if (!read || !std::holds_alternative<XmlRpcValue>(*read)) return wrongFormat("they are of another form");
  const auto& value = std::get<XmlRpcValue>(*read);
  if (value.textAt("format") != kExportFormat) return wrongFormat("they are of another form");
  if (value.textAt("content") != kind) return wrongFormat(fmt::format("they are no {}", kind));
  return value;
}

bool isReadOnly(const XmlRpcAnswer& refused) {
  const auto* as_fault = std::get_if<toftwin::o3d303::XmlRpcFault>(&refused);
  return as_fault != nullptr && as_fault->code == Fault::kReadOnly;
}

/// Sets all; what cannot be set here stays as it is. Gives the first refusal for another reason.
template <class Set>
std::optional<XmlRpcAnswer> setEach(const std::vector<Entry>& entries, const Set& set) {
  for (const auto& [name, value] : entries) {
    auto refused = set(name, value);
    if (refused && !isReadOnly(*refused)) return refused;
  }
  return std::nullopt;
}

}  // namespace

XmlRpcValue Device::valueOf(const Application& one) {
  return Members{{"application", structOfTexts(one.application)},
                 {"imager", structOfTexts(one.imager)},
                 {"spatialfilter", structOfTexts(one.spatial)},
                 {"temporalfilter", structOfTexts(one.temporal)}};
}

std::variant<Device::Application, XmlRpcAnswer> Device::applicationOf(const XmlRpcValue& value) const {
  Application made = freshApplication();
  const auto setFilter = [&](Binding::Object object) {
    return [&made, this, object](const std::string& name, const std::string& text) -> Refusal {
      // It was exported whole, also where the filter is off and has none.
      auto refused = setFilterParameter(made, object, name, text);
      const bool is_off = refused &&
                          std::get<toftwin::o3d303::XmlRpcFault>(*refused).code == Fault::kNoSuchParameter &&
                          of(made, object).contains(name);
      return is_off ? std::nullopt : refused;
    };
  };
  auto refused =
      setEach(entriesOf(value, "application"), [&](const std::string& name, const std::string& text) {
        return setApplicationParameter(made, name, text);
      });
  if (!refused) {
    refused = setEach(entriesOf(value, "imager"), [&](const std::string& name, const std::string& text) {
      return setImagerParameter(made, name, text);
    });
  }
  if (!refused)
    refused = setEach(entriesOf(value, "spatialfilter"), setFilter(Binding::Object::SpatialFilter));
  if (!refused)
    refused = setEach(entriesOf(value, "temporalfilter"), setFilter(Binding::Object::TemporalFilter));
  if (!refused) refused = checkFilter(made);
  if (refused) return *std::move(refused);
  return made;
}

Device::Outcome Device::exportApplication(const XmlRpcCall& call) const {
  const auto index = numberIn(paramText(call, 0));
  if (!index || !applications_.contains(*index))
    return {fault(Fault::kNoSuchApplication, "there is no such application")};
  return {packed(kApplicationFile, {{"App", valueOf(applications_.at(*index))}})};
}

Device::Outcome Device::importApplication(const XmlRpcCall& call) {
  if (edited_) return {fault(Fault::kApplicationInEdit, "an application is being edited")};
  const auto file = unpacked(call, kApplicationFile);
  if (const auto* refused = std::get_if<XmlRpcAnswer>(&file)) return {*refused};
  const XmlRpcValue* value = memberOf(std::get<XmlRpcValue>(file), "App");
  if (value == nullptr) return {wrongFormat("no application is in them")};
  auto made = applicationOf(*value);
  if (auto* refused = std::get_if<XmlRpcAnswer>(&made)) return {std::move(*refused)};
  if (std::ssize(applications_) >= kMostApplications)
    return {fault(Fault::kTooManyApplications, "there are too many")};
  return {XmlRpcValue{createApplication(std::get<Application>(std::move(made)))}};
}

Device::Outcome Device::exportConfiguration() const {
  Members applications;
  for (const auto& [index, one] : applications_)
    applications.emplace_back(std::to_string(index), valueOf(one));
  return {packed(kWholeFile, {{"Device", structOfTexts(device_)},
                              {"Net", structOfTexts(network_)},
                              {"Time", structOfTexts(time_)},
                              {"Apps", XmlRpcValue{std::move(applications)}}})};
}

Device::Outcome Device::importConfiguration(const XmlRpcCall& call) {
  if (edited_) return {fault(Fault::kApplicationInEdit, "an application is being edited")};
  const auto given = numberIn(paramText(call, 1));
  const unsigned flags = given && *given > 0 ? static_cast<unsigned>(*given) : 0U;
  if (flags == 0 || (flags & ~(kDeviceFlag | kNetworkFlag | kApplicationsFlag)) != 0) {
    return {fault(Fault::kWrongImportFlags,
                  "the flags are 1 device, 2 network, 16 applications, or some of them added")};
  }
  const auto file = unpacked(call, kWholeFile);
  if (const auto* refused = std::get_if<XmlRpcAnswer>(&file)) return {*refused};
  const auto& value = std::get<XmlRpcValue>(file);
  Device after = *this;  // all of it or nothing
  after.edited_device_ = device_;
  after.edited_network_ = network_;
  after.edited_time_ = time_;
  if ((flags & kApplicationsFlag) != 0) {
    const XmlRpcValue* apps = memberOf(value, "Apps");
    const auto* members = apps == nullptr ? nullptr : std::get_if<Members>(&apps->value);
    if (members == nullptr || std::ssize(*members) > kMostApplications)
      return {wrongFormat("no applications are in them")};
    after.applications_.clear();
    for (const auto& [name, one] : *members) {
      const auto index = numberIn(name);
      auto made = applicationOf(one);
      if (auto* refused = std::get_if<XmlRpcAnswer>(&made)) return {std::move(*refused)};
      if (!index || *index < 1 || *index > kMostApplications)
        return {wrongFormat("an application has another number than 1 to 32")};
      after.applications_[*index] = std::get<Application>(std::move(made));
    }
    const bool is_there = after.applications_.contains(after.activeApplication());
    if (!is_there) after.device_["ActiveApplication"] = after.edited_device_["ActiveApplication"] = "0";
  }
  Refusal refused;
  if ((flags & kDeviceFlag) != 0) {
    refused =
        setEach(entriesOf(value, "Device"), [&](const std::string& name, const std::string& text) -> Refusal {
          // Which application was active says nothing where those it was chosen from stay away.
          if (name == "ActiveApplication" && !after.applications_.contains(numberIn(text).value_or(0)))
            return std::nullopt;
          return after.setDeviceParameter(name, text);
        });
    if (!refused) {
      refused = setEach(entriesOf(value, "Time"), [&](const std::string& name, const std::string& text) {
        return after.setTimeParameter(name, text);
      });
    }
  }
  if (!refused && (flags & kNetworkFlag) != 0) {
    refused = setEach(entriesOf(value, "Net"), [&](const std::string& name, const std::string& text) {
      return after.setNetworkParameter(name, text);
    });
  }
  if (refused) return {*std::move(refused)};
  applications_ = std::move(after.applications_);
  device_ = std::move(after.edited_device_);
  edited_device_ = device_;
  network_ = edited_network_ = std::move(after.edited_network_);
  time_ = edited_time_ = std::move(after.edited_time_);
  refreshActive();
  const auto active = applications_.find(activeApplication());
  if (active == applications_.end()) return {nothing()};
  return {.answer = nothing(), .changes = changesTo(active->second), .has_saved = true};
}

}  // namespace toftwin::daemon::o3d303
