// SPDX-License-Identifier: Apache-2.0
// The camera's languages, byte by byte, without a socket.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include <toftwin/frame.h>

#include "drivers/o3d303/wire/confidence.h"
#include "drivers/o3d303/wire/frame_content.h"
#include "drivers/o3d303/wire/pcic.h"
#include "drivers/o3d303/wire/schema.h"
#include "drivers/o3d303/wire/xmlrpc.h"
#include "o3d303_fuzz_one_input.h"

namespace toftwin::o3d303 {
namespace {

Bytes bytesOf(std::string_view text) {
  Bytes bytes;
  appendText(bytes, text);
  return bytes;
}

// ---- PCIC --------------------------------------------------------------------------------------

TEST(Pcic, AMessageIsTicketLengthAndTicketAgain) {
  EXPECT_EQ(textOf(encodePcic("1001", "t")), "1001L000000007\r\n1001t\r\n");
}

TEST(Pcic, MessagesComeOutHoweverTheBytesAreCut) {
  Bytes stream = encodePcic("1000", "*");
  const Bytes second = encodePcic("0000", "starstop");
  stream.insert(stream.end(), second.begin(), second.end());
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    PcicReader reader{1024};
    std::vector<PcicMessage> messages;
    for (const auto piece : {std::span{stream}.first(cut), std::span{stream}.subspan(cut)}) {
      reader.feed(piece);
      while (true) {
        auto next = reader.next();
        ASSERT_TRUE(next.ok()) << next.error().message;
        if (!*next) break;
        messages.push_back(**next);
      }
    }
    ASSERT_EQ(messages.size(), 2u) << "cut at " << cut;
    EXPECT_EQ(messages[0].ticket, "1000");
    EXPECT_EQ(textOf(messages[0].content), "*");
    EXPECT_EQ(textOf(messages[1].content), "starstop");
    EXPECT_FALSE(reader.isWithinMessage());
  }
}

TEST(Pcic, OtherVersionsAreLines) {
  EXPECT_EQ(textOf(encodePcic("1001", "*", PcicVersion::V1)), "*\r\n");
  EXPECT_EQ(textOf(encodePcic("1001", "*", PcicVersion::V2)), "1001*\r\n");
  EXPECT_EQ(textOf(encodePcic("1001", "*", PcicVersion::V4)), "L000000003\r\n*\r\n");
  PcicReader reader{8};
  reader.setVersion(PcicVersion::V2);
  reader.feed(bytesOf("1001t\r\n1002T?\r"));
  const auto first = reader.next();
  ASSERT_TRUE(first.ok() && *first);
  EXPECT_EQ((*first)->ticket, "1001");
  EXPECT_EQ(textOf((*first)->content), "t");
  EXPECT_FALSE(reader.next()->has_value()) << "the line has no end yet";
  reader.setVersion(PcicVersion::V1);
  reader.feed(bytesOf("\n"));
  EXPECT_EQ(textOf((*reader.next())->content), "1002T?");
  reader.feed(bytesOf("nine bytes"));
  EXPECT_FALSE(reader.next().ok()) << "longer than asked for";
}

TEST(Pcic, WhatIsNoMessageIsToldApart) {
  for (const char* bad : {"HTTP/1.1 200 OK\r\n\r\n", "0000L00000000a\r\n0000*\r\n",
                          "0000L000000005\r\n0000*\r\n", "0000L000009999\r\n0000*\r\n",
                          "0000L000000007\r\n1234*\r\n", "0000L000000007\r\n0000*\r\r"}) {
    PcicReader reader{1024};
    reader.feed(bytesOf(bad));
    const auto next = reader.next();
    ASSERT_FALSE(next.ok()) << bad;
    EXPECT_EQ(next.error().code, Error::Code::Malformed);
  }
}

TEST(Pcic, ASchemaCommandSaysHowLongItIs) {
  const std::string command = schemaCommand("{}");
  EXPECT_EQ(command, "c000000002{}");
  EXPECT_EQ(*schemaInCommand(command), "{}");
  EXPECT_FALSE(schemaInCommand("c000000003{}").ok());
  EXPECT_FALSE(schemaInCommand("c0000002{}").ok());
}

TEST(Schema, ComesBackFromItsJson) {
  const Schema schema = schemaOf({kDistanceBlob, kAmplitudeBlob, kConfidenceBlob});
  const auto back = readSchema(toJson(schema));
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(*back, schema);
}

TEST(Schema, NestingThatWouldExhaustTheStackIsRefused) {
  const auto read = readSchema(std::string(60'000, '['));
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, Error::Code::TooLarge);
}

// ---- chunks ------------------------------------------------------------------------------------

TEST(Chunk, IsAsTheWireFactsSayToTheByte) {
  Bytes bytes;
  const std::uint16_t pixels[] = {0, 1500};
  appendChunk(bytes,
              {.type = ChunkType::RadialDistance,
               .width = 2,
               .height = 1,
               .format = ElementFormat::U16,
               .time_us = 7,
               .frame_count = 8,
               .status = 9,
               .time = ChunkHeader::Time{10, 11}},
              std::as_bytes(std::span{pixels}));
  ASSERT_EQ(bytes.size(), 52u);
  const std::uint32_t expected[] = {100, 52, 48, 2, 2, 1, 2, 7, 8, 9, 10, 11};
  for (std::size_t i = 0; i < 12; ++i)
    EXPECT_EQ(numberAt<std::uint32_t>(bytes, 4 * i), expected[i]);
  const auto read = readChunk(bytes);
  ASSERT_TRUE(read.ok()) << read.error().message;
  const auto range_m = rangeOf(read->chunk);
  ASSERT_TRUE(range_m.ok()) << range_m.error().message;
  EXPECT_TRUE(std::isnan((*range_m)[0]));
  EXPECT_FLOAT_EQ((*range_m)[1], 1.5F);
}

TEST(Chunk, SmallerThanItsImageIsNoImage) {
  Bytes bytes;
  appendChunk(bytes, {.width = 100, .height = 100}, Bytes(100));
  const auto read = readChunk(bytes);
  ASSERT_TRUE(read.ok());
  EXPECT_FALSE(rangeOf(read->chunk).ok());
}

TEST(FrameContent, NumbersAfterTheirMarkersAreRead) {
  Bytes bytes = bytesOf("startemp_illu");
  appendNumber(bytes, 41.5F);
  appendText(bytes, "extime");
  for (const std::uint32_t us : {11U, 550U, 0U}) appendNumber(bytes, us);
  appendText(bytes, "stop");
  const auto frame = readFrameContent(bytes);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_EQ(frame->illumination_c, 41.5F);
  EXPECT_EQ(frame->exposures_us, (std::array<std::uint32_t, 3>{11, 550, 0}));
}

TEST(Confidence, ComesBackThroughTheFlagsAndTheExposure) {
  for (unsigned byte = 0; byte < 256; ++byte) {
    const auto confidence = static_cast<std::uint8_t>(byte);
    const unsigned back = confidenceOf(flagsOf(confidence)) | confidenceOfExposure(exposureOf(confidence));
    const bool is_used = (byte & 0x30U) != 0;
    EXPECT_EQ(back, is_used ? byte : byte | 0x30U) << byte;
  }
}

TEST(Confidence, CountsExposuresFromTheLongest) {
  EXPECT_EQ(exposureOf(0x30), 0);
  EXPECT_EQ(exposureOf(0x20), 1);
  EXPECT_EQ(exposureOf(0x10), 2);
  EXPECT_EQ(exposureOf(0x00), 0) << "not used";
}

// ---- a real frame ------------------------------------------------------------------------------

std::optional<Bytes> realFrame() {
  const char* named = std::getenv("TOFTWIN_DATA");
  const std::filesystem::path data =
      named != nullptr ? named : std::string{TOFTWIN_SOURCE_DIR} + "/../shared/data";
  for (const auto& folder :
       {data, std::filesystem::path{TOFTWIN_SOURCE_DIR} / "../../shared/data"}) {
    std::ifstream file{folder / "ifm-o3r-frame/O3RBuffer.data", std::ios::binary};
    if (!file) continue;
    std::string text{std::istreambuf_iterator<char>{file}, {}};
    return bytesOf(text);
  }
  return std::nullopt;
}

TEST(RealFrame, OfANewerCameraIsDecodedInMetres) {
  const auto bytes = realFrame();
  if (!bytes) GTEST_SKIP() << "no ifm-o3r-frame in $TOFTWIN_DATA or ../shared/data";
  // The file has the message's ticket and line end, too.
  ASSERT_TRUE(textOf(*bytes).starts_with("0000star") && textOf(*bytes).ends_with("\r\n"));
  const auto frame = readFrameContent(std::span{*bytes}.subspan(4, bytes->size() - 6));
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_EQ(frame->chunks.size(), 6u);
  const Chunk* distance = frame->find(ChunkType::RadialDistance);
  const Chunk* confidence = frame->find(ChunkType::Confidence);
  ASSERT_TRUE(distance != nullptr && confidence != nullptr);
  EXPECT_EQ(distance->header.frame_count, 1544u);
  EXPECT_EQ(distance->header.time->seconds, 324'896u);
  const auto range_m = rangeOf(*distance);
  const auto bits = o3d303::bytesOf(*confidence);
  ASSERT_TRUE(range_m.ok() && bits.ok());
  ASSERT_EQ(range_m->width(), 224);
  ASSERT_EQ(range_m->height(), 172);
  // What whoever prepared the data counted with another program: 9962 valid pixels from 0 to 1.97
  // m.
  int valid = 0;
  float farthest_m = 0.0F;
  for (std::size_t i = 0; i < bits->size(); ++i) {
    if (((*bits)[i] & 1U) != 0) continue;
    ++valid;
    farthest_m = std::fmax(farthest_m, (*range_m)[i]);
  }
  EXPECT_EQ(valid, 9962);
  EXPECT_NEAR(farthest_m, 1.97F, 0.005F);
}

// ---- XML-RPC -----------------------------------------------------------------------------------

TEST(XmlRpc, CallsComeBack) {
  const XmlRpcCall call{"setParameter",
                        {"Exposure<&>Time", 5, true, 0.25, XmlRpcValue::Array{"a", 1},
                         XmlRpcValue::Struct{{"Index", 1}, {"Name", " with spaces "}}}};
  const auto back = readXmlRpcCall(encodeXmlRpc(call));
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(*back, call);
}

TEST(XmlRpc, AnswersAndFaultsComeBack) {
  for (const XmlRpcAnswer& answer :
       {XmlRpcAnswer{XmlRpcValue{"O3D303"}}, XmlRpcAnswer{XmlRpcValue{""}},
        XmlRpcAnswer{XmlRpcFault{101'004, "there is a session"}}}) {
    const auto back = readXmlRpcAnswer(encodeXmlRpc(answer));
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(*back, answer);
  }
}

TEST(XmlRpc, AValueWithoutATypeIsAString) {
  const auto answer = readXmlRpcAnswer(
      "<?xml version='1.0'?><methodResponse><params><param><value>1:2</value></param></params>"
      "</methodResponse>");
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(std::get<XmlRpcValue>(*answer), XmlRpcValue{"1:2"});
}

TEST(XmlRpc, WhatIsNoMessageIsToldApart) {
  std::string deep = "<methodResponse><params><param>";
  for (int i = 0; i < 10'000; ++i) deep += "<value><array><data>";
  for (const std::string& bad :
       {std::string{}, std::string{"<html/>"}, std::string{"<methodResponse/>"}, deep,
        std::string{"<methodResponse><params><param><value><int>x</int></value></param></params>"
                    "</methodResponse>"}}) {
    const auto answer = readXmlRpcAnswer(bad);
    ASSERT_FALSE(answer.ok());
    EXPECT_EQ(answer.error().code, Error::Code::Malformed);
  }
}

// ---- hostile bytes -----------------------------------------------------------------------------

Bytes exampleFrame() {
  Bytes content = bytesOf("star");
  for (const ChunkType type :
       {ChunkType::RadialDistance, ChunkType::Amplitude, ChunkType::Confidence}) {
    const bool is_byte = type == ChunkType::Confidence;
    appendChunk(
        content,
        {.type = type,
         .width = 4,
         .height = 3,
         .format = is_byte ? ElementFormat::U8 : ElementFormat::U16,
         .time = ChunkHeader::Time{1, 2},
         .attributes = type == ChunkType::Amplitude ? R"({"AmplitudeResolution":0.5})" : ""},
        Bytes(is_byte ? 12 : 24, std::byte{1}));
  }
  appendText(content, "temp_illu");
  appendNumber(content, 40.0F);
  appendText(content, "stop");
  return content;
}

TEST(HostileBytes, NeverBringTheReadersDown) {
  constexpr std::uint64_t kSeed = 20'263;
  RecordProperty("seed", fmt::format("{}", kSeed));
  const std::vector<Bytes> seeds{
      encodePcic(kFrameTicket, exampleFrame()),
      exampleFrame(),
      encodePcic("1000", schemaCommand(toJson(schemaOf({kDistanceBlob})))),
      bytesOf(toJson(schemaOf({kDistanceBlob}))),
      bytesOf(encodeXmlRpc(XmlRpcCall{"getParameter", {"x", XmlRpcValue::Array{1, 2.0}}})),
      bytesOf(encodeXmlRpc(XmlRpcAnswer{XmlRpcFault{1, "f"}}))};
  std::mt19937_64 random{kSeed};
  const auto below = [&](std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>{0, limit - 1}(random);
  };
  for (int round = 0; round < 60'000; ++round) {
    Bytes bytes = seeds[below(seeds.size())];
    for (std::size_t left = 1 + below(5); left > 0 && !bytes.empty(); --left) {
      const std::size_t at = below(bytes.size());
      switch (below(4)) {
        case 0:
          bytes[at] ^= std::byte{1} << below(8);
          break;
        case 1:
          bytes[at] = static_cast<std::byte>(random());
          break;
        case 2:
          bytes.resize(at);
          break;
        default: {
          const Bytes tail{bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end()};
          bytes.insert(bytes.end(), tail.begin(), tail.end());
        }
      }
    }
    fuzzOneInput(bytes);
  }
}

}  // namespace
}  // namespace toftwin::o3d303
