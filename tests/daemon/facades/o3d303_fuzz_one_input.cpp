// SPDX-License-Identifier: Apache-2.0
// What an O3D303 facade is sent: XML-RPC calls one after another to one device, PCIC messages, searches.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "daemon/facades/ifm/commands.h"
#include "daemon/facades/o3d303/device.h"
#include "daemon/facades/o3d303/schemas.h"
#include "daemon/facades/ifm/discovery.h"
#include "daemon/facades/ifm/request_check.h"
#include "drivers/o3d303/wire/base64.h"
#include "drivers/o3d303/wire/frame_writer.h"
#include "drivers/o3d303/wire/pcic.h"
#include "fuzz_one_input.h"
#include "o3d303_operable.h"

namespace toftwin::daemon {
namespace {

using namespace ifm;
using namespace o3d303;
using toftwin::o3d303::XmlRpcCall;
using toftwin::o3d303::XmlRpcValue;

void demand(bool holds) {
  if (!holds) std::abort();
}

constexpr std::string_view kSession = "session_0123456789abcdef0123456789abcdef/";
constexpr std::array<std::string_view, 10> kObjects{"",
                                                    "",
                                                    "edit/",
                                                    "edit/device/",
                                                    "edit/device/network/",
                                                    "edit/device/time/",
                                                    "edit/application/",
                                                    "edit/application/imager_001/",
                                                    "edit/application/imager_001/spatialfilter",
                                                    "edit/application/imager_001/temporalfilter"};
constexpr std::array<std::string_view, 36> kMethods{"requestSession",
                                                    "setOperatingMode",
                                                    "editApplication",
                                                    "setParameter",
                                                    "save",
                                                    "getParameter",
                                                    "getAllParameters",
                                                    "heartbeat",
                                                    "cancelSession",
                                                    "setTemporaryApplicationParameters",
                                                    "getSWVersion",
                                                    "getHWInfo",
                                                    "getApplicationList",
                                                    "getTraceLogs",
                                                    "reboot",
                                                    "stopEditingApplication",
                                                    "availableApplicationTypes",
                                                    "copyApplication",
                                                    "deleteApplication",
                                                    "createApplication",
                                                    "factoryReset",
                                                    "saveAndActivateConfig",
                                                    "setCurrentTime",
                                                    "activatePassword",
                                                    "disablePassword",
                                                    "availableTypes",
                                                    "changeType",
                                                    "expire",
                                                    "nonsense",
                                                    "exportApplication",
                                                    "importApplication",
                                                    "exportConfig",
                                                    "importConfig",
                                                    "getAllParameterLimits",
                                                    "changeNameAndDescription",
                                                    "select"};

SourceFacts facts() {
  SourceFacts facts = operableFacts({0.1, 30.0});
  facts.exposures_us = {40, 1000};
  return facts;
}

/// What the source is asked for lies within its bounds.
void checkChanges(const SourceChanges& changes) {
  for (const auto& [name, value] : changes) {
    bool is_known = false;
    for (const Parameter& one : facts().parameters) {
      if (one.name == name) is_known = one.bounds.contains(value);
    }
    demand(is_known);
  }
}

/// The last came later: it has the highest bytes, so that old inputs say what they said.
std::size_t objectOf(unsigned char byte) {
  return byte >= 0xF0U ? kObjects.size() - 1 : byte % (kObjects.size() - 1);
}

/// Made once: the tables of parameters and the schema take longer than most inputs do.
const Device& freshDevice() {
  static const Device kDevice = [] {
    Device device{{.name = "fuzz", .password = "", .mac = "02:00:00:00:00:00", .address = "127.0.0.1"}};
    device.update(facts());
    return device;
  }();
  return kDevice;
}

/// Lines: a byte for the object, one for the method, then two texts, with a '\t' between them.
void playCalls(std::string_view text) {
  Device device = freshDevice();
  SteadyTime now{};
  constexpr int kMostCalls = 48;  // so that many short plays are tried instead of few long ones
  for (int calls = 0; text.size() >= 2 && calls < kMostCalls; ++calls) {
    const auto object = objectOf(static_cast<unsigned char>(text[0]));
    // A letter is one of the first; what came later has the other half of the bytes, so that old inputs say
    // what they said.
    constexpr std::size_t kLetters = 29;
    const auto byte = static_cast<unsigned char>(text[1]);
    const std::size_t method =
        byte < 0x80U ? byte % kLetters : kLetters + (byte - 0x80U) % (kMethods.size() - kLetters);
    std::string_view line =
        text.substr(2, text.find('\n', 2) == std::string_view::npos ? text.size() : text.find('\n', 2) - 2);
    text.remove_prefix(std::min(text.size(), 2 + line.size() + 1));
    XmlRpcCall call{std::string{kMethods[method]}, {}};
    const std::size_t tab = line.find('\t');
    const std::string first{line.substr(0, tab)},
        second{tab == std::string_view::npos ? "" : line.substr(tab + 1)};
    if (call.method == "requestSession") {
      call.params = {XmlRpcValue{""}, XmlRpcValue{"0123456789abcdef0123456789abcdef"}};
    } else if (call.method == "setTemporaryApplicationParameters") {
      call.params = {XmlRpcValue{XmlRpcValue::Struct{{first, XmlRpcValue{second}}}}};
    } else if (call.method.starts_with("import")) {
      call.params = {XmlRpcValue{toftwin::o3d303::Base64{toftwin::o3d303::toBase64(first)}},
                     XmlRpcValue{second}};
    } else {
      call.params = {XmlRpcValue{first}, XmlRpcValue{second}};
    }
    now += std::chrono::seconds{1};
    if (call.method == "expire") {
      now += std::chrono::seconds{400};
      checkChanges(device.expire(now));
      demand(!device.isEditing());
      continue;
    }
    if (call.method == "select") {
      const auto selected = device.select(static_cast<int>(object));
      if (selected) checkChanges(selected->changes);
      continue;
    }
    const std::string path = "/api/rpc/v1/com.ifm.efector/" +
                             (object == 0 ? std::string{} : std::string{kSession}) +
                             std::string{kObjects[object]};
    const auto outcome = device.answer(path, call, now);
    checkChanges(outcome.changes);
    static_cast<void>(encodeXmlRpc(outcome.answer));
    if (outcome.has_saved) demand(isServed(device.defaultSchema()));
    if (!outcome.changes.empty()) device.update(facts());
    for (const float one : device.extrinsics()) demand(std::isfinite(one));
    const auto control = device.exposureControl();
    demand(!control || control->bounds.least_us >= 1.0);
    static_cast<void>(device.binning());
  }
}

void readMessages(std::span<const std::byte> bytes) {
  toftwin::o3d303::PcicReader reader{1 << 17};
  reader.feed(bytes);
  while (true) {
    const auto message = reader.next();
    if (!message || !*message) return;
    const Command command = readCommand(toftwin::o3d303::textOf((*message)->content), isServed);
    if (command.kind == Command::Kind::SetSchema) demand(isServed(command.schema));
    if (command.kind == Command::Kind::SetOutput) demand(command.output < 16);
    demand(command.number >= 0 && command.number < 100);
    demand(isServed(withoutMarkers(command.schema)) || !isServed(command.schema));
  }
}

}  // namespace

void fuzzOneInput(std::span<const std::byte> bytes) {
  const std::string_view text = toftwin::o3d303::textOf(bytes);
  readMessages(bytes);
  static_cast<void>(readCommand(text, isServed));
  static_cast<void>(readSearch(bytes));
  static_cast<void>(readExposureRegion(std::string{text}));
  const std::size_t cut = text.size() / 3;
  const auto refused =
      refusalOf({text.substr(0, cut), text.substr(cut, cut), text.substr(2 * cut)}, {"camera.lan"});
  demand((refused.status == 0) == refused.why.empty());
  playCalls(text);
  if (const auto call = toftwin::o3d303::readXmlRpcCall(text)) {
    Device device = freshDevice();
    static_cast<void>(device.answer("/api/rpc/v1/com.ifm.efector/", *call, {}));
    static_cast<void>(device.answer(text.substr(0, 200), *call, {}));
  }
}

}  // namespace toftwin::daemon
