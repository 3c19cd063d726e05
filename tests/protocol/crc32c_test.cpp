// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/crc32c.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <string_view>
#include <vector>

namespace toftwin::wire {
namespace {

std::vector<std::byte> repeated(std::byte value, std::size_t count) {
  return std::vector<std::byte>(count, value);
}

std::vector<std::byte> randomBytes(std::size_t count, std::mt19937& random) {
  std::vector<std::byte> bytes(count);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random());
  return bytes;
}

using Sum = std::uint32_t (*)(std::span<const std::byte>, std::uint32_t);
class Crc32c : public testing::TestWithParam<Sum> {};

// RFC 3720, appendix B.4, and the check value that catalogues of CRCs give for CRC-32C.
TEST_P(Crc32c, GivesThePublishedValues) {
  const Sum sum = GetParam();
  EXPECT_EQ(sum(repeated(std::byte{0x00}, 32), 0), 0x8A9136AAu);
  EXPECT_EQ(sum(repeated(std::byte{0xFF}, 32), 0), 0x62A8AB43u);
  std::vector<std::byte> ascending(32);
  for (std::size_t i = 0; i < 32; ++i) ascending[i] = static_cast<std::byte>(i);
  EXPECT_EQ(sum(ascending, 0), 0x46DD794Eu);
  constexpr std::string_view digits = "123456789";
  EXPECT_EQ(sum(std::as_bytes(std::span{digits}), 0), 0xE3069283u);
  EXPECT_EQ(sum({}, 0), 0u);
}

TEST_P(Crc32c, OfPartsIsTheOneOfTheWhole) {
  const Sum sum = GetParam();
  std::mt19937 random{20};
  const auto bytes = randomBytes(30'000, random);
  const std::uint32_t whole = sum(bytes, 0);
  for (const std::size_t cut : {0u, 1u, 63u, 767u, 768u, 12'289u, 29'999u, 30'000u}) {
    const std::span all{bytes};
    EXPECT_EQ(sum(all.subspan(cut), sum(all.first(cut), 0)), whole) << "cut at " << cut;
  }
}

INSTANTIATE_TEST_SUITE_P(Both, Crc32c, testing::Values(&crc32c, &crc32cPortable));

// Lengths around every boundary between the block sizes of the fast path, at every misalignment.
TEST(Crc32cFast, AgreesWithThePortableOneAtEveryLengthAndAlignment) {
  std::mt19937 random{21};
  const auto bytes = randomBytes(3 * 4096 + 3 * 256 + 64, random);
  for (std::size_t start = 0; start < 8; ++start) {
    for (std::size_t length = 0; start + length <= bytes.size(); length += length < 900 ? 1 : 37) {
      const auto part = std::span{bytes}.subspan(start, length);
      ASSERT_EQ(crc32c(part), crc32cPortable(part)) << start << " + " << length;
    }
  }
}

}  // namespace
}  // namespace toftwin::wire
