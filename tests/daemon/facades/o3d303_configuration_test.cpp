// SPDX-License-Identifier: Apache-2.0
// What the vendor's SDK calls and expects, by its public tests: the same calls, and what they come to.
// Without a network; the source is a table of parameters.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "daemon/facades/o3d303/device.h"
#include "drivers/o3d303/wire/base64.h"

namespace toftwin::daemon::o3d303 {
namespace {

using testing::ElementsAre;
using testing::Pair;
using testing::SizeIs;
using testing::UnorderedElementsAre;
using toftwin::o3d303::Base64;
using toftwin::o3d303::fromBase64;
using toftwin::o3d303::toBase64;
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

// ---- applications --------------------------------------------------------------------------------

TEST_F(O3d303Configuration, ApplicationsAreCopiedMadeAndDeleted) {
  EXPECT_THAT(applicationIndices(), ElementsAre(1));
  edit();
  EXPECT_EQ(call("edit/", "copyApplication", {1}).text(), "2");
  EXPECT_EQ(call("edit/", "createApplication", {"Camera"}).text(), "3");
  EXPECT_THAT(applicationIndices(), ElementsAre(1, 2, 3));
  call("edit/", "deleteApplication", {2});
  EXPECT_THAT(applicationIndices(), ElementsAre(1, 3));
  EXPECT_EQ(faultOf("edit/", "copyApplication", {-1}), Fault::kNoSuchApplication);
  EXPECT_EQ(faultOf("edit/", "deleteApplication", {-1}), Fault::kNoSuchApplication);
  EXPECT_EQ(faultOf("edit/", "editApplication", {"one"}), Fault::kNoSuchApplication);
  for (int i = 0; i < 30; ++i) call("edit/", "createApplication", {"Camera"});
  EXPECT_EQ(faultOf("edit/", "createApplication", {"Camera"}), Fault::kTooManyApplications)
      << "32 are the most";
  EXPECT_EQ(faultOf("edit/", "copyApplication", {1}), Fault::kTooManyApplications);
}

TEST_F(O3d303Configuration, TheActiveApplicationCanBeDeletedAndThenNoneIs) {
  edit();
  call("edit/", "createApplication", {"Camera"});
  call("edit/device/", "setParameter", {"ActiveApplication", "2"});
  EXPECT_EQ(device_.activeApplication(), 1) << "until it is saved";
  call("edit/device/", "save");
  EXPECT_EQ(device_.activeApplication(), 2);
  end();
  edit();
  call("edit/", "deleteApplication", {2});
  end();
  EXPECT_THAT(applicationIndices(), ElementsAre(1));
  EXPECT_EQ(call("/", "getParameter", {"ActiveApplication"}).text(), "0");
  EXPECT_TRUE(device_.isIdle()) << "without one there are no frames";
  edit();
  EXPECT_EQ(faultOf("edit/device/", "setParameter", {"ActiveApplication", "2"}), Fault::kNoSuchApplication);
  call("edit/device/", "setParameter", {"ActiveApplication", "1"});
  call("edit/device/", "save");
  end();
  EXPECT_FALSE(device_.isIdle());
}

TEST_F(O3d303Configuration, AnApplicationHasTheRealOnesParametersWithTheirLimits) {
  editApplication();
  const Parameters parameters = all(kApplication);
  std::vector<std::string> names;
  for (const auto& [name, value] : parameters) names.push_back(name);
  EXPECT_THAT(names, UnorderedElementsAre("Name", "Description", "TriggerMode", "PcicTcpResultSchema",
                                          "PcicEipResultSchema", "PcicPnioResultSchema", "TemplateInfo",
                                          "Type", "LogicGraph"));
  EXPECT_EQ(faultOf(kApplication, "setParameter", {"Name", std::string(64, 'n')}), 0);
  EXPECT_EQ(faultOf(kApplication, "setParameter", {"Name", std::string(65, 'n')}), Fault::kOutOfRange);
  EXPECT_EQ(faultOf(kApplication, "setParameter", {"Description", std::string(500, 'n')}), 0);
  EXPECT_EQ(faultOf(kApplication, "setParameter", {"Description", std::string(501, 'n')}),
            Fault::kOutOfRange);
  EXPECT_EQ(faultOf(kApplication, "setParameter", {"Type", "Robot"}), Fault::kReadOnly);
  EXPECT_EQ(faultOf(kApplication, "setParameter", {"Name", "dock"}), 0);
  call(kApplication, "save");
  end();
  const auto list = call("/", "getApplicationList");
  EXPECT_EQ(std::get<XmlRpcValue::Array>(list.value).at(0).textAt("Name"), "dock");
}

TEST_F(O3d303Configuration, ActivatingAnApplicationSetsTheSourceToWhatItWasSavedWith) {
  edit();
  call("edit/", "createApplication", {"Camera"});
  call("edit/", "editApplication", {2});
  call(kImager, "changeType", {"upto30m_moderate"});
  call(kImager, "setParameter", {"ExposureTime", "2000"});
  call(kImager, "setParameter", {"SpatialFilterType", "1"});
  call(kApplication, "save");
  call("edit/", "stopEditingApplication");
  EXPECT_EQ(source("exposure_us"), 1000.0) << "it is not the active one";
  call("edit/device/", "setParameter", {"ActiveApplication", "2"});
  call("edit/device/", "save");
  EXPECT_EQ(source("exposure_us"), 2000.0);
  EXPECT_EQ(source("frequencies"), 2.0);
  EXPECT_EQ(source("exposures"), 2.0);
  EXPECT_EQ(source("spatial_filter"), 1.0);
  call("edit/device/", "setParameter", {"ActiveApplication", "1"});
  call("edit/device/", "save");
  EXPECT_EQ(source("exposure_us"), 1000.0);
  EXPECT_EQ(source("frequencies"), 1.0);
  EXPECT_EQ(source("spatial_filter"), 0.0);
}

// ---- the imager ----------------------------------------------------------------------------------

TEST_F(O3d303Configuration, EachTypeOfTheImagerIsTakenAndHasTheExposuresOfItsKind) {
  editApplication();
  const auto types = call(kImager, "availableTypes");
  end();
  const auto& array = std::get<XmlRpcValue::Array>(types.value);
  EXPECT_EQ(array.size(), 9u);
  for (const XmlRpcValue& one : array) {
    const std::string type = one.text();
    editApplication();
    call(kImager, "changeType", {type});
    call(kApplication, "save");
    end();
    const Parameters imager = dump(kImager);
    EXPECT_EQ(imager.at("Type"), type);
    EXPECT_EQ(imager.contains("ExposureTime"), !type.ends_with("high")) << type;
    EXPECT_EQ(imager.contains("ExposureTimeRatio"), type.ends_with("moderate")) << type;
    const auto list = imager.at("ExposureTimeList");
    EXPECT_EQ(list, type.ends_with("low")        ? "1000"
                    : type.ends_with("moderate") ? "25;1000"
                                                 : "20;200;1000")
        << type;
    EXPECT_EQ(source("frequencies"), type.starts_with("under") ? 1.0 : type.starts_with("upto") ? 2.0 : 3.0);
  }
  EXPECT_EQ(source("exposures"), 3.0);
  editApplication();
  EXPECT_EQ(faultOf(kImager, "changeType", {"under5m"}), Fault::kWrongImagerType);
  EXPECT_EQ(faultOf(kImager, "changeType", {""}), Fault::kWrongImagerType);
}

TEST_F(O3d303Configuration, ASourceWithOneTypeHasThatOne) {
  std::erase_if(facts_.parameters,
                [](const Parameter& one) { return one.name == "frequencies" || one.name == "exposures"; });
  facts_.frequencies = 3;
  facts_.exposures_us = {125, 5000};
  device_.update(facts_);
  editApplication();
  const auto types = call(kImager, "availableTypes");
  EXPECT_THAT(std::get<XmlRpcValue::Array>(types.value), ElementsAre(XmlRpcValue{"morethan30m_moderate"}));
  EXPECT_EQ(faultOf(kImager, "changeType", {"under5m_low"}), Fault::kWrongImagerType);
  EXPECT_EQ(all(kImager).at("ExposureTimeList"), "125;5000");
}

TEST_F(O3d303Configuration, WhatTheImagerIsSetToIsWhatItSaysAndWhatTheSourceHas) {
  editApplication();
  call(kImager, "changeType", {"under5m_moderate"});
  const std::map<std::string, std::string> wanted{{"ExposureTime", "2000"},
                                                  {"ExposureTimeRatio", "5"},
                                                  {"FrameRate", "12.5"},
                                                  {"MinimumAmplitude", "5"},
                                                  {"SpatialFilterType", "1"},
                                                  {"TemporalFilterType", "1"},
                                                  {"SymmetryThreshold", "0.3"},
                                                  {"EnableFilterAmplitudeImage", "false"},
                                                  {"EnableFilterDistanceImage", "0"}};
  for (const auto& [name, value] : wanted) call(kImager, "setParameter", {name, value});
  EXPECT_EQ(all(kImager).at("ExposureTimeList"), "400;2000");
  EXPECT_EQ(all(kImager).at("EnableFilterDistanceImage"), "false");
  call(kApplication, "save");
  EXPECT_EQ(source("exposure_us"), 2000.0);
  EXPECT_EQ(source("exposure_ratio"), 5.0);
  EXPECT_EQ(source("frame_rate_hz"), 12.5);
  EXPECT_EQ(source("minimum_amplitude_electrons"), 5.0 * 6.0) << "six electrons are a count";
  EXPECT_EQ(source("spatial_filter"), 1.0);
  EXPECT_EQ(source("temporal_filter"), 1.0);
  EXPECT_EQ(source("asymmetry_threshold"), 0.3);
  EXPECT_EQ(source("filters_amplitude"), 0.0);
  EXPECT_EQ(source("filters_range"), 0.0);
}

TEST_F(O3d303Configuration, TheImagerRefusesByTheVendorsNumbers) {
  editApplication();
  EXPECT_EQ(faultOf(kImager, "setParameter", {"FrameRate", "1000.0"}), Fault::kOutOfRange);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ExposureTime", "10001"}), Fault::kOutOfRange)
      << "the camera's own bound";
  EXPECT_EQ(faultOf(kImager, "setParameter", {"SpatialFilterType", "4"}), Fault::kOutOfRange);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"SpatialFilterType", "on"}), Fault::kWrongType);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"EnableFilterDistanceImage", "2"}), Fault::kWrongType);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ContinuousAutoExposure", "true"}), Fault::kNoAutoExposure);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"EnableRectificationDistanceImage", "true"}), Fault::kReadOnly);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"Channel", "1"}), Fault::kReadOnly) << "this source has none";
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ExposureTimeRatio", "5"}), Fault::kNoSuchParameter)
      << "of one exposure";
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ClippingLeft", "176"}), Fault::kOutOfRange);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ClippingLeft", "-1"}), Fault::kOutOfRange);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ClippingCuboid", "{\"XMin\": \"near\"}"}),
            Fault::kWrongFormat);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ClippingCuboid", "{\"WMin\": 1}"}), Fault::kWrongFormat);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ClippingCuboid", std::string(2000, '[')}),
            Fault::kWrongFormat);
}

TEST_F(O3d303Configuration, LimitsAreOfTwoNumbersEach) {
  editApplication();
  call(kImager, "changeType", {"under5m_moderate"});
  call(kImager, "setParameter", {"SpatialFilterType", "3"});
  call(kImager, "setParameter", {"TemporalFilterType", "1"});
  for (const char* object : {kImager, kSpatial, kTemporal}) {
    const auto limits = call(object, "getAllParameterLimits");
    const auto& members = std::get<XmlRpcValue::Struct>(limits.value);
    EXPECT_FALSE(members.empty()) << object;
    for (const auto& [name, two] : members) {
      EXPECT_THAT(std::get<XmlRpcValue::Struct>(two.value), SizeIs(2)) << name;
      EXPECT_LE(std::stod(two.textAt("min")), std::stod(two.textAt("max"))) << name;
    }
  }
  const auto limits = call(kImager, "getAllParameterLimits");
  const auto& members = std::get<XmlRpcValue::Struct>(limits.value);
  const auto exposure = std::ranges::find(members, "ExposureTime", &XmlRpcValue::Struct::value_type::first);
  ASSERT_NE(exposure, members.end());
  EXPECT_EQ(exposure->second.textAt("max"), "10000") << "the lesser of the camera's and the source's";
}

TEST_F(O3d303Configuration, FiltersHaveTheParametersOfTheirType) {
  EXPECT_THAT(dump(kSpatial), SizeIs(0));
  for (const char* type : {"1", "2", "3"}) {
    set(kImager, "SpatialFilterType", type);
    EXPECT_THAT(dump(kSpatial), ElementsAre(Pair("MaskSize", "0"))) << "3 x 3 at first";
  }
  set(kSpatial, "MaskSize", "1");
  EXPECT_EQ(source("spatial_filter_reach"), 2.0) << "5 x 5";
  editApplication();
  EXPECT_EQ(faultOf(kSpatial, "setParameter", {"MaskSize", "2"}), Fault::kOutOfRange);
  end();
  set(kImager, "SpatialFilterType", "0");
  EXPECT_THAT(dump(kSpatial), SizeIs(0));
  editApplication();
  EXPECT_EQ(faultOf(kSpatial, "setParameter", {"MaskSize", "0"}), Fault::kNoSuchParameter) << "it is off";
  end();
  set(kImager, "TemporalFilterType", "1");
  EXPECT_THAT(dump(kTemporal), ElementsAre(Pair("NumberOfImages", "2")));
  set(kTemporal, "NumberOfImages", "5");
  EXPECT_EQ(source("temporal_filter_images"), 5.0);
  set(kImager, "TemporalFilterType", "2");
  EXPECT_THAT(dump(kTemporal), SizeIs(0)) << "the adaptive one has none";
}

TEST_F(O3d303Configuration, ATemporalFilterNeedsFreeRun) {
  editApplication();
  call(kImager, "setParameter", {"TemporalFilterType", "1"});
  call(kApplication, "setParameter", {"TriggerMode", "2"});
  EXPECT_EQ(faultOf(kApplication, "save"), Fault::kFilterAgainstTrigger);
  call(kImager, "setParameter", {"TemporalFilterType", "0"});
  EXPECT_EQ(faultOf(kApplication, "save"), 0);
  EXPECT_EQ(source("triggered"), 1.0);
}

TEST_F(O3d303Configuration, TheClippingOfTheActiveApplicationIsTold) {
  EXPECT_EQ(device_.clipping().right, 175);
  set(kImager, "ClippingLeft", "10");
  set(kImager, "ClippingBottom", "100");
  set(kImager, "ClippingCuboid",
      R"({"XMin": 0.5, "XMax": 2.0, "YMin": -1, "YMax": 1, "ZMin": -0.25, "ZMax": 0.25})");
  EXPECT_EQ(device_.clipping(), (Clipping{.left = 10,
                                          .top = 0,
                                          .right = 175,
                                          .bottom = 100,
                                          .least_m = {0.5, -1.0, -0.25},
                                          .most_m = {2.0, 1.0, 0.25}}));
  facts_.width = 352;
  facts_.height = 264;
  device_.update(facts_);
  EXPECT_EQ(device_.clipping().right, 351) << "what reached to the edge does so still";
  EXPECT_EQ(device_.clipping().bottom, 100);
}

TEST_F(O3d303Configuration, TemporaryParametersAreClampedAndGoWithEditModeOrSession) {
  begin();
  const auto temporary = [&](const char* name, int value) {
    return faultOf("", "setTemporaryApplicationParameters",
                   {XmlRpcValue{XmlRpcValue::Struct{{name, value}}}});
  };
  EXPECT_EQ(temporary("imager_001/ExposureTime", 6000), 0);
  EXPECT_EQ(source("exposure_us"), 6000.0);
  EXPECT_EQ(temporary("imager_001/ExposureTime", 50'000), 0);
  EXPECT_EQ(source("exposure_us"), 10'000.0) << "the most that the camera takes";
  EXPECT_EQ(temporary("imager_001/FrameRate", 5), Fault::kNoSuchParameter);
  EXPECT_EQ(temporary("ExposureTime", 5), Fault::kNoSuchParameter);
  EXPECT_EQ(faultOf("", "setTemporaryApplicationParameters", {5}), Fault::kWrongType);
  call("", "setOperatingMode", {1});
  EXPECT_EQ(source("exposure_us"), 1000.0);
  call("", "setOperatingMode", {0});
  EXPECT_EQ(temporary("imager_001/ExposureTime", 6000), 0);
  end();
  EXPECT_EQ(source("exposure_us"), 1000.0);
}

// ---- the device ----------------------------------------------------------------------------------

TEST_F(O3d303Configuration, TheDeviceHasTheRealOnesParameters) {
  const Parameters parameters = all("/");
  EXPECT_EQ(parameters.size(), 34u);
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
                             {"ExtrinsicCalibRotX", "5", Fault::kReadOnly},
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
  EXPECT_EQ(all("/").at("Name"), "test") << "not saved yet";
  call("edit/device/", "save");
  end();
  EXPECT_EQ(all("/").at("Name"), "ifm3d unit test");
  EXPECT_EQ(all("/").at("IODebouncing"), "false");
  EXPECT_EQ(device_.translation_mm()[0], 12.5F);
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
  EXPECT_FALSE(device_.isSynchronised()) << "not saved yet";
  call(time, "saveAndActivateConfig");
  EXPECT_TRUE(device_.isSynchronised());
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
