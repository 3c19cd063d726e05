// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/modbus/identification.h"

#include <array>
#include <string_view>

namespace toftwin::daemon::modbus {
namespace {

constexpr std::uint8_t kType = 14;
/// How much is asked for: a stream of basic or regular objects, or one object. There are no extended ones.
constexpr std::uint8_t kBasic = 1, kOne = 4;  // 2: regular, 3: extended
constexpr std::uint8_t kRegularAsStreamAndOneByOne = 0x82;
constexpr std::size_t kBasicObjects = 3, kRegularObjects = 7;
/// So that all seven fit into a message of 253 bytes.
constexpr std::size_t kLongestText = 32;

using Texts = std::array<std::string_view, kRegularObjects>;

Texts textsOf(const Identity& i) {
  Texts texts{i.vendor, i.product_code, i.revision, i.vendor_url, i.product, i.model, i.application};
  for (std::string_view& text : texts) text = text.substr(0, kLongestText);
  return texts;
}

void appendObject(Bytes& bytes, std::size_t id, std::string_view text) {
  bytes.push_back(static_cast<std::byte>(id));
  bytes.push_back(static_cast<std::byte>(text.size()));
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
}

}  // namespace

Identification identificationFor(std::span<const std::byte> data, const Identity& identity) {
  constexpr std::size_t kSize = 3;
  if (data.empty() || std::to_integer<std::uint8_t>(data[0]) != kType) return {{}, Exception::kFunction};
  if (data.size() != kSize) return {{}, Exception::kValue};
  const auto code = std::to_integer<std::uint8_t>(data[1]);
  std::size_t first = std::to_integer<std::uint8_t>(data[2]);
  if (code < kBasic || code > kOne) return {{}, Exception::kValue};
  const std::size_t known = code == kBasic ? kBasicObjects : kRegularObjects;
  if (code == kOne && first >= known) return {{}, Exception::kAddress};
  if (first >= known) first = 0;  // a stream begins anew, as the specification has it
  const std::size_t end = code == kOne ? first + 1 : known;
  const Texts texts = textsOf(identity);
  Identification answer;
  for (const std::size_t byte :
       {std::size_t{kType}, std::size_t{code}, std::size_t{kRegularAsStreamAndOneByOne}, std::size_t{0},
        std::size_t{0}, end - first})  // zeros: nothing follows
    answer.data.push_back(static_cast<std::byte>(byte));
  for (std::size_t id = first; id < end; ++id) appendObject(answer.data, id, texts[id]);
  return answer;
}

}  // namespace toftwin::daemon::modbus
