// SPDX-License-Identifier: Apache-2.0
// The O3R facade in a running daemon, with bare sockets as its clients.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "drivers/o3r/wire/confidence.h"
#include "drivers/o3r/wire/head_frame.h"
#include "drivers/o3r/wire/numbers.h"
#include "facade_testing.h"
#include "o3d303_client.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using o3d303::ChunkType;
using o3d303::XmlRpcValue;
using testing::HasSubstr;
using Json = nlohmann::json;
using Policy = SubscribeOptions::Policy;

const std::string kTwoHeads =
    "[[source]]\nname = 'front'\n" + kSmallSim + "[[source]]\nname = 'rear'\n" + kPattern;

class O3rFacade : public RunningFacade {
 protected:
  void startO3r(const std::string& sources, const std::string& facade_keys) {
    xmlrpc_ = freePort();
    start(
        fmt::format("{}\n[[facade]]\nkind = 'o3r'\nxmlrpc_port = {}\npcic_port = 0\ndiagnostic_port = 0\n"
                    "discoverable = false\n{}\n",
                    sources, xmlrpc_, facade_keys));
  }
  void startTwoHeads(const std::string& keys = {}) {
    startO3r(kTwoHeads, "source = 'front'\nports = ['', '', 'front', 'rear']\n" + keys);
    EXPECT_TRUE(eventually([&] { return unit().tryCall("", "getParameter", {"DeviceType"}); }));
  }
  O3d303Client unit() { return O3d303Client{xmlrpc_}; }
  Json at(const std::string& pointer) {
    const auto answer = unit().call("", "get", {XmlRpcValue::Array{XmlRpcValue{pointer}}});
    return Json::parse(answer.text()).at(Json::json_pointer{pointer});
  }
  int set(const std::string& pointer, const Json& value) {
    Json tree;
    tree[Json::json_pointer{pointer}] = value;
    return unit().fault("", "set", {XmlRpcValue{tree.dump()}});
  }
  PcicClient connect(int port) {
    return PcicClient{at(fmt::format("/ports/port{}/data/pcicTCPPort", port)).get<std::uint16_t>()};
  }
  double parameterOf(const std::string& source, std::string_view name) {
    const auto described = client().describe(source);
    for (const Parameter& one : described->parameters) {
      if (one.name == name) return one.value.value_or(-1.0);
    }
    return -2.0;
  }
};

std::string askFor(std::initializer_list<std::string_view> blobs) {
  return o3d303::schemaCommand(toJson(o3r::schemaOf(blobs)));
}

TEST_F(O3rFacade, EveryPortHasItsSourcesImagesByDefault) {
  startTwoHeads();
  PcicClient front = connect(2), rear = connect(3);
  const auto of_front = front.frame(), of_rear = rear.frame();
  EXPECT_EQ(of_front.find(ChunkType::RadialDistance)->header.width, 176u);
  EXPECT_EQ(of_rear.find(ChunkType::RadialDistance)->header.width, 64u);
  for (const auto type : {ChunkType::Amplitude, ChunkType::Confidence, o3r::ChunkTypes::kTofInfo})
    EXPECT_NE(of_rear.find(type), nullptr);
  EXPECT_EQ(at("/ports/port2/info/features/resolution/width"), 176);
}

TEST_F(O3rFacade, AClientGetsWhatItsSchemaAsksFor) {
  startTwoHeads();
  PcicClient rear = connect(3);
  EXPECT_EQ(rear.command(askFor({o3r::kConfidenceBlob})), "*");
  rear.forgetFrames();
  const auto frame = rear.frame();
  ASSERT_EQ(frame.chunks.size(), 1u);
  EXPECT_EQ(frame.chunks[0].header.format, o3d303::ElementFormat::U16);
  EXPECT_EQ(rear.command(askFor({"nonsense"})), "!");
  EXPECT_EQ(rear.command("t"), "!") << "a head runs by itself";
}

TEST_F(O3rFacade, WhatIsSetIsTheSources) {
  startTwoHeads();
  EXPECT_EQ(set("/ports/port2/acquisition", {{"exposureLong", 700}, {"framerate", 12.5}}), 0);
  EXPECT_EQ(parameterOf("front", "exposure_us"), 700.0);
  EXPECT_EQ(parameterOf("front", "frame_rate_hz"), 12.5);
  ASSERT_TRUE(client().setParameter("front", "exposure_us", 900.0).ok());
  EXPECT_EQ(at("/ports/port2/acquisition/exposureLong"), 900) << "what another client sets is shown";
}

TEST_F(O3rFacade, WhereOneSourceRefusesNoneIsSet) {
  startO3r("[[source]]\nname = 'front'\n" + kSmallSim + "[[source]]\nname = 'rear'\n" + kSmallSim,
           "source = 'front'\nports = ['front', 'rear']\n");
  EXPECT_TRUE(eventually([&] { return unit().tryCall("", "getParameter", {"DeviceType"}); }));
  // Two frequencies take 10 ms eight times, which does not fit into 1/20 s: only the source knows that.
  ASSERT_TRUE(client().setParameter("rear", "frequencies", 2.0).ok());
  const Json tree = {{"ports",
                      {{"port0", {{"acquisition", {{"exposureLong", 800}}}, {"mode", "standard_range2m"}}},
                       {"port1", {{"acquisition", {{"exposureLong", 10'000}, {"framerate", 20}}}}}}}};
  ASSERT_NE(unit().fault("", "set", {XmlRpcValue{tree.dump()}}), 0);
  EXPECT_NEAR(parameterOf("front", "exposure_us"), 1000.0, 1e-6);  // it goes through seconds
  EXPECT_EQ(at("/ports/port0/mode"), "standard_range4m");
}

TEST_F(O3rFacade, AHeadThatIsIdleSendsNothingUntilItRuns) {
  startTwoHeads();
  PcicClient rear = connect(3);
  rear.frame();
  EXPECT_EQ(set("/ports/port3/state", "IDLE"), 0);
  EXPECT_EQ(rear.command("C?").substr(0, 4), "0000");
  rear.forgetFrames();
  EXPECT_EQ(rear.command("L?").substr(0, 1), "0");
  EXPECT_EQ(rear.framesSoFar(), 0);
  EXPECT_EQ(set("/ports/port3/state", "RUN"), 0);
  EXPECT_NE(rear.frame().find(ChunkType::RadialDistance), nullptr);
}

TEST_F(O3rFacade, AlgorithmMessagesComeToThoseWhoWantThem) {
  startTwoHeads();
  EXPECT_EQ(set("/ports/port3/data/algoDebugFlag", true), 0);
  PcicClient rear = connect(3);
  EXPECT_EQ(rear.command("p8"), "*");
  const std::string message = rear.nextOf("0020");
  EXPECT_TRUE(message.starts_with("star") && message.ends_with("stop"));
}

TEST_F(O3rFacade, AfterARebootItIsAsSaved) {
  startTwoHeads();
  EXPECT_EQ(set("/ports/port2/acquisition/exposureLong", 700), 0);
  unit().call("", "saveInit", {});
  EXPECT_EQ(set("/ports/port2/acquisition/exposureLong", 800), 0);
  PcicClient front = connect(2);
  unit().call("", "reboot", {});
  EXPECT_TRUE(front.isClosedByPeer());
  EXPECT_TRUE(eventually([&] { return at("/ports/port2/acquisition/exposureLong") == 700; }));
  EXPECT_EQ(parameterOf("front", "exposure_us"), 700.0);
}

TEST_F(O3rFacade, AWebPagesRequestIsRefused) {
  startTwoHeads();
  RawHttp http{xmlrpc_};
  http.send(
      "POST /api/rpc/v1/com.ifm.efector/ HTTP/1.1\r\nHost: 127.0.0.1\r\nOrigin: http://example.org\r\n"
      "Content-Type: text/xml\r\nConnection: close\r\nContent-Length: 0\r\n\r\n");
  EXPECT_THAT(http.receiveAll(), testing::StartsWith("HTTP/1.1 403"));
}

TEST_F(O3rFacade, ASourceThatIsNotThereIsAnErrorOfTheConfiguration) {
  configure(kTwoHeads + "[[facade]]\nkind = 'o3r'\nsource = 'front'\nports = ['front', 'nobody']\n");
  const auto started = Daemon::start(options());
  ASSERT_FALSE(started.ok());
  EXPECT_THAT(started.error().message, HasSubstr("nobody"));
}

// ---- one truth -----------------------------------------------------------------------------------

/// As the vendor's client makes a point of a head's numbers, in float.
std::array<float, 3> pointOf(const o3r::TofInfo& info, const std::array<float, 9>& r, std::uint16_t counts,
                             int u, int v) {
  if (counts == 0) return {};
  const float d = o3r::metresOf(counts, info.distance_resolution_m);
  const auto ray = o3r::rayOf(info.intrinsics, u, v);
  std::array<float, 3> point{};
  for (std::size_t i = 0; i < 3; ++i)
    point[i] = d * (r[3 * i] * ray[0] + r[3 * i + 1] * ray[1] + r[3 * i + 2] * ray[2]) +
               info.optic_to_user.translation_m[i];
  return point;
}

template <class T>
std::vector<T> pixelsOf(const o3d303::FrameContent& content, ChunkType type) {
  const auto* chunk = content.find(type);
  std::vector<T> pixels(chunk->data.size() / sizeof(T));
  std::memcpy(pixels.data(), chunk->data.data(), pixels.size() * sizeof(T));
  return pixels;
}

void expectSame(const Frame& native, const o3d303::FrameContent& through) {
  const auto info = o3r::readTofInfo(through.find(o3r::ChunkTypes::kTofInfo)->data);
  ASSERT_TRUE(info.ok()) << info.error().message;
  const auto distance = pixelsOf<std::uint16_t>(through, ChunkType::RadialDistance);
  const auto confidence = pixelsOf<std::uint16_t>(through, ChunkType::Confidence);
  const auto range_m = native.find(PlaneKind::Range)->as<float>();
  const auto flags = native.find(PlaneKind::Flags)->as<std::uint8_t>();
  ASSERT_EQ(distance.size(), range_m.size());
  const auto rotation = rotationOf(info->optic_to_user);
  std::size_t with_value = 0;
  for (std::size_t i = 0; i < range_m.size(); ++i) {
    const bool is_valid = (flags[i] & 1U) == 0 && range_m[i] < 10.0F;
    const double counts =
        std::round(static_cast<double>(range_m[i]) / static_cast<double>(info->distance_resolution_m));
    ASSERT_EQ(distance[i], is_valid ? static_cast<std::uint16_t>(counts) : 0) << i;
    ASSERT_EQ(o3r::flagsOf(confidence[i]), is_valid ? flags[i] : flags[i] | 1U) << i;
    if (!is_valid) continue;
    ++with_value;
    const auto u = static_cast<int>(i) % native.camera.width, v = static_cast<int>(i) / native.camera.width;
    const auto p = pointOf(*info, rotation, distance[i], u, v);
    const Vec3d ray = rayThroughPixel(native.camera, u, v).v;
    // Turned by a quarter about x: y becomes z, z becomes -y; half a count and float are lost.
    const double r = static_cast<double>(range_m[i]), most = 1e-4 + 1e-6 * r;
    ASSERT_NEAR(p[0], r * ray.x + 0.25, most);
    ASSERT_NEAR(p[1], -r * ray.z, most);
    ASSERT_NEAR(p[2], r * ray.y, most);
  }
  EXPECT_GT(with_value, range_m.size() / 2);
}

TEST_F(O3rFacade, FramesAreTheNativeOnesAfterTheDocumentedConversionWithTheirTimeStamps) {
  startTwoHeads();
  constexpr double kQuarter = 1.5707963267948966;
  ASSERT_EQ(set("/ports/port3/processing/extrinsicHeadToUser", {{"transX", 0.25}, {"rotX", kQuarter}}), 0);
  const auto stampOf = [](const Frame& frame) {
    const auto& moment = frame.moment;
    return moment.clock.uncertainty_ns >= 0
               ? moment.exposures.at(0).start.ns + moment.clock.host_minus_device_ns
               : moment.received.ns;
  };
  auto native_client = client();
  auto stream = native_client.subscribe("rear", {.policy = Policy::Queue, .queue = 64});
  ASSERT_TRUE(stream.ok()) << stream.error().message;
  Natives natives{*std::move(stream), stampOf};
  PcicClient rear = connect(3);
  int compared = 0;
  for (int i = 0; i < 60 && compared < 5; ++i) {
    const auto through = rear.frame();
    const auto& time = *through.find(ChunkType::Confidence)->header.time;
    const auto native = natives.at(std::int64_t{time.seconds} * 1'000'000'000 + time.nanoseconds);
    ASSERT_TRUE(native.ok()) << native.error().message;
    if (*native == nullptr) continue;
    ASSERT_NO_FATAL_FAILURE(expectSame(**native, through));
    ++compared;
  }
  EXPECT_EQ(compared, 5);
}

}  // namespace
}  // namespace toftwin::daemon
