// SPDX-License-Identifier: Apache-2.0
// What the vendor's SDK calls and expects, by its public tests: the same calls, and what they come to.
// Without a network; the source is a table of parameters. Here: applications and their imagers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "o3d303_configuration.h"

namespace toftwin::daemon::o3d303 {
namespace {

using testing::ElementsAre;
using testing::Pair;
using testing::SizeIs;
using testing::UnorderedElementsAre;

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
                                          "Type", "LogicGraph", "RtspOverlayStyle"));
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
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ContinuousAutoExposure", "maybe"}), Fault::kWrongType);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"AutoExposureReferenceROI", "{}"}), Fault::kWrongFormat);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"TwoFreqMaxLineDistPercentage", "101"}), Fault::kOutOfRange);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"Resolution", "1"}), Fault::kOutOfRange)
      << "the source has 176 columns";
  EXPECT_EQ(faultOf(kApplication, "setParameter", {"TriggerMode", "6"}), Fault::kOutOfRange);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"Channel", "1"}), Fault::kReadOnly) << "this source has none";
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ExposureTimeRatio", "5"}), Fault::kNoSuchParameter)
      << "of one exposure";
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ClippingLeft", "176"}), Fault::kOutOfRange);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ClippingLeft", "8.5"}), Fault::kWrongType);
  EXPECT_EQ(faultOf(kImager, "setParameter", {"ClippingLeft", "8.0"}), 0);
  EXPECT_EQ(call(kImager, "getParameter", {"ClippingLeft"}).text(), "8") << "as it acts";
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

}  // namespace
}  // namespace toftwin::daemon::o3d303
