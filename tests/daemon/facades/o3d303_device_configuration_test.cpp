// SPDX-License-Identifier: Apache-2.0
// What the vendor's SDK calls and expects, by its public tests: the same calls, and what they come to.
// Without a network; the source is a table of parameters. Here: the device, network and time, export and
// import.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "drivers/o3d303/wire/base64.h"
#include "o3d303_configuration.h"

namespace toftwin::daemon::o3d303 {
namespace {

using testing::ElementsAre;
using toftwin::o3d303::Base64;
using toftwin::o3d303::fromBase64;
using toftwin::o3d303::toBase64;

// ---- the device ----------------------------------------------------------------------------------

TEST_F(O3d303Configuration, TheDeviceHasTheRealOnesParameters) {
  const Parameters parameters = all("/");
  EXPECT_EQ(parameters.size(), 38u) << "as in the published configuration of firmware 1.23";
  for (const auto& [name, value] : parameters) EXPECT_EQ(call("/", "getParameter", {name}).text(), value);
  EXPECT_EQ(faultOf("/", "getParameter", {"Bogus Parameter"}), Fault::kNoSuchParameter);
}

TEST_F(O3d303Configuration, DeviceParametersAreOfTheirTypeAndRange) {
  struct Case {
    const char *name, *value;
    int fault;
  };
  constexpr Case kCases[] = {{"Name", "ifm3d unit test", 0},
                             {"PNIODeviceName", "baz", 0},
                             {"EthernetFieldBus", "2", 0},
                             {"EthernetFieldBus", "3", Fault::kOutOfRange},
                             {"EthernetFieldBus", "x", Fault::kWrongType},
                             {"EthernetFieldBusEndianness", "1", 0},
                             {"EthernetFieldBusEndianness", "0.5", Fault::kWrongType},
                             {"IODebouncing", "false", 0},
                             {"IODebouncing", "maybe", Fault::kWrongType},
                             {"IOLogicType", "2", Fault::kOutOfRange},
                             {"SessionTimeout", "4", Fault::kOutOfRange},
                             {"SessionTimeout", "300", 0},
                             {"ExtrinsicCalibTransX", "12.5", 0},
                             {"ExtrinsicCalibTransX", "1e5", Fault::kOutOfRange},
                             {"ExtrinsicCalibRotX", "5", 0},
                             {"ExtrinsicCalibRotX", "181", Fault::kOutOfRange},
                             {"EIPProducingSize", "451", Fault::kOutOfRange},
                             {"PcicTcpSchemaAutoUpdate", "true", 0},
                             {"TemperatureIllu", "20", Fault::kReadOnly},
                             {"DeviceType", "1:3", Fault::kReadOnly},
                             {"OperatingMode", "0", Fault::kReadOnly},
                             {"PcicTcpPort", "80", Fault::kReadOnly},
                             {"ActiveApplication", "first", Fault::kWrongType},
                             {"Bogus", "1", Fault::kNoSuchParameter}};
  edit();
  for (const Case& one : kCases)
    EXPECT_EQ(faultOf("edit/device/", "setParameter", {one.name, one.value}), one.fault)
        << one.name << " = " << one.value;
  EXPECT_EQ(all("/").at("Name"), "ifm3d unit test") << "as it is set in edit mode, saved or not";
  EXPECT_EQ(device_.parameters().at("Name"), "test") << "not saved yet";
  call("edit/device/", "save");
  end();
  EXPECT_EQ(all("/").at("Name"), "ifm3d unit test");
  EXPECT_EQ(all("/").at("IODebouncing"), "false");
  EXPECT_EQ(device_.extrinsics(), (toftwin::o3d303::ExtrinsicCalibration{12.5F, 0, 0, 5, 0, 0}));
}

TEST_F(O3d303Configuration, APasswordHoldsFromItsSavingOn) {
  edit();
  call("edit/device/", "activatePassword", {"foobar"});
  end();
  EXPECT_EQ(faultOf("/", "requestSession", {"", kSession}), 0) << "it was not saved";
  end();
  edit();
  call("edit/device/", "activatePassword", {"foobar"});
  call("edit/device/", "save");
  end();
  EXPECT_EQ(all("/").at("PasswordActivated"), "true");
  EXPECT_EQ(faultOf("/", "requestSession", {"", kSession}), Fault::kWrongPassword);
  call("/", "requestSession", {"foobar", kSession});
  call("", "setOperatingMode", {1});
  call("edit/device/", "disablePassword");
  call("edit/device/", "save");
  end();
  EXPECT_EQ(all("/").at("PasswordActivated"), "false");
  begin();
}

TEST_F(O3d303Configuration, HeartbeatsAreClampedAndMustBeNumbers) {
  begin();
  EXPECT_EQ(call("", "heartbeat", {10}).text(), "10");
  EXPECT_EQ(call("", "heartbeat", {1}).text(), "5");
  EXPECT_EQ(call("", "heartbeat", {301}).text(), "300");
  EXPECT_EQ(faultOf("", "heartbeat", {"soon"}), Fault::kWrongType);
  EXPECT_EQ(faultOf("", "heartbeat"), Fault::kWrongType);
  now_ += std::chrono::seconds{300};
  device_.expire(now_);
  EXPECT_EQ(faultOf("", "heartbeat", {10}), Fault::kNoSuchObject);
}

TEST_F(O3d303Configuration, OnlyTheProductiveSystemIsBooted) {
  EXPECT_EQ(faultOf("/", "reboot", {0}), 0);
  EXPECT_EQ(faultOf("/", "reboot"), 0);
  EXPECT_EQ(faultOf("/", "reboot", {1}), Fault::kNoReboot) << "recovery";
  EXPECT_EQ(faultOf("/", "reboot", {7}), Fault::kNoReboot);
  EXPECT_EQ(faultOf("/", "reboot", {"now"}), Fault::kWrongType);
}

TEST_F(O3d303Configuration, FactoryResetPutsAllBackAlsoTheSource) {
  set(kImager, "ExposureTime", "3000");
  set(kImager, "SpatialFilterType", "2");
  edit();
  call("edit/", "createApplication", {"Camera"});
  call("edit/device/", "setParameter", {"Name", "other"});
  call("edit/device/", "save");
  call("edit/device/time/", "setParameter", {"WaitSyncTries", "9"});
  call("edit/device/time/", "saveAndActivateConfig");
  call("edit/", "factoryReset");
  end();
  EXPECT_THAT(applicationIndices(), ElementsAre(1));
  EXPECT_EQ(device_.activeApplication(), 1);
  EXPECT_EQ(all("/").at("Name"), "test");
  EXPECT_EQ(source("exposure_us"), 1000.0);
  EXPECT_EQ(source("spatial_filter"), 0.0);
  EXPECT_EQ(dump("edit/device/time/").at("WaitSyncTries"), "2");
}

/// 250 electrons are 41.7 counts, which the camera writes as 42; the 252 that it has at first are 42, too.
TEST_F(O3d303Configuration, WhatATextRoundsComesBackAsItWas) {
  source("minimum_amplitude_electrons") = 250.0;  // a native client
  device_.update(facts_);
  editApplication();
  EXPECT_EQ(all(kImager).at("MinimumAmplitude"), "42");
  call("edit/", "stopEditingApplication");
  call("edit/", "copyApplication", {1});
  call("edit/", "editApplication", {1});
  call(kImager, "setParameter", {"MinimumAmplitude", "100"});
  call(kApplication, "save");
  EXPECT_EQ(source("minimum_amplitude_electrons"), 600.0);
  call("edit/", "stopEditingApplication");
  call("edit/device/", "setParameter", {"ActiveApplication", "2"});
  call("edit/device/", "save");
  EXPECT_EQ(source("minimum_amplitude_electrons"), 250.0) << "of the copy";
  call("edit/device/", "setParameter", {"ActiveApplication", "1"});
  call("edit/device/", "save");
  EXPECT_EQ(source("minimum_amplitude_electrons"), 600.0);
  source("minimum_amplitude_electrons") = 250.0;
  device_.update(facts_);
  call("edit/", "factoryReset");
  EXPECT_EQ(source("minimum_amplitude_electrons"), 252.0) << "not what has the same text";
}

TEST_F(O3d303Configuration, TheTemperaturesAreThoseOfTheSource) {
  facts_.housing_c = 31.5;
  facts_.processor_c = 55.0;
  device_.update(facts_);
  EXPECT_EQ(all("/").at("TemperatureFront1"), "31.5");
  EXPECT_EQ(all("/").at("TemperatureIMX6"), "55.0");
  EXPECT_EQ(all("/").at("TemperatureIllu"), "3276.7") << "there is none";
  edit();
  facts_.housing_c = 32.0;
  device_.update(facts_);
  call("edit/device/", "save");
  EXPECT_EQ(all("/").at("TemperatureFront1"), "32.0") << "what is measured is not saved";
}

TEST_F(O3d303Configuration, ASaveThatIsRefusedSavesNothing) {
  edit();
  call("edit/", "copyApplication", {1});
  call("edit/device/", "setParameter", {"ActiveApplication", "2"});
  call("edit/device/", "setParameter", {"Name", "half"});
  call("edit/", "deleteApplication", {2});
  EXPECT_EQ(faultOf("edit/device/", "save"), Fault::kNoSuchApplication);
  end();
  EXPECT_EQ(all("/").at("Name"), "test");
}

// ---- network and time ----------------------------------------------------------------------------

TEST_F(O3d303Configuration, TheNetworkIsKeptAndSavingItEndsTheSession) {
  edit();
  const char* network = "edit/device/network/";
  EXPECT_EQ(all(network).size(), 6u);
  EXPECT_EQ(faultOf(network, "setParameter", {"MACAddress", "00:00:00:00:00:00"}), Fault::kReadOnly);
  EXPECT_EQ(faultOf(network, "setParameter", {"StaticIPv4Address", "192.168.0"}), Fault::kWrongNetwork);
  EXPECT_EQ(faultOf(network, "setParameter", {"UseDHCP", "perhaps"}), Fault::kWrongType);
  call(network, "setParameter", {"StaticIPv4Address", "192.168.0.70"});
  call(network, "setParameter", {"UseDHCP", "true"});
  call(network, "saveAndActivateConfig");
  EXPECT_EQ(faultOf("", "heartbeat", {5}), Fault::kNoSuchObject);
  edit();
  EXPECT_EQ(all(network).at("StaticIPv4Address"), "192.168.0.70");
  call(network, "setParameter", {"StaticIPv4Address", "192.168.0.71"});
  end();
  edit();
  EXPECT_EQ(all(network).at("StaticIPv4Address"), "192.168.0.70") << "that was not saved";
}

TEST_F(O3d303Configuration, TheClockCanBeSetAndRunsOnAndNetworkTimeIsKept) {
  const char* time = "edit/device/time/";
  facts_.device_s = 100;
  edit();
  EXPECT_EQ(all(time).at("CurrentTime"), "100");
  EXPECT_EQ(faultOf(time, "setParameter", {"CurrentTime", "0"}), Fault::kReadOnly);
  EXPECT_EQ(faultOf(time, "setParameter", {"WaitSyncTries", "none"}), Fault::kWrongType);
  for (const auto& [name, value] : std::map<std::string, std::string>{
           {"WaitSyncTries", "1"}, {"NTPServers", "91.189.89.198"}, {"SynchronizationActivated", "true"}})
    call(time, "setParameter", {name, value});
  EXPECT_EQ(device_.hostShift_ns(), std::nullopt) << "not saved yet";
  call(time, "saveAndActivateConfig");
  EXPECT_EQ(device_.hostShift_ns(), 0);
  EXPECT_EQ(all(time).at("WaitSyncTries"), "1");
  call(time, "setCurrentTime", {1'600'000'000});
  EXPECT_EQ(all(time).at("CurrentTime"), "1600000000");
  EXPECT_EQ(device_.clockShift_s(), 1'600'000'000 - 100);
  facts_.device_s = 103;
  device_.update(facts_);
  EXPECT_EQ(all(time).at("CurrentTime"), "1600000003");
  EXPECT_EQ(all("/").at("ImageTimestampReference"), "1600000003");
  EXPECT_EQ(faultOf(time, "setCurrentTime", {-5}), Fault::kOutOfRange);
  EXPECT_EQ(faultOf(time, "setCurrentTime", {"noon"}), Fault::kWrongType);
}

// ---- export and import ---------------------------------------------------------------------------

TEST_F(O3d303Configuration, AnApplicationComesBackAsItWasExported) {
  editApplication();
  call(kApplication, "setParameter", {"Name", "kept"});
  call(kImager, "changeType", {"upto30m_moderate"});
  call(kImager, "setParameter", {"ExposureTime", "2500"});
  call(kImager, "setParameter", {"SpatialFilterType", "1"});
  call(kSpatial, "setParameter", {"MaskSize", "1"});
  call(kImager, "setParameter", {"ClippingLeft", "7"});
  call(kApplication, "save");
  end();
  edit();
  const XmlRpcValue bytes = call("", "exportApplication", {1});
  ASSERT_TRUE(std::holds_alternative<Base64>(bytes.value)) << "the SDK reads bytes";
  EXPECT_EQ(call("", "importApplication", {bytes}).text(), "2");
  EXPECT_THAT(applicationIndices(), ElementsAre(1, 2));
  std::map<std::string, Parameters> of[2];
  for (int i = 0; i < 2; ++i) {
    call("edit/", "editApplication", {i + 1});
    for (const char* object : {kApplication, kImager, kSpatial, kTemporal}) of[i][object] = all(object);
    call("edit/", "stopEditingApplication");
  }
  EXPECT_EQ(of[0], of[1]);
  EXPECT_EQ(of[1].at(kImager).at("ClippingLeft"), "7");
  EXPECT_EQ(of[1].at(kSpatial).at("MaskSize"), "1");
}

TEST_F(O3d303Configuration, ATimeThatIsOfTheNetworkIsThisMachines) {
  facts_.device_s = 1000;
  facts_.host_ns = 1'700'000'000'900'000'000;
  device_.update(facts_);
  EXPECT_EQ(all("/").at("ImageTimestampReference"), "1000");
  edit();
  call("edit/device/time/", "setParameter", {"SynchronizationActivated", "true"});
  call("edit/device/time/", "saveAndActivateConfig");
  EXPECT_EQ(all("edit/device/time/").at("CurrentTime"), "1700000000");
  EXPECT_EQ(all("/").at("ImageTimestampReference"), "1700000000");
}

/// The source's clock may go on with its frames alone, as a triggered one's does.
TEST_F(O3d303Configuration, ATimeThatWasSetGoesOnWithThisMachinesClock) {
  facts_.device_s = 1000;
  facts_.host_ns = 1'700'000'000'000'000'000;
  device_.update(facts_);
  edit();
  call("edit/device/time/", "setCurrentTime", {1'600'000'000});
  EXPECT_EQ(all("edit/device/time/").at("CurrentTime"), "1600000000");
  *facts_.host_ns += 2'500'000'000;
  device_.update(facts_);
  EXPECT_EQ(all("edit/device/time/").at("CurrentTime"), "1600000002");
  EXPECT_EQ(device_.hostShift_ns(), -100'000'000'000'000'000);
}

TEST_F(O3d303Configuration, AnApplicationThatCannotBeSavedIsNotImported) {
  begin();
  const std::string file = call("", "exportApplication", {1}).text();
  std::string xml = fromBase64(file).value();
  const auto replace = [&](const std::string& name, const std::string& from, const std::string& to) {
    const auto at = xml.find(from, xml.find(name));
    ASSERT_NE(at, std::string::npos) << name;
    xml.replace(at, from.size(), to);
  };
  replace("<name>TriggerMode</name>", ">1<", ">2<");
  replace("<name>TemporalFilterType</name>", ">0<", ">1<");
  EXPECT_EQ(faultOf("", "importApplication", {toftwin::o3d303::toBase64(xml)}), Fault::kFilterAgainstTrigger);
  EXPECT_THAT(applicationIndices(), ElementsAre(1));
}

/// What is exported can be imported again, or it is refused.
TEST_F(O3d303Configuration, AnExportThatWouldNotFitIntoACallIsRefused) {
  editApplication();
  const std::string longest(65'536, '&');  // each is five bytes there
  for (const char* name : {"LogicGraph", "TemplateInfo", "PcicEipResultSchema"})
    call(kApplication, "setParameter", {name, longest});
  call(kApplication, "save");
  call("edit/", "stopEditingApplication");
  for (int i = 0; i < 4; ++i) call("edit/", "copyApplication", {1});
  EXPECT_EQ(faultOf("", "exportApplication", {1}), 0);
  EXPECT_EQ(faultOf("", "exportConfig"), 0) << "five of 0.98 MB";
  call("edit/", "copyApplication", {1});
  EXPECT_EQ(faultOf("", "exportConfig"), Fault::kInternal) << "six";
}

TEST_F(O3d303Configuration, AWholeConfigurationComesBackByItsFlags) {
  set(kImager, "ExposureTime", "2500");
  edit();
  call("edit/device/", "setParameter", {"Name", "first"});
  call("edit/device/", "save");
  call("edit/", "createApplication", {"Camera"});
  const XmlRpcValue bytes = call("", "exportConfig");
  call("edit/device/", "setParameter", {"Name", "second"});
  call("edit/device/", "save");
  call("edit/", "deleteApplication", {2});
  end();
  set(kImager, "ExposureTime", "500");
  edit();
  call("", "importConfig", {bytes, 0x1});
  EXPECT_EQ(all("/").at("Name"), "first");
  EXPECT_THAT(applicationIndices(), ElementsAre(1)) << "not asked for";
  EXPECT_EQ(source("exposure_us"), 500.0);
  call("", "importConfig", {bytes, 0x1 | 0x2 | 0x10});
  EXPECT_THAT(applicationIndices(), ElementsAre(1, 2));
  EXPECT_EQ(source("exposure_us"), 2500.0) << "the active application is another now";
}

TEST_F(O3d303Configuration, WhatIsNoExportIsRefused) {
  edit();
  const XmlRpcValue application = call("", "exportApplication", {1}), whole = call("", "exportConfig");
  const auto bytesOf = [](std::string_view text) { return XmlRpcValue{Base64{toBase64(text)}}; };
  EXPECT_EQ(faultOf("", "exportApplication", {9}), Fault::kNoSuchApplication);
  EXPECT_EQ(faultOf("", "importApplication", {bytesOf("PK\x03\x04 of another maker")}), Fault::kWrongFormat);
  EXPECT_EQ(faultOf("", "importApplication", {XmlRpcValue{Base64{"!!"}}}), Fault::kWrongFormat);
  EXPECT_EQ(faultOf("", "importApplication"), Fault::kWrongFormat);
  EXPECT_EQ(faultOf("", "importApplication", {whole}), Fault::kWrongFormat);
  EXPECT_EQ(faultOf("", "importConfig", {application, 1}), Fault::kWrongFormat);
  for (const int flags : {0, 4, 0x20, -1})
    EXPECT_EQ(faultOf("", "importConfig", {whole, flags}), Fault::kWrongImportFlags) << flags;
  std::string xml = fromBase64(application.text()).value();
  xml.replace(xml.find("FrameRate"), 9, "BogusRate");
  EXPECT_EQ(faultOf("", "importApplication", {bytesOf(xml)}), Fault::kNoSuchParameter);
  call("edit/", "editApplication", {1});
  EXPECT_EQ(faultOf("", "importApplication", {application}), Fault::kApplicationInEdit);
  EXPECT_EQ(faultOf("", "importConfig", {whole, 1}), Fault::kApplicationInEdit);
  EXPECT_THAT(applicationIndices(), ElementsAre(1));
}

TEST(O3d303Base64, IsThatOfRfc4648AndTakesNothingElse) {
  const std::pair<std::string, std::string> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : vectors) {
    EXPECT_EQ(toBase64(bytes), text);
    EXPECT_EQ(fromBase64(text), bytes);
  }
  EXPECT_EQ(fromBase64("Zm9v\r\nYmFy\n"), "foobar") << "lines, as clients break them";
  for (const char* none : {"Z", "Zg=", "Zg===", "=Zg=", "Zm9v!", "Zg==Zg==", "===="})
    EXPECT_EQ(fromBase64(none), std::nullopt) << none;
}

}  // namespace
}  // namespace toftwin::daemon::o3d303
