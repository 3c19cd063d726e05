// SPDX-License-Identifier: Apache-2.0
// Holds docs/protocol.md against the code.
#include <gmock/gmock.h>
#include <toftwin/names.h>

#include <toftwin_generated.h>

#include <array>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "../matches.h"
#include "protocol/transport/memfd.h"
#include "protocol/wire/bounds.h"
#include "protocol/wire/codec.h"

namespace toftwin::wire {
namespace {

using testing::HasSubstr;

std::string read(const std::string& path) {
  std::ifstream file{std::string{TOFTWIN_SOURCE_DIR} + "/" + path};
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

const std::string& page() {
  static const std::string text = read("docs/protocol.md");
  return text;
}

std::string section(const std::string& title) {
  const auto begin = page().find("\n" + title + "\n");
  if (begin == std::string::npos) return "no section \"" + title + "\"";
  const std::string level = title.substr(0, title.find(' ') + 1);
  return page().substr(begin, page().find("\n" + level, begin + 1) - begin);
}

std::string row(auto first, auto second) {
  std::ostringstream text;
  text << "\n| " << first << " | " << second << " |";
  return text.str();
}

TEST(ProtocolPage, NamesTheVersion) {
  EXPECT_THAT(page(), HasSubstr("# The toftwin protocol, version " + std::to_string(kVersionMajor) +
                                "." + std::to_string(kVersionMinor) + "\n"));
}

TEST(ProtocolPage, EveryFieldOfThePreambleIsWhereItSays) {
  const Preamble preamble{.major = 1,
                          .minor = 0x0302,
                          .header_bytes = 0x07060540,
                          .body_bytes = 0x0F0E0D0C0B0A0940,
                          .header_crc32c = 0x13121110,
                          .body_crc32c = 0x17161514,
                          .body_place = BodyPlace::Memfd};
  const std::map<std::string, std::uint64_t> values{{"major", preamble.major},
                                                    {"minor", preamble.minor},
                                                    {"header_bytes", preamble.header_bytes},
                                                    {"body_bytes", preamble.body_bytes},
                                                    {"header_crc32c", preamble.header_crc32c},
                                                    {"body_crc32c", preamble.body_crc32c},
                                                    {"body_place", 1},
                                                    {"reserved", 0}};
  const auto bytes = encodePreamble(preamble);
  const std::string text = section("### 1.1 Preamble");
  std::size_t end = 0, found = 0;
  for (const auto& line : test::matchesIn(text, "\\| (\\d+) \\| (\\d+) \\| `(\\w+)` \\|")) {
    const std::size_t offset = std::stoul(line[1]), size = std::stoul(line[2]);
    EXPECT_EQ(offset, end) << "a gap before " << line[3];
    end = offset + size;
    const auto known = values.find(line[3]);
    if (known == values.end()) continue;
    found += 1;
    for (std::size_t i = 0; i < size; ++i) {
      const std::uint64_t expected = i < 8 ? (known->second >> (8 * i)) & 0xFFu : 0;
      EXPECT_EQ(static_cast<std::uint64_t>(bytes.at(offset + i)), expected) << line[3];
    }
  }
  EXPECT_EQ(end, kPreambleSize);
  EXPECT_EQ(found, values.size());
}

TEST(ProtocolPage, ListsEveryMessageWithItsId) {
  const std::string text = section("## 3 Messages");
  for (int id = 1; id <= static_cast<int>(fb::Body::MAX); ++id) {
    const std::string name = fb::EnumNameBody(static_cast<fb::Body>(id));
    EXPECT_THAT(text, HasSubstr(row(id, "`" + name + "`")));
    EXPECT_THAT(text + section("## 5 Subscriptions") + section("## 4 Frames"),
                testing::AnyOf(HasSubstr("**" + name + ".**"), HasSubstr("**" + name + "**"),
                               HasSubstr("A `" + name + "` message")));
  }
}

TEST(ProtocolPage, ExplainsEveryFieldOfTheSchema) {
  std::string schema;
  for (const auto& line : test::matchesIn(read("protocol/wire/toftwin.fbs"), "[^\n]*\n"))
    schema += line[0].substr(0, line[0].find("//")) + "\n";
  const auto fields = test::matchesIn(schema, "(\\w+):\\s*\\[?\\w+");
  for (const auto& field : fields) EXPECT_THAT(page(), HasSubstr("`" + field[1] + "`"));
  EXPECT_GT(fields.size(), 100U);
}

TEST(ProtocolPage, ListsEveryErrorCode) {
  using Code = Error::Code;
  const std::array<std::pair<Code, const char*>, 15> codes{{
      {Code::Internal, "Internal"},
      {Code::InvalidArgument, "InvalidArgument"},
      {Code::NotFound, "NotFound"},
      {Code::Unsupported, "Unsupported"},
      {Code::Malformed, "Malformed"},
      {Code::TooLarge, "TooLarge"},
      {Code::Timeout, "Timeout"},
      {Code::Disconnected, "Disconnected"},
      {Code::Busy, "Busy"},
      {Code::PermissionDenied, "PermissionDenied"},
      {Code::StorageFull, "StorageFull"},
      {Code::EndOfStream, "EndOfStream"},
      {Code::Stopped, "Stopped"},
      {Code::Overrun, "Overrun"},
      {Code::Incompatible, "Incompatible"},
  }};
  const std::string text = section("## 8 Error codes");
  for (const auto& [code, name] : codes) {
    EXPECT_THAT(text, HasSubstr(row(static_cast<int>(code), name)));
  }
}

TEST(ProtocolPage, ListsEveryPlaneKindFrameKindFlagAndPolicy) {
  for (int i = 0; i <= static_cast<int>(kLastPlaneKind); ++i) {
    EXPECT_THAT(section("### 4.4 Planes"), HasSubstr(row(i, nameOf(static_cast<PlaneKind>(i)))));
  }
  for (int i = 0; i <= static_cast<int>(FrameKind::Faulted); ++i) {
    EXPECT_THAT(section("### 4.3 Kinds of frames"),
                HasSubstr(row(i, nameOf(static_cast<FrameKind>(i)))));
  }
  for (int bit = 1; bit < 256; bit *= 2) {
    EXPECT_THAT(section("### 4.4 Planes"),
                HasSubstr(row(bit, nameOf(static_cast<PixelFlag>(bit)))));
  }
  const std::array<std::pair<Policy, const char*>, 4> policies{{{Policy::Latest, "LATEST"},
                                                                {Policy::Queue, "QUEUE"},
                                                                {Policy::Lossless, "LOSSLESS"},
                                                                {Policy::Lockstep, "LOCKSTEP"}}};
  for (const auto& [policy, name] : policies) {
    EXPECT_THAT(section("### 5.1 Policies"), HasSubstr(row(static_cast<int>(policy), name)));
  }
}

TEST(ProtocolPage, ListsEveryLimit) {
  const std::string text = section("## 10 Limits");
  const Limits limits;
  for (const auto& [name, value] :
       std::map<std::string, std::uint64_t>{{"header", limits.header_bytes},
                                            {"body", limits.body_bytes},
                                            {"name", kMaxName},
                                            {"text", kMaxText},
                                            {"planes", kMaxPlanes},
                                            {"exposures", kMaxExposures},
                                            {"temperatures", kMaxTemperatures},
                                            {"names", kMaxNames},
                                            {"sources", kMaxSources},
                                            {"side", kMaxSide},
                                            {"channels", kMaxChannels},
                                            {"tables", kMaxTables},
                                            {"depth", kMaxTableDepth}}) {
    EXPECT_THAT(text, HasSubstr(row(name, value)));
  }
}

TEST(ProtocolPage, NamesTheFeature) {
  EXPECT_THAT(page(), HasSubstr("(feature `" + std::string{transport::kMemfdFeature} + "`)"));
}

}  // namespace
}  // namespace toftwin::wire
