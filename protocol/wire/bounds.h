// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

/// How much one message may hold; docs/protocol.md lists them. A decoder refuses more; so does an encoder,
/// but for texts for people, which it cuts.
namespace toftwin::wire {

inline constexpr std::size_t kMaxName = 255;   ///< bytes of a name, an id, a file name
inline constexpr std::size_t kMaxText = 4096;  ///< bytes of a text for people
inline constexpr std::size_t kMaxPlanes = 64;
inline constexpr std::size_t kMaxExposures = 4096;
inline constexpr std::size_t kMaxTemperatures = 256;
inline constexpr std::size_t kMaxNames = 1024;  ///< of effects, features or parameters
inline constexpr std::size_t kMaxSources = 1024;
inline constexpr std::uint32_t kMaxSide = 65535;  ///< pixels of an image's width or height
inline constexpr std::uint32_t kMaxChannels = 1024;

/// Nesting and number of the header's tables that the verifier follows.
inline constexpr std::uint32_t kMaxTableDepth = 16;
inline constexpr std::uint32_t kMaxTables = 8192;

constexpr std::uint64_t paddedToAlignment(std::uint64_t bytes) { return (bytes + 63) / 64 * 64; }

}  // namespace toftwin::wire
