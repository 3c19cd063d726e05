// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

/// How a client proves that it knows a password without sending it: SHA-256 of a challenge and of the
/// password's own hash. [SICKAG/sick_visionary_cpp_base 1.1.0, AuthenticationSecure]
namespace toftwin::visionary {

enum class UserLevel : std::uint8_t {
  Run = 0,
  Operator = 1,
  Maintenance = 2,
  AuthorizedClient = 3,
  Service = 4
};
/// Nothing for a number that is none.
std::optional<UserLevel> userLevelOf(std::uint8_t number);

using Digest = std::array<std::uint8_t, 32>;
inline constexpr std::size_t kChallengeSize = 16;

/// SHA-256(SHA-256("LEVEL:SICK Sensor:PASSWORD"[":" salt]) challenge); the salt of newer firmware, or
/// nothing.
Digest responseTo(std::span<const std::uint8_t> challenge, std::span<const std::uint8_t> salt,
                  UserLevel level, std::string_view password);

}  // namespace toftwin::visionary
