// SPDX-License-Identifier: Apache-2.0
// What an O3R facade is sent: configurations and other calls one after another to one device, and what a
// head's info chunks hold.
#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>

#include "daemon/facades/o3r/device.h"
#include "daemon/facades/o3r/plugs.h"
#include "drivers/o3d303/wire/bytes.h"
#include "drivers/o3r/wire/head_frame.h"
#include "fuzz_one_input.h"
#include "o3r_testing.h"

namespace toftwin::daemon {
namespace {

using toftwin::o3d303::XmlRpcCall;
using toftwin::o3d303::XmlRpcValue;

void demand(bool holds) {
  if (!holds) std::abort();
}

/// What a source is asked for lies within its bounds.
void checkChanges(const o3r::UnitFacts& facts, const std::map<int, SourceChanges>& all) {
  for (const auto& [port, changes] : all) {
    for (const auto& [name, value] : changes) {
      bool is_known = false;
      for (const Parameter& one : facts.ports.at(port).parameters)
        is_known |= one.name == name && one.bounds.contains(value);
      demand(is_known);
    }
  }
}

/// Lines: a letter for the method, then its one parameter.
void playCalls(std::string_view text) {
  static const o3r::UnitFacts kFacts = test::o3rFacts();
  static const o3r::Device kFresh = [] {
    o3r::Device device = test::o3rDevice();
    device.update(kFacts);
    return device;
  }();
  constexpr std::string_view kMethods[] = {
      "set",    "get",    "getSchema",    "reset",        "saveInit",      "getInit", "lock",
      "unlock", "remove", "getParameter", "factoryReset", "getInitStatus", "reboot",  "getSWVersion"};
  o3r::Device device = kFresh;
  constexpr int kMostCalls = 8;  // each answer may be the whole configuration
  for (int calls = 0; !text.empty() && calls < kMostCalls; ++calls) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(text.size(), end + 1));
    if (line.empty()) continue;
    const auto method = kMethods[static_cast<unsigned char>(line.front()) % std::size(kMethods)];
    const XmlRpcValue param{std::string{line.substr(1)}};
    const auto outcome =
        device.answer("/api/rpc/v1/com.ifm.efector/", XmlRpcCall{std::string{method}, {param}});
    checkChanges(kFacts, outcome.changes);
    static_cast<void>(encodeXmlRpc(outcome.answer));
    if (outcome.is_reboot) checkChanges(kFacts, device.restart());
    if (outcome.is_reboot || !outcome.changes.empty()) device.update(kFacts);
    for (const float one : device.head(2).optic_to_user.translation_m) demand(std::isfinite(one));
  }
}

}  // namespace

void fuzzOneInput(std::span<const std::byte> bytes) {
  const std::string_view text = toftwin::o3d303::textOf(bytes);
  playCalls(text);
  static_cast<void>(o3r::plugsOf({std::string{text.substr(0, 40)}, std::string{text}}, ""));
  if (const auto call = toftwin::o3d303::readXmlRpcCall(text)) {
    o3r::Device device = test::o3rDevice();
    static_cast<void>(device.answer("/api/rpc/v1/com.ifm.efector/", *call));
    static_cast<void>(device.answer("/api/rpc/v1/com.ifm.diagnostic/", *call));
  }
  if (const auto info = toftwin::o3r::readTofInfo(bytes)) {
    static_cast<void>(toftwin::o3r::rayOf(info->intrinsics, 3, 4));
    demand(toftwin::o3r::readTofInfo(encode(*info)).ok());
  }
  static_cast<void>(toftwin::o3r::readRgbInfo(bytes));
  if (const auto schema = toftwin::o3d303::readSchema(text))
    static_cast<void>(writeHeadFrame(*schema, toftwin::o3r::HeadFrame{}));
}

}  // namespace toftwin::daemon
