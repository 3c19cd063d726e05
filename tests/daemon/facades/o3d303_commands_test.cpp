// SPDX-License-Identifier: Apache-2.0
// The process interface's commands and the HTTP port's manners, at a running facade.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cstring>
#include <string>

#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>

#include "facade_testing.h"
#include "o3d303_client.h"

namespace toftwin::daemon {
namespace {

using namespace test;
using testing::HasSubstr;
using testing::StartsWith;
using toftwin::o3d303::schemaOf;

class O3d303Commands : public RunningFacade {
 protected:
  O3d303Client camera() { return O3d303Client{xmlrpc_}; }
  static std::uint32_t wordAt(const std::string& bytes, std::size_t at) {
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data() + at, sizeof word);
    return word;
  }
};

TEST_F(O3d303Commands, AnImageIsLengthAndChunk) {
  startO3d303(kPattern);
  PcicClient one{camera().pcicPort()};
  one.frame();
  constexpr std::uint32_t kChunkTypes[] = {103, 101, 100, 200, 201, 202, 300, 400, 223};
  for (std::size_t i = 0; i < std::size(kChunkTypes); ++i) {
    const std::string answer = one.command(fmt::format("I{:02}?", i + 1));
    ASSERT_GT(answer.size(), 9u + 48u) << i + 1;
    EXPECT_EQ(std::stoul(answer.substr(0, 9)), answer.size() - 9);
    EXPECT_EQ(wordAt(answer, 9), kChunkTypes[i]);
  }
  const std::string points = one.command("I11?");
  EXPECT_EQ(points.size(), 9u + 3u * (48u + 64u * 48u * 2u)) << "X, Y and Z";
  EXPECT_EQ(one.command("I12?"), "!");
  EXPECT_EQ(one.command("I1?"), "?") << "another length";
}

TEST_F(O3d303Commands, TheLastResultIsAsTheConnectionWantsItWithoutStarAndStop) {
  startO3d303(kPattern);
  PcicClient one{camera().pcicPort()};
  EXPECT_EQ(one.command("I10?"), "!") << "none was sent yet";
  ASSERT_EQ(one.setSchema({toftwin::o3d303::kConfidenceBlob}), "*");
  one.frame();
  const std::string answer = one.command("I10?");
  EXPECT_EQ(wordAt(answer, 9), 300u) << "the chunk comes first";
  EXPECT_FALSE(answer.ends_with("stop"));
}

TEST_F(O3d303Commands, ASynchronousTriggerIsAnsweredByItsFrame) {
  startO3d303(kSmallSim + "pace = 'trigger'\n");
  PcicClient asks{camera().pcicPort()}, listens{camera().pcicPort()};
  ASSERT_EQ(asks.setSchema({toftwin::o3d303::kDistanceBlob}), "*");
  const std::string answer = asks.command("T?");
  ASSERT_GT(answer.size(), 100u) << answer;
  EXPECT_EQ(wordAt(answer, 0), 100u) << "without star";
  listens.frame();
  EXPECT_EQ(asks.framesSoFar(), 0) << "it does not come once more";
}

TEST_F(O3d303Commands, NoFrameIsTriggeredInFreeRun) {
  startO3d303(kSmallSim);
  PcicClient one{camera().pcicPort()};
  EXPECT_EQ(one.command("T?"), "!");
  EXPECT_EQ(one.command("t"), "!");
}

TEST_F(O3d303Commands, ApplicationsAreActivated) {
  startO3d303(kSmallSim);
  auto rpc = camera();
  rpc.edit();
  rpc.call(rpc.session("edit/"), "createApplication", {});
  rpc.endSession();
  PcicClient one{rpc.pcicPort()};
  EXPECT_EQ(one.command("a02"), "*");
  EXPECT_EQ(one.command("A?"), "002\t02\t01\t02");
  EXPECT_EQ(one.command("a07"), "!");
  EXPECT_EQ(one.command("a2"), "?");
  EXPECT_EQ(one.command("axx"), "!");
}

TEST_F(O3d303Commands, FramesAreCountedSinceTheApplicationIsActive) {
  startO3d303(kPattern);
  PcicClient one{camera().pcicPort()};
  one.frame();
  const std::string counts = one.command("S?");
  ASSERT_EQ(counts.size(), 32u);
  EXPECT_GE(std::stoul(counts.substr(0, 10)), 1u);
  EXPECT_EQ(counts.substr(0, 10), counts.substr(11, 10));
  EXPECT_EQ(counts.substr(22), "0000000000") << "an application of type Camera finds nothing bad";
}

TEST_F(O3d303Commands, OutputsKeepTheirStateForAllConnections) {
  startO3d303(kPattern);
  PcicClient one{camera().pcicPort()}, other{camera().pcicPort()};
  EXPECT_EQ(one.command("O01?"), "010");
  EXPECT_EQ(one.command("o011"), "*");
  EXPECT_EQ(other.command("O01?"), "011");
  EXPECT_EQ(other.command("O02?"), "020");
  EXPECT_EQ(one.command("o031"), "!") << "the camera has two";
  EXPECT_EQ(one.command("o012"), "!");
}

TEST_F(O3d303Commands, ConnectionsHaveNumbers) {
  startO3d303(kPattern);
  PcicClient one{camera().pcicPort()}, other{camera().pcicPort()};
  EXPECT_EQ(one.command("L?"), "001");
  EXPECT_EQ(other.command("L?"), "002");
}

TEST_F(O3d303Commands, TheDeviceIsToldInTheManualsFields) {
  startO3d303(kPattern, "name = 'dock'");
  const std::string text = PcicClient{camera().pcicPort()}.command("G?");
  EXPECT_THAT(text,
              StartsWith("IFM ELECTRONIC\tO3D303\tdock\t\t\t127.0.0.1\t255.255.255.0\t192.168.0.201\t"));
  EXPECT_THAT(text, testing::EndsWith(fmt::format("\t0\t{}", xmlrpc_)));
}

TEST_F(O3d303Commands, EveryCommandOfTheListIsKnown) {
  startO3d303(kPattern);
  PcicClient one{camera().pcicPort()};
  EXPECT_THAT(one.command("H?"), StartsWith("H? - "));
  EXPECT_EQ(one.command("v03"), "*");
  EXPECT_EQ(one.command("v05"), "!") << "there is none";
  EXPECT_EQ(one.command("V?"), "03 01 04");
  EXPECT_EQ(one.command("D?"), "?");
}

TEST_F(O3d303Commands, AConnectionCanSpeakAnotherVersion) {
  startO3d303(kPattern);
  boost::asio::io_context io;
  boost::asio::ip::tcp::socket terminal{io};
  terminal.connect({boost::asio::ip::address_v4::loopback(), camera().pcicPort()});
  const auto exchange = [&](std::string_view bytes, std::string_view answer) {
    boost::asio::write(terminal, boost::asio::buffer(bytes.data(), bytes.size()));
    std::string came(answer.size(), '\0');
    boost::asio::read(terminal, boost::asio::buffer(came));
    EXPECT_EQ(came, answer);
  };
  exchange("1000L000000008\r\n1000p0\r\n", "1000L000000007\r\n1000*\r\n");
  exchange("1000L000000009\r\n1000v02\r\n", "1000L000000007\r\n1000*\r\n");
  exchange("1234V?\r\n", "123402 01 04\r\n");
  exchange("1234v01\r\n", "1234*\r\n");
  exchange("V?\r\n", "01 01 04\r\n");
  exchange("v04\r\n", "*\r\n");
  exchange("V?\r\n", "L000000010\r\n04 01 04\r\n");
}

TEST_F(O3d303Commands, TheSchemaComesBackAsItWasWritten) {
  startO3d303(kPattern);
  PcicClient one{camera().pcicPort()};
  const std::string schema =
      R"({ "layouter": "flexible", "format": { "dataencoding": "ascii" }, "elements": [ { "type": "float32", "id": "temp_illu", "format": { "width": 7, "precision": 1, "fill": "_", "alignment": "left", "decimalseparator": "," } } ] })";
  ASSERT_EQ(one.command(toftwin::o3d303::schemaCommand(schema)), "*");
  EXPECT_EQ(one.command("C?"), fmt::format("{:09}{}", schema.size(), schema));
  one.forgetFrames();
  EXPECT_EQ(one.nextOf("0000"), "3276,7_") << "the pattern has no thermometer";
}

TEST_F(O3d303Commands, ASchemaWithAnUnknownFormatIsRefused) {
  startO3d303(kPattern);
  PcicClient one{camera().pcicPort()};
  for (const char* format : {R"("dataencoding": "utf16")", R"("order": "middle")", R"("colour": "red")",
                             R"("width": -1)", R"("fill": "ab")", R"("base": 7)", R"("precision": "much")"}) {
    const std::string schema = fmt::format(
        R"({{"layouter":"flexible","format":{{{}}},"elements":[{{"type":"float32","id":"temp_illu"}}]}})",
        format);
    EXPECT_EQ(one.command(toftwin::o3d303::schemaCommand(schema)), "!") << format;
  }
}

// ---- HTTP ----------------------------------------------------------------------------------------

TEST_F(O3d303Commands, ARequestOfAWebPageChangesNothing) {
  startO3d303(kPattern);
  const std::string body = encodeXmlRpc(toftwin::o3d303::XmlRpcCall{"requestSession", {"", ""}});
  for (const char* header :
       {"Origin: http://evil.example\r\nContent-Type: text/xml", "Content-Type: text/plain"}) {
    RawHttp http{xmlrpc_};
    http.send(fmt::format(
        "POST /api/rpc/v1/com.ifm.efector/ HTTP/1.1\r\nHost: 127.0.0.1\r\n{}\r\nConnection: close\r\n"
        "Content-Length: {}\r\n\r\n{}",
        header, body.size(), body));
    EXPECT_THAT(http.receiveAll(), StartsWith("HTTP/1.1 4"));
  }
  auto rpc = camera();
  rpc.beginSession();  // nobody has one
  rpc.endSession();
}

}  // namespace
}  // namespace toftwin::daemon
