// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/wire/base64.h"

#include <cstdint>

namespace toftwin::o3d303 {
namespace {

constexpr std::string_view kSixBits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

}  // namespace

std::string toBase64(std::string_view bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::string_view part = bytes.substr(i, 3);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (k < part.size() ? static_cast<unsigned char>(part[k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= part.size() ? kSixBits[bits >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

std::optional<std::string> fromBase64(std::string_view text) {
  std::string bytes;
  std::uint32_t bits = 0;
  int read = 0, padding = 0;
  for (const char c : text) {
    if (c == ' ' || c == '\n' || c == '\r' || c == '\t') continue;
    const auto six = kSixBits.find(c);
    if (c == '=') ++padding;
    if (c != '=' && (six == std::string_view::npos || padding > 0)) return std::nullopt;
    bits = bits << 6 | (c == '=' ? 0U : static_cast<std::uint32_t>(six));
    if (++read % 4 != 0) continue;
    if (padding > 2) return std::nullopt;
    for (int k = 0; k < 3 - padding; ++k) bytes += static_cast<char>(bits >> (16 - 8 * k) & 255U);
  }
  if (read % 4 != 0 || padding > 2) return std::nullopt;
  return bytes;
}

}  // namespace toftwin::o3d303
