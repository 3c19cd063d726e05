// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace toftwin::daemon {

/// A locally administered address, always the same for a source's name (FNV-1a).
inline std::array<std::uint8_t, 6> macOf(std::string_view source) {
  std::uint64_t hash = 0xcbf2'9ce4'8422'2325;
  for (const char c : source) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100'0000'01b3;
  std::array<std::uint8_t, 6> mac{0x02};
  for (std::size_t i = 1; i < mac.size(); ++i) mac[i] = static_cast<std::uint8_t>(hash >> (8 * i));
  return mac;
}

}  // namespace toftwin::daemon
