// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <span>
#include <string>

#include "bad_messages.h"
#include "example_messages.h"
#include "message_json.h"
#include "protocol/wire/codec.h"

namespace toftwin::wire {
namespace {

using testing::HasSubstr;

const std::filesystem::path kFolder =
    std::filesystem::path{TOFTWIN_SOURCE_DIR} / "tests/protocol/conformance";

std::string readText(const std::filesystem::path& file) {
  std::ifstream in{file, std::ios::binary};
  return {std::istreambuf_iterator<char>{in}, {}};
}

std::vector<std::byte> readBytes(const std::filesystem::path& file) {
  const std::string text = readText(file);
  const auto bytes = std::as_bytes(std::span{text});
  return {bytes.begin(), bytes.end()};
}

/// What a decoder of this protocol must say of a `.bin`.
std::string meaningOf(std::vector<std::byte> bytes) {
  const auto message = decode(Buffer::adopt(std::move(bytes)));
  return message ? toJson(*message) : toJson(message.error().code);
}

TEST(Conformance, EveryPairIsReadAsItsJsonSays) {
  int pairs = 0;
  for (const auto& entry : std::filesystem::directory_iterator{kFolder}) {
    if (entry.path().extension() != ".bin") continue;
    pairs += 1;
    const auto json = std::filesystem::path{entry.path()}.replace_extension(".json");
    EXPECT_EQ(meaningOf(readBytes(entry.path())), readText(json)) << entry.path();
  }
  EXPECT_GT(pairs, 60);
}

TEST(Conformance, ThePairsAreTheOnesThatTheEncoderMakes) {
  std::set<std::string> expected;
  for (const auto& [name, message] : exampleMessages()) {
    expected.insert(name);
    EXPECT_EQ(toBytes(*encode(message)), readBytes(kFolder / (name + ".bin"))) << name;
    EXPECT_EQ(toJson(message), readText(kFolder / (name + ".json"))) << name;
  }
  for (const BadMessage& bad : badMessages()) {
    expected.insert(bad.name);
    EXPECT_EQ(bad.bytes, readBytes(kFolder / (bad.name + ".bin"))) << bad.name;
  }
  std::set<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator{kFolder}) {
    found.insert(entry.path().stem().string());
  }
  EXPECT_EQ(found, expected) << "run make_conformance again, and remove what is no longer made";
}

TEST(Refusal, EveryRuleHasItsError) {
  for (const BadMessage& bad : badMessages()) {
    const auto message = decode(Buffer::adopt(bad.bytes));
    ASSERT_FALSE(message) << bad.name;
    EXPECT_EQ(message.error().code, bad.code) << bad.name << ": " << message.error().message;
    EXPECT_THAT(message.error().message, HasSubstr(bad.why)) << bad.name;
  }
}

TEST(Refusal, EveryPrefixOfAMessageIsRefused) {
  const auto bytes = toBytes(*encode(FrameMessage{1, exampleFrame(5, 3)}));
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const auto message = decode(Buffer::adopt(
        std::vector(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length))));
    EXPECT_FALSE(message) << length;
  }
}

// CRC-32C finds every error of up to 32 neighbouring bits, so every changed byte.
TEST(Refusal, EveryChangedByteIsFound) {
  const auto bytes = toBytes(*encode(FrameMessage{1, exampleFrame(5, 3)}));
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    auto changed = bytes;
    changed[at] ^= std::byte{0x10};
    EXPECT_FALSE(decode(Buffer::adopt(std::move(changed)))) << at;
  }
}

}  // namespace
}  // namespace toftwin::wire
