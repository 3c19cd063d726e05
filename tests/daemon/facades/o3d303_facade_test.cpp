// SPDX-License-Identifier: Apache-2.0
// The O3D303 facade in a running daemon, with our own driver and with bare sockets as its clients.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <thread>

#include <boost/property_tree/json_parser.hpp>

#include "facade_testing.h"
#include "o3d303_client.h"

namespace toftwin::daemon {
namespace {

using namespace std::chrono_literals;
using namespace test;
using o3d303::XmlRpcValue;
using testing::HasSubstr;

class O3d303Facade : public RunningFacade {
 protected:
  O3d303Client camera() { return O3d303Client{xmlrpc_}; }
  bool answers() { return camera().tryCall("", "getParameter", {"DeviceType"}); }
};

TEST_F(O3d303Facade, AppliesWhatADriverSetsToTheSimulatedCamera) {
  startO3d303(kSmallSim);
  auto driver = openDriver("trigger = 'free_run'\nexposure_us = 700\nframe_rate_hz = 12.5");
  ASSERT_TRUE(driver.ok()) << driver.error().message;
  const auto native = client().describe("cam");
  ASSERT_TRUE(native.ok());
  const auto valueOf = [&](const SourceDetails& of, std::string_view name) {
    for (const Parameter& one : of.parameters) {
      if (one.name == name) return one.value.value_or(-1.0);
    }
    return -2.0;
  };
  EXPECT_EQ(valueOf(*native, "exposure_us"), 700.0);
  EXPECT_EQ(valueOf(*native, "frame_rate_hz"), 12.5);
  EXPECT_NEAR(native->frame_interval->in(millisecond), 80.0, 1e-9);
  ASSERT_TRUE((*driver)->setParameter("exposure_us", 900.0).ok());
  EXPECT_EQ(valueOf(*client().describe("cam"), "exposure_us"), 900.0);
  ASSERT_TRUE((*driver)->start().ok());
  const auto frame = nextFrame(**driver);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_EQ(frame->moment.exposures.at(0).duration, 900_us) << "the frame says it, too";
}

TEST_F(O3d303Facade, RefusesWithTheDevicesOwnNumbers) {
  startO3d303(kSmallSim);
  auto rpc = camera();
  EXPECT_EQ(rpc.fault("", "getParameter", {"Nonsense"}), 101'000);
  EXPECT_EQ(rpc.fault("session_0123456789abcdef0123456789abcdef/", "heartbeat", {300}), 100'000);
  EXPECT_EQ(rpc.fault("", "requestSession", {"", "no id"}), 101'010);
  rpc.beginSession();
  EXPECT_EQ(rpc.fault("", "requestSession", {"", rpc.kSession}), 101'004);
  EXPECT_EQ(rpc.fault(rpc.session("edit/"), "editApplication", {1}), 100'000) << "not in edit mode";
  rpc.call(rpc.session(""), "setOperatingMode", {1});
  EXPECT_EQ(rpc.fault(rpc.session("edit/"), "editApplication", {7}), 101'013);
  EXPECT_EQ(rpc.fault(rpc.session("edit/"), "createApplication", {"Nonsense"}), 101'028);
  EXPECT_EQ(rpc.fault(rpc.session("edit/application/"), "save", {}), 101'016);
  rpc.call(rpc.session("edit/"), "editApplication", {1});
  const std::string imager = rpc.session("edit/application/imager_001/");
  EXPECT_EQ(rpc.fault(imager, "setParameter", {"Nonsense", "1"}), 101'000);
  EXPECT_EQ(rpc.fault(imager, "setParameter", {"ExposureTime", "soon"}), 101'001);
  EXPECT_EQ(rpc.fault(imager, "setParameter", {"ExposureTime", "12.5"}), 101'001);
  EXPECT_EQ(rpc.fault(imager, "setParameter", {"ExposureTime", "30000"}), 101'002);
  EXPECT_EQ(rpc.fault(imager, "setParameter", {"Channel", "1"}), 101'003);
  EXPECT_EQ(rpc.fault(imager, "changeType", {"farther_high"}), 101'027);
  EXPECT_EQ(rpc.fault(rpc.session("edit/application/"), "setParameter", {"PcicTcpResultSchema", "{}"}),
            101'010);
  EXPECT_EQ(rpc.fault(imager, "setParameter", {"Channel", "0"}), 0) << "what it is already";
}

TEST_F(O3d303Facade, WhatTheSourceRefusesAtTheEndIsRefusedToo) {
  startO3d303(kSmallSim);
  auto rpc = camera();
  rpc.edit();
  // 36 exposures with 1 ms after each do not fit into 33 ms, which only the source knows.
  EXPECT_EQ(rpc.fault(rpc.imager(), "setParameter", {"ExposureTime", "100"}), 0);
  EXPECT_EQ(rpc.fault(rpc.imager(), "changeType", {"morethan30m_high"}), 0);
  EXPECT_EQ(rpc.fault(rpc.imager(), "setParameter", {"FrameRate", "30"}), 0);
  EXPECT_EQ(rpc.fault(rpc.session("edit/application/"), "setParameter", {"Name", "another"}), 0);
  EXPECT_EQ(rpc.fault(rpc.session("edit/application/"), "save", {}), 101'002);
  rpc.endSession();
  rpc.edit();
  EXPECT_EQ(rpc.call(rpc.imager(), "getParameter", {"ExposureTime"}).text(), "1000");
  EXPECT_EQ(rpc.call(rpc.imager(), "getParameter", {"FrameRate"}).text(), "20") << "none of it, or all";
  EXPECT_NE(rpc.call(rpc.session("edit/application/"), "getParameter", {"Name"}).text(), "another");
}

TEST_F(O3d303Facade, WhatIsPossibleOnlyTogetherIsSetTogether) {
  startO3d303(kSmallSim);
  auto rpc = camera();
  rpc.edit();
  // 4 exposures of 10 ms fit into a slower frame only, which comes later in the list.
  rpc.call(rpc.imager(), "setParameter", {"FrameRate", "25"});
  rpc.call(rpc.imager(), "setParameter", {"ExposureTime", "9000"});
  rpc.call(rpc.session("edit/application/"), "save", {});
  rpc.call(rpc.imager(), "setParameter", {"ExposureTime", "10000"});
  rpc.call(rpc.imager(), "setParameter", {"FrameRate", "10"});
  rpc.call(rpc.session("edit/application/"), "save", {});
  EXPECT_EQ(rpc.call(rpc.imager(), "getParameter", {"ExposureTime"}).text(), "10000");
}

TEST_F(O3d303Facade, FilesThatAreNotThereAreNotFound) {
  startO3d303(kPattern);
  for (const char* method : {"GET", "HEAD", "PUT"}) {
    RawHttp http{xmlrpc_};
    http.send(fmt::format("{} /firmware.swu HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n", method));
    EXPECT_THAT(http.receiveAll(),
                testing::StartsWith(std::string_view{method} == "PUT" ? "HTTP/1.1 405" : "HTTP/1.1 404"));
  }
  RawHttp http{xmlrpc_};
  const std::string body = encodeXmlRpc(o3d303::XmlRpcCall{"upload", {}});
  http.send(
      fmt::format("POST /upload HTTP/1.1\r\nHost: localhost\r\nContent-Type: text/xml\r\nConnection: close\r\nContent-Length: {}\r\n\r\n{}",
                  body.size(), body));
  EXPECT_THAT(http.receiveAll(), HasSubstr("100000"));
}

TEST_F(O3d303Facade, SessionsEndWithoutHeartbeatAndWhatWasTemporaryIsUndone) {
  startO3d303(kSmallSim);
  auto rpc = camera();
  rpc.beginSession();
  EXPECT_EQ(rpc.call(rpc.session(""), "heartbeat", {1}).text(), "5") << "the least that the camera grants";
  rpc.call(rpc.session(""), "setTemporaryApplicationParameters",
           {XmlRpcValue{XmlRpcValue::Struct{{"imager_001/ExposureTime", "800"}}}});
  const auto exposure = [&] { return client().describe("cam")->parameters.at(0).value.value_or(0.0); };
  EXPECT_NEAR(exposure(), 800.0, 1e-6);  // it goes through seconds
  EXPECT_TRUE(eventually([&] { return std::abs(exposure() - 1000.0) < 1e-6; }));
  EXPECT_EQ(rpc.fault(rpc.session(""), "heartbeat", {5}), 100'000);
}

TEST_F(O3d303Facade, EveryConnectionHasASchemaOfItsOwn) {
  startO3d303(kPattern);
  PcicClient distance{camera().pcicPort()}, confidence{camera().pcicPort()}, none{camera().pcicPort()};
  EXPECT_EQ(none.command("p6"), "*");
  EXPECT_EQ(distance.setSchema({o3d303::kDistanceBlob}), "*");
  EXPECT_EQ(confidence.setSchema({o3d303::kConfidenceBlob, o3d303::kUnitVectorsBlob}), "*");
  const auto first = distance.frame(), second = confidence.frame();
  EXPECT_NE(first.find(o3d303::ChunkType::RadialDistance), nullptr);
  EXPECT_EQ(first.find(o3d303::ChunkType::Confidence), nullptr);
  EXPECT_EQ(second.find(o3d303::ChunkType::RadialDistance), nullptr);
  EXPECT_NE(second.find(o3d303::ChunkType::UnitVectors), nullptr);
  EXPECT_EQ(none.framesSoFar(), 0);
  EXPECT_EQ(distance.command("c000000002{}"), "!");
  EXPECT_EQ(distance.command("xyz"), "?");
  EXPECT_THAT(distance.command("C?"), HasSubstr("distance_image"));
  EXPECT_EQ(distance.command("V?"), "03 01 04");
}

TEST_F(O3d303Facade, TheModelOfAFrameIsJson) {
  startO3d303(kPattern);
  PcicClient one{camera().pcicPort()};
  EXPECT_EQ(one.setSchema({o3d303::kAmplitudeBlob, o3d303::kJsonBlob}), "*");
  const auto frame = one.frame();
  const auto* model = frame.find(o3d303::ChunkType::Json);
  ASSERT_NE(model, nullptr);
  EXPECT_EQ(model->header.format, o3d303::ElementFormat::U8);
  EXPECT_EQ(model->header.width * model->header.height, model->data.size());
  std::istringstream text{std::string{o3d303::textOf(model->data)}};
  boost::property_tree::ptree json;
  boost::property_tree::read_json(text, json);
  EXPECT_EQ(json.get<std::uint32_t>("FrameCount"), model->header.frame_count);
}

// A real camera's message of these images at 176 x 132 was measured to be 209414 bytes behind its first line,
// the ticket and the line end among them.
TEST_F(O3d303Facade, AFrameIsAsLongAsTheRealCameras) {
  startO3d303(kSmallSim);
  o3d303::Schema schema{o3d303::SchemaElement::text("start_string", "star")};
  for (const auto blob : {o3d303::kAmplitudeBlob, o3d303::kXBlob, o3d303::kYBlob, o3d303::kZBlob,
                          o3d303::kConfidenceBlob, o3d303::kExtrinsicsBlob}) {
    schema.push_back(o3d303::SchemaElement::blob(blob));
  }
  schema.push_back(o3d303::SchemaElement::text("end_string", "stop"));
  PcicClient one{camera().pcicPort()};
  EXPECT_EQ(one.command(o3d303::schemaCommand(toJson(schema))), "*");
  one.forgetFrames();
  EXPECT_EQ(one.nextOf("0000").size() + 4 + 2, 209'414u);
}

TEST_F(O3d303Facade, ATriggerGivesAllConnectionsTheSameBytesOnce) {
  startO3d303(kSmallSim + "pace = 'trigger'\n");
  PcicClient asks{camera().pcicPort()}, listens{camera().pcicPort()};
  for (auto* one : {&asks, &listens}) EXPECT_EQ(one->setSchema({o3d303::kDistanceBlob}), "*");
  EXPECT_EQ(asks.command("t"), "*");
  const auto frame = asks.nextOf("0000"), same = listens.nextOf("0000");
  EXPECT_EQ(frame, same);
  EXPECT_GT(frame.size(), 176u * 132u * 2u);
}

TEST_F(O3d303Facade, InFreeRunATriggerIsRefusedAndTheErrorTold) {
  startO3d303(kPattern);
  PcicClient asks{camera().pcicPort()};
  EXPECT_EQ(asks.command("p6"), "*");
  EXPECT_EQ(asks.command("t"), "!");
  EXPECT_EQ(asks.nextOf("0001"), "100001000");
  EXPECT_EQ(asks.command("E?"), "100001000");
}

TEST_F(O3d303Facade, ATriggerBeforeTheLastOnesFrameIsAnError) {
  // The light of the first frame takes longer than the second command.
  startO3d303("driver = 'sim'\nuri = 'sim:o3d303_binned'\npace = 'trigger'\nsamples_per_pixel = 64\n");
  PcicClient asks{camera().pcicPort()}, listens{camera().pcicPort()};
  EXPECT_EQ(asks.command("t"), "*");
  EXPECT_EQ(asks.command("t"), "!");
  EXPECT_EQ(listens.nextOf("0001"), "110001006");
}

TEST_F(O3d303Facade, ATriggerBeforeALateFrameHasLeftIsAnError) {
  startO3d303(kPattern + "pace = 'trigger'\n", "latency_ms = 2000");
  auto native = client();
  auto stream = native.subscribe("cam");
  ASSERT_TRUE(stream.ok()) << stream.error().message;
  PcicClient asks{camera().pcicPort()};
  EXPECT_EQ(asks.command("t"), "*");
  ASSERT_TRUE(stream->next(kSoon).ok()) << "the source has made it";
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(asks.command("t"), "!") << "but the camera has not";
  asks.nextOf("0000");
  EXPECT_EQ(asks.command("t"), "*");
}

TEST_F(O3d303Facade, TheSeventeenthConnectionIsRefusedAndTheOthersAreTold) {
  startO3d303(kPattern);
  const auto port = camera().pcicPort();
  std::deque<PcicClient> all;
  for (int i = 0; i < 16; ++i) EXPECT_EQ(all.emplace_back(port).command("P2"), "?");
  PcicClient one_too_many{port};
  EXPECT_EQ(all.front().nextOf("0001"), "100000001");
  EXPECT_TRUE(one_too_many.isClosedByPeer());
}

TEST_F(O3d303Facade, TheOutputIsAHexadecimalDigitInEitherCase) {
  startO3d303(kPattern);
  PcicClient one{camera().pcicPort()};
  for (const char* good : {"p0", "p7", "pf", "pF", "pA"}) EXPECT_EQ(one.command(good), "*") << good;
  for (const char* bad : {"p", "pg", "p-", "p+", "p17"}) EXPECT_EQ(one.command(bad), "!") << bad;
}

TEST_F(O3d303Facade, ADriverSwitchesItToTriggersAndBack) {
  startO3d303(kSmallSim);
  auto driver = openDriver("trigger = 'software'");
  ASSERT_TRUE(driver.ok()) << driver.error().message;
  ASSERT_TRUE((*driver)->info().can_trigger);
  ASSERT_TRUE((*driver)->start().ok());
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE((*driver)->trigger().ok());
    ASSERT_TRUE(nextFrame(**driver).ok());
  }
  EXPECT_TRUE(client().describe("cam")->can_trigger);
  auto free = openDriver("trigger = 'free_run'");
  ASSERT_TRUE(free.ok()) << free.error().message;
  EXPECT_FALSE(client().describe("cam")->can_trigger);
}

TEST_F(O3d303Facade, ClientsThatEditStopTheFramesAndSavingNotifiesTheOthers) {
  startO3d303(kPattern);
  PcicClient watches{camera().pcicPort()};
  auto rpc = camera();
  rpc.edit();
  rpc.call(rpc.session("edit/application/"), "setParameter", {"Name", "dock"});
  rpc.call(rpc.session("edit/application/"), "save", {});
  EXPECT_THAT(watches.nextOf("0010"), testing::StartsWith("000500000:{"));
  watches.forgetFrames();
  std::this_thread::sleep_for(200ms);  // ten frame intervals
  watches.command("V?");
  EXPECT_LE(watches.framesSoFar(), 1) << "one may have been on its way";
  rpc.endSession();
  watches.frame();
}

TEST_F(O3d303Facade, AStalledClientHoldsUpNobody) {
  startO3d303(kPattern);
  PcicClient stalled{camera().pcicPort()}, lively{camera().pcicPort()};
  stalled.sendBytes("1000L00");  // and never more; nor does it read
  RawHttp half{xmlrpc_};
  half.send("POST /api/rpc/v1/com.ifm.efector/ HTTP/1.1\r\nContent-Le");
  EXPECT_EQ(lively.setSchema({o3d303::kDistanceBlob}), "*");
  std::int64_t last = -1;
  for (int i = 0; i < 100; ++i) {
    const auto frame = lively.frame();
    const std::int64_t count = frame.find(o3d303::ChunkType::RadialDistance)->header.frame_count;
    EXPECT_GT(count, last);
    last = count;
  }
  EXPECT_EQ(camera().call("", "getParameter", {"DeviceType"}).text(), "1:2");
}

TEST_F(O3d303Facade, ARebootDropsEveryoneAndComesBack) {
  const auto begin = std::chrono::steady_clock::now();
  startO3d303(kSmallSim + "powered_on_before_s = 3600\n", "boot_time_s = 1");
  ASSERT_TRUE(eventually([&] { return answers(); }));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 1s) << "it boots at the start, too";
  const auto up_s = [&] { return std::stod(camera().call("", "getParameter", {"UpTime"}).text()) * 3600.0; };
  EXPECT_GE(up_s(), 1.0) << "the boot is part of it";
  EXPECT_LT(up_s(), static_cast<double>(kSoon.count())) << "and the hour of the source is not";
  PcicClient connected{camera().pcicPort()};
  auto native = client();
  const auto state = [&] {
    const auto health = native.health();
    return health.ok() && health->facades.size() == 1 ? health->facades.front().state : FacadeState::NotThere;
  };
  EXPECT_EQ(state(), FacadeState::Running);
  auto rpc = camera();
  rpc.beginSession();
  rpc.call("", "reboot", {0});
  EXPECT_TRUE(connected.isClosedByPeer());
  EXPECT_EQ(state(), FacadeState::Booting) << "nobody answers there";
  EXPECT_TRUE(eventually([&] { return answers(); }));
  EXPECT_TRUE(eventually([&] { return state() == FacadeState::Running; }));
  EXPECT_LT(up_s(), static_cast<double>(kSoon.count()))
      << "from the boot on, not from when the source was switched on";
  EXPECT_EQ(rpc.fault(rpc.session(""), "heartbeat", {5}), 100'000) << "the session is gone";
}

TEST_F(O3d303Facade, WhoConnectsWhileItBootsIsAnsweredAfterwards) {
  startO3d303(kPattern, "boot_time_s = 1");
  ASSERT_TRUE(eventually([&] { return answers(); }));
  auto rpc = camera();
  PcicClient connected{rpc.pcicPort()};
  rpc.call("", "reboot", {0});
  EXPECT_TRUE(connected.isClosedByPeer()) << "now it boots";
  EXPECT_EQ(rpc.call("", "getParameter", {"DeviceType"}).text(), "1:2");
  PcicClient{rpc.pcicPort()}.frame();
}

TEST_F(O3d303Facade, HealthSaysWhereItIsAndHowManyClientsItHas) {
  startO3d303(kPattern);
  auto native = client();
  const auto told = [&] {
    const auto health = native.health();
    EXPECT_TRUE(health.ok() && health->facades.size() == 1);
    return health.ok() && !health->facades.empty() ? health->facades.front() : FacadeHealthEntry{};
  };
  const FacadeHealthEntry now = told();
  EXPECT_EQ(now.kind, "o3d303");
  EXPECT_EQ(now.source, "cam");
  EXPECT_EQ(now.state, FacadeState::Running);
  EXPECT_NE(now.place.find(fmt::format("XML-RPC on 127.0.0.1 port {}", xmlrpc_)), std::string::npos)
      << now.place;
  EXPECT_EQ(now.problem, "");
  EXPECT_EQ(now.clients, 0u);
  {
    PcicClient one{camera().pcicPort()}, other{camera().pcicPort()};
    EXPECT_TRUE(eventually([&] { return told().clients == 2u; }));
  }
  EXPECT_TRUE(eventually([&] { return told().clients == 0u; }));
}

TEST_F(O3d303Facade, HealthSaysThatItBoots) {
  startO3d303(kPattern, "boot_time_s = 600");
  const auto health = client().health();
  ASSERT_TRUE(health.ok()) << health.error().message;
  ASSERT_EQ(health->facades.size(), 1u);
  EXPECT_EQ(health->facades.front().state, FacadeState::Booting);
  EXPECT_EQ(health->facades.front().place, "");
  EXPECT_EQ(health->facades.front().clients, std::nullopt);
  EXPECT_EQ(health->sources.at(0).last_error, "") << "which would be a fault";
}

TEST_F(O3d303Facade, TheTemperatureOfASimulatedCameraCanBeWatchedWarmingUp) {
  startO3d303(kSmallSim + "powered_on_before_s = 156\n", "most_illumination_c = 20");
  PcicClient watches{camera().pcicPort()};
  EXPECT_EQ(watches.nextOf("0001"), "110004000") << "hotter than 20 degrees";
  PcicClient comes_later{camera().pcicPort()};
  EXPECT_EQ(comes_later.nextOf("0001"), "110004000") << "which it still is";
  const auto all = camera().call("", "getAllParameters", {});
  // The preset's own source: 28.6 degrees 2.6 minutes after power-on; frames have taken some seconds more.
  EXPECT_NEAR(std::stod(all.textAt("TemperatureIllu")), 28.6, 0.5);
  EXPECT_NEAR(std::stod(all.textAt("UpTime")) * 3600.0, 156.0, 30.0);
}

TEST_F(O3d303Facade, AnotherSourceOfThatNameAfterAReloadIsShown) {
  startO3d303(kPattern);
  PcicClient watches{camera().pcicPort()};
  EXPECT_EQ(watches.frame().chunks.at(0).header.width, 64u);
  configure(
      fmt::format("[[source]]\nname = 'cam'\ndriver = 'pattern'\nwidth = 32\nheight = 16\n"
                  "[[facade]]\nkind = 'o3d303'\nsource = 'cam'\nxmlrpc_port = {}\npcic_port = 0\n"
                  "discoverable = false\ntiming = 'fast'\n",
                  xmlrpc_));
  daemon_->reload();
  EXPECT_TRUE(eventually([&] { return watches.frame().chunks.at(0).header.width == 32u; }));
  EXPECT_EQ(log_->count("facade o3d303 of cam: XML-RPC"), 1) << "the facade ran on";
}

TEST_F(O3d303Facade, APortInUseIsToldAndTriedAgainWhileTheDaemonServes) {
  boost::asio::io_context io;
  auto holder = std::make_unique<boost::asio::ip::tcp::acceptor>(
      io, boost::asio::ip::tcp::endpoint{boost::asio::ip::address_v4::loopback(), 0});
  const auto port = holder->local_endpoint().port();
  start(fmt::format(
      "[[source]]\nname = 'cam'\n{}[[facade]]\nkind = 'o3d303'\nsource = 'cam'\nxmlrpc_port = {}\n"
      "pcic_port = 0\ndiscoverable = false\n",
      kPattern, port));
  EXPECT_TRUE(log_->waitFor("is in use by", 1));
  auto native = client();
  const auto told = [&] {
    const auto health = native.health();
    return health.ok() && health->facades.size() == 1 ? health->facades.front() : FacadeHealthEntry{};
  };
  EXPECT_TRUE(eventually([&] { return told().state == FacadeState::NotThere; }));
  EXPECT_NE(told().problem.find("is in use by"), std::string::npos) << told().problem;
  holder.reset();
  EXPECT_TRUE(log_->waitFor("facade o3d303 of cam: XML-RPC", 1));
  EXPECT_TRUE(eventually([&] { return told().state == FacadeState::Running; }));
  EXPECT_EQ(told().problem, "");
  EXPECT_EQ(O3d303Client{port}.call("", "getParameter", {"DeviceType"}).text(), "1:2");
}

}  // namespace
}  // namespace toftwin::daemon
