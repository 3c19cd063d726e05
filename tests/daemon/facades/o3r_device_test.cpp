// SPDX-License-Identifier: Apache-2.0
// The O3R's configuration without a network or a source.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sodium.h>

#include <fmt/format.h>

#include <string>
#include <vector>

#include "daemon/facades/o3r/device.h"
#include "daemon/facades/o3r/plugs.h"
#include "drivers/o3d303/wire/base64.h"
#include "o3r_testing.h"

namespace toftwin::daemon::o3r {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;
using toftwin::o3d303::XmlRpcFault;
using toftwin::o3d303::XmlRpcValue;

class O3rDevice : public testing::Test {
 protected:
  O3rDevice() { device_.update(test::o3rFacts()); }

  Device::Outcome ask(const std::string& method, std::vector<XmlRpcValue> params = {}) {
    return device_.answer("/api/rpc/v1/com.ifm.efector/", {method, std::move(params)});
  }
  static int codeOf(const Device::Outcome& outcome) {
    const auto* fault = std::get_if<XmlRpcFault>(&outcome.answer);
    return fault == nullptr ? 0 : fault->code;
  }
  static Json jsonOf(const Device::Outcome& outcome) {
    const auto* value = std::get_if<XmlRpcValue>(&outcome.answer);
    return value == nullptr ? Json{} : Json::parse(value->text());
  }
  static XmlRpcValue listOf(std::vector<std::string> pointers) {
    XmlRpcValue::Array list;
    for (std::string& one : pointers) list.emplace_back(std::move(one));
    return list;
  }
  Json at(const std::string& pointer) {
    return jsonOf(ask("get", {listOf({pointer})})).value(Json::json_pointer{pointer}, Json{});
  }
  Device::Outcome set(const std::string& pointer, const Json& value) {
    Json tree;
    tree[Json::json_pointer{pointer}] = value;
    return ask("set", {tree.dump()});
  }
  /// As a client seals it.
  Device::Outcome sendSealed(const Json& request) {
    const auto key =
        toftwin::o3d303::fromBase64(at("/device/crypto/sealedbox/public_key").get<std::string>());
    const std::string text = request.dump();
    std::string sealed(text.size() + crypto_box_SEALBYTES, '\0');
    crypto_box_seal(reinterpret_cast<unsigned char*>(sealed.data()),
                    reinterpret_cast<const unsigned char*>(text.data()), text.size(),
                    reinterpret_cast<const unsigned char*>(key->data()));
    return set("/device/crypto/sealedbox/message", toftwin::o3d303::toBase64(sealed));
  }

  Device device_ = test::o3rDevice();
};

TEST_F(O3rDevice, AHeadIsFoundByItsPortItsTypeAndItsTcpPort) {
  EXPECT_EQ(at("/ports/port2/info/features/type"), "3D");
  EXPECT_EQ(at("/ports/port2/data/pcicTCPPort"), 50'012);
  EXPECT_EQ(at("/ports/port0/info/features/type"), "2D");
  EXPECT_EQ(at("/ports/port2/info/features/resolution/width"), 224);
  EXPECT_EQ(codeOf(ask("get", {listOf({"/ports/port7"})})), 101'000);
  EXPECT_EQ(codeOf(ask("get", {listOf({"/por"})})), 101'000) << "half a name is none";
}

TEST_F(O3rDevice, OnlyThePartsThatAreAskedForAreAnswered) {
  const Json part = jsonOf(ask("get", {listOf({"/ports/port2/state", "/applications/instances"})}));
  EXPECT_EQ(part, Json::parse(R"({"applications":{"instances":{}},"ports":{"port2":{"state":"RUN"}}})"));
  EXPECT_EQ(jsonOf(ask("get")).size(), 3u) << "applications, device, ports";
}

TEST_F(O3rDevice, AWholeDumpCanBeSetAndChangesNothing) {
  const Json dump = jsonOf(ask("get"));
  const auto outcome = ask("set", {dump.dump()});
  EXPECT_EQ(codeOf(outcome), 0);
  EXPECT_TRUE(outcome.changes.empty());
  EXPECT_EQ(jsonOf(ask("get")), dump);
}

TEST_F(O3rDevice, ExposureAndFrameRateAreTheSourcesOfThatPort) {
  const auto outcome =
      ask("set", {R"({"ports":{"port2":{"acquisition":{"exposureLong":2000,"framerate":5}}}})"});
  EXPECT_EQ(codeOf(outcome), 0);
  ASSERT_EQ(outcome.changes.size(), 1u);
  EXPECT_THAT(outcome.changes.at(2), ElementsAre(Pair("exposure_us", 2000.0), Pair("frame_rate_hz", 5.0)));
}

TEST_F(O3rDevice, TheShorterExposureIsARatioOfTheLonger) {
  const auto outcome = set("/ports/port2/acquisition/exposureShort", 100);
  EXPECT_THAT(outcome.changes.at(2), ElementsAre(Pair("exposure_ratio", 10.0)));  // of 1000 µs
  EXPECT_EQ(codeOf(set("/ports/port2/acquisition/exposureShort", 999)), 101'002) << "the least ratio is 2";
}

TEST_F(O3rDevice, CountsOfMinAmplitudeAreElectronsOfTheSource) {
  EXPECT_EQ(at("/ports/port2/processing/diParam/minAmplitude"), 50.0);  // 300 electrons at 6 a count
  EXPECT_THAT(set("/ports/port2/processing/diParam/minAmplitude", 20).changes.at(2),
              ElementsAre(Pair("minimum_amplitude_electrons", 120.0)));
}

TEST_F(O3rDevice, WhatTheSourceHasNothingLikeIsReadOnly) {
  EXPECT_EQ(codeOf(set("/ports/port0/acquisition/framerate", 3)), 0)
      << "passed over, as all that is only shown";
  const Json schema = jsonOf(ask("getSchema", {listOf({"/ports/port0/acquisition/framerate"})}));
  EXPECT_EQ(
      schema.value(
          "/properties/ports/properties/port0/properties/acquisition/properties/framerate/readOnly"_json_pointer,
          false),
      true);
}

TEST_F(O3rDevice, WhatDoesNotFitIsRefusedWithItsPlace) {
  EXPECT_EQ(codeOf(set("/ports/port2/acquisition/exposureLong", "soon")), 101'002);
  EXPECT_EQ(codeOf(set("/ports/port2/acquisition/exposureLong", 1.5)), 101'002);
  EXPECT_EQ(codeOf(set("/ports/port2/acquisition/framerate", 21)), 101'002);
  EXPECT_EQ(codeOf(set("/ports/port2/state", "FLY")), 101'002);
  EXPECT_EQ(codeOf(set("/ports/port2/nonsense", 1)), 101'000);
  EXPECT_EQ(codeOf(set("/ports/port3/state", "RUN")), 101'000);
  EXPECT_EQ(codeOf(set("/applications/instances/app0/class", "ods")), 101'000) << "no applications run here";
  EXPECT_EQ(codeOf(ask("set", {"{"})), 101'010);
  EXPECT_EQ(codeOf(ask("set", {std::string(100, '[') + std::string(100, ']')})), 101'010);
  const auto outcome = set("/ports/port2/state", "FLY");
  EXPECT_THAT(std::get<XmlRpcFault>(outcome.answer).text, HasSubstr("/ports/port2/state"));
}

TEST_F(O3rDevice, OneThatDoesNotFitKeepsAllOthersFromBeingSet) {
  ask("set", {R"({"ports":{"port2":{"mode":"standard_range2m","state":"FLY"}}})"});
  EXPECT_EQ(at("/ports/port2/mode"), "standard_range4m");
}

TEST_F(O3rDevice, TheSchemaHoldsTheSourcesBoundsAndCloses) {
  const Json schema = jsonOf(ask("getSchema"));
  const Json exposure = schema.at(
      "/properties/ports/properties/port2/properties/acquisition/properties/exposureLong"_json_pointer);
  EXPECT_EQ(exposure.at("type"), "integer");
  EXPECT_EQ(exposure.at("minimum"), 10.0);
  EXPECT_EQ(exposure.at("maximum"), 8000.0);
  EXPECT_EQ(schema.at("/properties/ports/additionalProperties"_json_pointer), false);
  EXPECT_EQ(jsonOf(ask("getSchema", {listOf({"/ports"})})).at("properties").size(), 1u);
}

TEST_F(O3rDevice, AResetGivesThePlacesBelowTheirFirstValues) {
  set("/ports/port2/mode", "standard_range2m");
  set("/device/info/name", "dock");
  EXPECT_EQ(codeOf(ask("reset", {"/ports/port2/mode"})), 0);
  EXPECT_EQ(at("/ports/port2/mode"), "standard_range4m");
  EXPECT_EQ(at("/device/info/name"), "dock");
  EXPECT_EQ(codeOf(ask("reset", {"/nowhere"})), 101'000);
}

TEST_F(O3rDevice, AfterARebootOnlyWhatWasSavedIsSet) {
  set("/device/info/name", "dock");
  set("/device/info/description", "north");
  EXPECT_EQ(codeOf(ask("saveInit", {listOf({"/device/info/name"})})), 0);
  EXPECT_EQ(jsonOf(ask("getInit")), Json::parse(R"({"device":{"info":{"name":"dock"}}})"));
  EXPECT_TRUE(ask("reboot").is_reboot);
  device_.restart();
  EXPECT_EQ(at("/device/info/name"), "dock");
  EXPECT_EQ(at("/device/info/description"), "");
}

TEST_F(O3rDevice, TheSourceToo) {
  set("/ports/port2/acquisition/exposureLong", 2000);
  ask("saveInit");
  set("/ports/port2/acquisition/exposureLong", 3000);
  EXPECT_THAT(device_.restart().at(2), testing::Contains(Pair("exposure_us", 2000.0)));
  ask("factoryReset", {false});
  EXPECT_THAT(device_.restart().at(2), ElementsAre(Pair("exposure_us", 1000.0)));
}

TEST_F(O3rDevice, ALockedConfigurationIsReadOnly) {
  EXPECT_EQ(codeOf(ask("lock", {"secret"})), 0);
  EXPECT_EQ(codeOf(set("/device/info/name", "dock")), 101'005);
  EXPECT_EQ(codeOf(ask("reset", {"/device/info/name"})), 101'005);
  EXPECT_EQ(codeOf(ask("get")), 0);
  EXPECT_EQ(codeOf(ask("unlock", {"wrong"})), 101'005);
  EXPECT_EQ(codeOf(ask("unlock", {"secret"})), 0);
  EXPECT_EQ(codeOf(set("/device/info/name", "dock")), 0);
}

TEST_F(O3rDevice, HeadsAreSetFromTheTree) {
  set("/ports/port2/state", "IDLE");
  set("/ports/port2/data/algoDebugFlag", true);
  ask("set", {R"({"ports":{"port2":{"processing":{"extrinsicHeadToUser":{"transX":0.5,"rotZ":-1.5}}}}})"});
  const HeadSettings head = device_.head(2);
  EXPECT_FALSE(head.is_running);
  EXPECT_TRUE(head.tells_algorithm);
  EXPECT_EQ(head.optic_to_user.translation_m[0], 0.5F);
  EXPECT_EQ(head.optic_to_user.rotation_rad[2], -1.5F);
}

// ---- the sealed box ------------------------------------------------------------------------------

TEST_F(O3rDevice, APasswordComesSealedAndGuardsTheKeys) {
  EXPECT_EQ(codeOf(sendSealed({{"nonce", "1"}, {"request", "set_password"}, {"new_password", "foo"}})), 0);
  EXPECT_EQ(at("/device/crypto/sealedbox/passwordProtected"), true);
  EXPECT_EQ(codeOf(set("/device/network/authorized_keys", "mine")), 101'005);
  const Json keys = {{"device", {{"network", {{"authorized_keys", "mine"}}}}}};
  const auto asked = [&](const char* nonce, const char* password) {
    return sendSealed({{"nonce", nonce},
                       {"request", "set_configuration"},
                       {"password", password},
                       {"configuration", keys}});
  };
  EXPECT_EQ(codeOf(asked("2", "bar")), 101'005);
  EXPECT_EQ(codeOf(asked("3", "foo")), 0);
  EXPECT_EQ(at("/device/network/authorized_keys"), "mine");
  EXPECT_EQ(codeOf(sendSealed({{"nonce", "4"}, {"request", "remove_password"}, {"password", "foo"}})), 0);
  EXPECT_EQ(at("/device/crypto/sealedbox/passwordProtected"), false);
}

TEST_F(O3rDevice, ASealedMessageThatWasHereBeforeIsNotObeyed) {
  const Json request = {{"nonce", "1"}, {"request", "set_password"}, {"new_password", "foo"}};
  EXPECT_EQ(codeOf(sendSealed(request)), 0);
  EXPECT_EQ(codeOf(sendSealed(request)), 101'005);
  EXPECT_EQ(codeOf(sendSealed({{"request", "remove_password"}, {"password", "foo"}})), 101'005) << "no nonce";
}

TEST_F(O3rDevice, ASealOfAnotherKeyIsNone) {
  EXPECT_EQ(codeOf(set("/device/crypto/sealedbox/message", "AAAA")), 101'010);
  EXPECT_EQ(codeOf(set("/device/crypto/sealedbox/message", toftwin::o3d303::toBase64(std::string(200, 'x')))),
            101'010);
}

// ---- plugs ---------------------------------------------------------------------------------------

TEST(O3rPlugs, ANameIsA3dHeadAndNothingIsNoHead) {
  const auto plugs = plugsOf({"front/2D", "", "front", "rear"}, "front");
  ASSERT_TRUE(plugs.ok());
  EXPECT_THAT(*plugs, ElementsAre(Plug{0, "front", false}, Plug{2, "front", true}, Plug{3, "rear", true}));
  EXPECT_THAT(*plugsOf({}, "front"), ElementsAre(Plug{2, "front", true}));
  EXPECT_FALSE(plugsOf(std::vector<std::string>(7, "front"), "front").ok());
  EXPECT_FALSE(plugsOf({"", ""}, "front").ok());
}

}  // namespace
}  // namespace toftwin::daemon::o3r
