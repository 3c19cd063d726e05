// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3r/head.h"

#include <fmt/format.h>

#include <charconv>
#include <nlohmann/json.hpp>

namespace toftwin::drivers::o3r {
namespace {

using Json = nlohmann::json;
constexpr std::string_view kScheme = "o3r:";
constexpr int kDeepestJson = 32;

std::string textAt(const Json& json, const char* pointer) {
  const Json value = json.value(Json::json_pointer{pointer}, Json{});
  return value.is_string() ? value.get<std::string>() : std::string{};
}

/// Nothing for what is no JSON, or nested too deeply.
Json parsed(std::string_view text) {
  bool is_too_deep = false;
  const auto watch = [&](int depth, Json::parse_event_t, Json&) {
    is_too_deep |= depth > kDeepestJson;
    return depth <= kDeepestJson;
  };
  Json json = Json::parse(text, watch, false);
  return is_too_deep || json.is_discarded() ? Json{} : json;
}

}  // namespace

Result<Head> readHead(std::string_view json, const std::string& port) {
  const Json tree = parsed(json);
  const Json of = tree.is_object() ? tree.value(Json::json_pointer{"/ports/" + port}, Json{}) : Json{};
  if (!of.is_object())
    return Error{Error::Code::NotFound,
                 fmt::format("o3r: the unit has no head at {}; see `toftwin compliance`", port)};
  Head head{.type = textAt(of, "/info/features/type"),
            .part_number = textAt(of, "/info/partNumber"),
            .serial = textAt(of, "/info/serialNumber"),
            .state = textAt(of, "/state"),
            .pcic_port = 0,
            .acquisition = {}};
  const Json pcic = of.value(Json::json_pointer{"/data/pcicTCPPort"}, Json{});
  if (pcic.is_number_unsigned() && pcic.get<std::uint64_t>() <= 65'535) head.pcic_port = pcic.get<int>();
  if (head.type != "3D") {
    return Error{
        Error::Code::Incompatible,
        fmt::format("o3r: the head at {} is of type \"{}\"; frames come from 3D heads", port, head.type)};
  }
  if (head.pcic_port == 0)
    return Error{Error::Code::Incompatible, fmt::format("o3r: {} has no pcicTCPPort", port)};
  const Json acquisition = of.value("acquisition", Json::object());
  for (const auto& [name, value] : acquisition.items()) {
    if (value.is_number()) head.acquisition.emplace(name, value.get<double>());
  }
  return head;
}

std::string settingsFor(const Head& head, const std::string& port,
                        const std::map<std::string, double, std::less<>>& wanted) {
  Json settings = Json::object();
  for (const auto& [name, value] : wanted) {
    const auto now = head.acquisition.find(name);
    if (now != head.acquisition.end() && now->second != value) settings["acquisition"][name] = value;
  }
  if (head.state != "RUN") settings["state"] = "RUN";
  if (settings.empty()) return {};
  return Json{{"ports", {{port, settings}}}}.dump();
}

Result<HeadAddress> readAddress(std::string_view uri) {
  HeadAddress address;
  std::string_view text = uri.starts_with(kScheme) ? uri.substr(kScheme.size()) : std::string_view{};
  if (const auto slash = text.find('/'); slash != std::string_view::npos) {
    address.port = text.substr(slash + 1);
    text = text.substr(0, slash);
  }
  bool is_good = address.port.size() == 5 && address.port.starts_with("port") && address.port[4] >= '0' &&
                 address.port[4] <= '5';
  if (const auto colon = text.rfind(':'); colon != std::string_view::npos) {
    const char* end = text.data() + text.size();
    const auto read = std::from_chars(text.data() + colon + 1, end, address.xmlrpc_port);
    is_good = is_good && read.ec == std::errc{} && read.ptr == end && address.xmlrpc_port != 0;
    text = text.substr(0, colon);
  }
  address.host = text;
  if (is_good && !text.empty()) return address;
  return Error{
      Error::Code::NotFound,
      fmt::format("there is no head {}; write o3r:, the unit's IP address and the head's port, such as "
                  "o3r:192.168.0.69/port2",
                  uri)};
}

}  // namespace toftwin::drivers::o3r
