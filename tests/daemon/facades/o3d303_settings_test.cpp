// SPDX-License-Identifier: Apache-2.0
// What clients set beyond a table of parameters: configurations of real cameras, how the camera slows down,
// what it chooses by itself. Without a network; the source is a table of parameters.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/property_tree/json_parser.hpp>

#include <set>
#include <string>
#include <vector>

#include "daemon/facades/ifm/request_check.h"
#include "measured_intervals.h"
#include "o3d303_configuration.h"

namespace toftwin::daemon::o3d303 {
namespace {

using Tree = boost::property_tree::ptree;

// ---- configurations of real cameras --------------------------------------------------------------

/// A published configuration, and what its client calls the camera in it.
struct Published {
  const char *file, *root;
};

class O3d303Published : public O3d303Configuration, public testing::WithParamInterface<Published> {
 protected:
  /// Sets all of them but those that clients take for read-only, as they do.
  void load(const std::string& object, const Tree& parameters, const std::set<std::string>& left_out) {
    for (const auto& [name, value] : parameters) {
      if (name == "Imager" || name.ends_with("Filter") || left_out.contains(name)) continue;  // objects
      if (call(object, "getParameter", {name}).text() == value.data()) continue;
      EXPECT_EQ(faultOf(object, "setParameter", {name, value.data()}), 0) << name << " = " << value.data();
    }
  }
  void expectSame(const std::string& object, const Tree& parameters, const std::set<std::string>& left_out) {
    const Parameters shown = all(object);
    for (const auto& [name, value] : parameters) {
      if (name == "Imager" || name.ends_with("Filter") || left_out.contains(name)) continue;
      ASSERT_TRUE(shown.contains(name)) << name << " is missing";
      EXPECT_EQ(shown.at(name), value.data()) << name;
    }
  }
};

TEST_P(O3d303Published, IsLoadedAndDumpedAgainAsItWas) {
  const auto file = test::measuredIntervals(GetParam().file);
  if (file.empty()) GTEST_SKIP() << "no ifm-frame-timing in $TOFTWIN_DATA or ../shared/data";
  Tree whole;
  boost::property_tree::read_json(file.string(), whole);
  const Tree& root = whole.get_child(GetParam().root);
  const Tree& application = root.get_child("Apps").front().second;
  const Tree& imager = application.get_child("Imager");
  const std::set<std::string> of_the_camera{"ArticleStatus",
                                            "DeviceType",
                                            "IPAddressConfig",
                                            "ImageTimestampReference",
                                            "OperatingMode",
                                            "Id",
                                            "Index",
                                            "PasswordActivated",
                                            "PcicTcpPort",
                                            "UpTime",
                                            "TemperatureFront1",
                                            "TemperatureIMX6",
                                            "TemperatureIllu"};
  editApplication();
  load("edit/device/", root.get_child("Device"), of_the_camera);
  load(kApplication, application, of_the_camera);
  call(kImager, "changeType", {imager.get<std::string>("Type")});
  load(kImager, imager, {"ExposureTimeList", "MaxAllowedLEDFrameRate"});
  call("edit/device/", "save");
  call(kApplication, "save");
  end();
  EXPECT_EQ(source("exposure_us"), imager.get<double>("ExposureTime"));
  EXPECT_EQ(source("frame_rate_hz"), imager.get<double>("FrameRate")) << "or as fast as exposures allow";
  editApplication();
  expectSame("/", root.get_child("Device"), of_the_camera);
  expectSame(kApplication, application, of_the_camera);
  expectSame(kImager, imager, {});
}

INSTANTIATE_TEST_SUITE_P(Dumps, O3d303Published,
                         testing::Values(Published{"ifm3d_o3d.json", "ifm3d"},
                                         Published{"libo3d3xx_camera-2000-30-8.json", "o3d3xx"},
                                         Published{"libo3d3xx_camera-3000-30-8.json", "o3d3xx"},
                                         Published{"libo3d3xx_camera-4000-25-8.json", "o3d3xx"},
                                         Published{"libo3d3xx_camera-5000-20-8.json", "o3d3xx"},
                                         Published{"libo3d3xx_camera-5000-5-8.json", "o3d3xx"}));

TEST_F(O3d303Configuration, TheFactorysSchemaAsksForDiagnosticData) {
  const auto schema = toftwin::o3d303::readSchema(dump(kApplication).at("PcicTcpResultSchema"));
  ASSERT_TRUE(schema.ok()) << schema.error().message;
  EXPECT_EQ(schema->size(), 9u);
  EXPECT_EQ(schema->at(7).id, "diagnostic_data");
}

// ---- applications --------------------------------------------------------------------------------

TEST_F(O3d303Configuration, AnApplicationIsMadeWithoutSayingItsType) {
  edit();
  EXPECT_EQ(call("edit/", "createApplication").text(), "2");
}

TEST_F(O3d303Configuration, AnApplicationIsNamedWithoutEditingIt) {
  edit();
  call("edit/", "changeNameAndDescription", {1, "Foo", "Bar"});
  const auto list = call("/", "getApplicationList");
  EXPECT_EQ(std::get<XmlRpcValue::Array>(list.value).at(0).textAt("Name"), "Foo");
  EXPECT_EQ(std::get<XmlRpcValue::Array>(list.value).at(0).textAt("Description"), "Bar");
  EXPECT_EQ(faultOf("edit/", "changeNameAndDescription", {7, "Foo", "Bar"}), Fault::kNoSuchApplication);
  EXPECT_EQ(faultOf("edit/", "changeNameAndDescription", {1, std::string(65, 'n'), ""}), Fault::kOutOfRange);
}

TEST_F(O3d303Configuration, TheProcessInterfaceActivatesAnApplicationUnlessWiresOrAClientDo) {
  edit();
  call("edit/", "createApplication");
  EXPECT_FALSE(device_.select(2).has_value()) << "a client edits";
  end();
  EXPECT_FALSE(device_.select(3).has_value()) << "there is none";
  ASSERT_TRUE(device_.select(2).has_value());
  EXPECT_EQ(device_.activeApplication(), 2);
  edit();
  call("edit/device/", "setParameter", {"IOExternApplicationSwitch", "1"});
  call("edit/device/", "save");
  end();
  EXPECT_FALSE(device_.select(1).has_value()) << "it is left to wires";
}

// ---- triggers ------------------------------------------------------------------------------------

TEST_F(O3d303Configuration, EdgesOfTheWireTriggerAndTheProcessInterfaceDoesNot) {
  for (const char* edge : {"3", "4", "5"}) {
    set(kApplication, "TriggerMode", edge);
    EXPECT_EQ(source("triggered"), 1.0) << edge;
    EXPECT_EQ(dump(kApplication).at("TriggerMode"), edge);
    EXPECT_FALSE(device_.isTriggeredByCommand()) << edge;
  }
  set(kApplication, "TriggerMode", "2");
  EXPECT_TRUE(device_.isTriggeredByCommand());
  set(kApplication, "TriggerMode", "1");
  EXPECT_EQ(source("triggered"), 0.0);
  EXPECT_FALSE(device_.isTriggeredByCommand());
}

// ---- what takes longer than the frames are apart -------------------------------------------------

/// 1 / (2 ms + 8 · 2 · (125 + 5000) µs) = 11.9 Hz with two frequencies; 23.2 Hz with one, as a published
/// configuration says.
TEST_F(O3d303Configuration, ExposuresThatTakeLongerThanTheFramesAreApartSlowTheCameraDown) {
  editApplication();
  call(kImager, "setParameter", {"FrameRate", "20"});
  call(kImager, "changeType", {"under5m_moderate"});
  call(kImager, "setParameter", {"ExposureTime", "5000"});
  EXPECT_EQ(all(kImager).at("MaxAllowedLEDFrameRate"), "23.2");
  call(kApplication, "save");
  EXPECT_EQ(source("frame_rate_hz"), 20.0) << "that is possible";
  call(kImager, "changeType", {"upto30m_moderate"});
  call(kApplication, "save");
  EXPECT_EQ(source("frame_rate_hz"), 11.9);
  EXPECT_EQ(all(kImager).at("FrameRate"), "20") << "it stays what was asked for";
  call(kImager, "setParameter", {"ExposureTime", "1000"});
  call(kApplication, "save");
  EXPECT_EQ(source("frame_rate_hz"), 20.0) << "nothing holds it up any more";
}

TEST_F(O3d303Configuration, ANativeClientsFrameRateIsShown) {
  source("frame_rate_hz") = 17.0;
  facts_.frame_rate_hz = 17.0;
  device_.update(facts_);
  EXPECT_EQ(dump(kImager).at("FrameRate"), "17");
}

TEST_F(O3d303Configuration, ATemporaryExposureSlowsTheCameraDownForAsLong) {
  set(kImager, "FrameRate", "20");
  begin();
  call("", "setTemporaryApplicationParameters",
       {XmlRpcValue{XmlRpcValue::Struct{{"imager_001/ExposureTime", 10'000}}}});
  EXPECT_EQ(source("frame_rate_hz"), 12.1) << "1 / (2 ms + 80 ms), cut off";
  end();
  EXPECT_EQ(source("frame_rate_hz"), 20.0);
  EXPECT_EQ(source("exposure_us"), 1000.0);
}

// ---- what the camera chooses by itself -----------------------------------------------------------

TEST_F(O3d303Configuration, AnAutomaticExposureLooksAtItsRegionAndKeepsTheFrameRate) {
  EXPECT_FALSE(device_.exposureControl().has_value());
  set(kImager, "FrameRate", "25");
  set(kImager, "ContinuousAutoExposure", "true");
  auto control = device_.exposureControl();
  ASSERT_TRUE(control.has_value());
  EXPECT_EQ(control->region, (ExposureRegion{23, 16, 153, 116})) << "the factory's";
  EXPECT_NEAR(control->bounds.most_us, 4750.0, 1e-6) << "(40 ms - 2 ms) / 8";
  set(kImager, "AutoExposureMaxExposureTime", "2000");
  EXPECT_EQ(device_.exposureControl()->bounds.most_us, 2000.0);
  set(kImager, "AutoExposureReferenceType", "1");
  set(kImager, "AutoExposureReferencePointX", "10");
  EXPECT_EQ(device_.exposureControl()->region, (ExposureRegion{9, 65, 11, 67}));
}

TEST(O3d303AutoExposure, GrowsUntilPixelsSaturateAndThenStays) {
  AutoExposure automatic;
  const auto shareAt = [](double us) { return us > 3000.0 ? 0.05 : us > 2800.0 ? 0.005 : 0.0; };
  double us = 100.0;
  int frames = 0;
  while (const auto next = automatic.next(us, shareAt(us), {})) {
    us = *next;
    ASSERT_LT(++frames, 60);
  }
  EXPECT_GT(us, 2800.0);
  EXPECT_LE(us, 3000.0);
}

TEST(O3d303AutoExposure, StaysWithinItsBounds) {
  AutoExposure automatic;
  EXPECT_EQ(automatic.next(1900.0, 0.0, {1.0, 2000.0}), 2000.0);
  EXPECT_EQ(automatic.next(2000.0, 0.0, {1.0, 2000.0}), std::nullopt);
  EXPECT_EQ(automatic.next(5000.0, 0.0, {1.0, 2000.0}), 2000.0);
  EXPECT_EQ(automatic.next(1.0, 1.0, {1.0, 2000.0}), std::nullopt);
}

TEST_F(O3d303Configuration, ResolutionHalvesTheRowsAndColumnsOfAFineSource) {
  facts_.width = 352;
  facts_.height = 264;
  device_.update(facts_);
  EXPECT_EQ(dump(kImager).at("Resolution"), "1");
  EXPECT_EQ(device_.binning(), std::nullopt);
  set(kImager, "Resolution", "0");
  EXPECT_EQ(device_.binning(), Binning::ByAmplitude);
  EXPECT_EQ(device_.clipping().right, 175) << "what reached to the edge does so still";
  set(kImager, "UseSimpleBinning", "true");
  EXPECT_EQ(device_.binning(), Binning::Simple);
  set(kImager, "Resolution", "1");
  EXPECT_EQ(device_.binning(), std::nullopt);
}

// ---- requests ------------------------------------------------------------------------------------

TEST(O3d303Requests, OfAWebPageAreRefused) {
  const std::vector<std::string> names{"camera.lan"};
  const auto status = [&](std::string_view host, std::string_view origin, std::string_view type) {
    return ifm::refusalOf({host, origin, type}, names).status;
  };
  EXPECT_EQ(status("127.0.0.1", "", "text/xml"), 0);
  EXPECT_EQ(status("192.168.0.69:80", "", "text/xml; charset=utf-8"), 0);
  EXPECT_EQ(status("[::1]:80", "", "Text/XML"), 0);
  EXPECT_EQ(status("localhost:8080", "", "application/xml"), 0);
  EXPECT_EQ(status("Camera.LAN", "", "text/xml"), 0);
  EXPECT_EQ(status("", "", "text/xml"), 0) << "no browser leaves it out";
  EXPECT_EQ(status("evil.example", "", "text/xml"), 403) << "a name that was made to lead here";
  EXPECT_EQ(status("127.0.0.1.evil.example", "", "text/xml"), 403);
  EXPECT_EQ(status("127.0.0.1", "http://evil.example", "text/xml"), 403);
  EXPECT_EQ(status("127.0.0.1", "null", "text/xml"), 403);
  for (const char* type :
       {"text/plain", "application/x-www-form-urlencoded", "multipart/form-data", "", "text/xmlish"})
    EXPECT_EQ(status("127.0.0.1", "", type), 415) << type;
}

}  // namespace
}  // namespace toftwin::daemon::o3d303
