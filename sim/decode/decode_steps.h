// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <toftwin/frame.h>

#include "sim/decode/decode.h"

namespace toftwin::sim {

// What the decoders share.

constexpr bool has(std::uint8_t flags, PixelFlag flag) {
  return (flags & static_cast<unsigned>(flag)) != 0;
}
constexpr void raise(std::uint8_t& flags, PixelFlag flag) {
  flags = static_cast<std::uint8_t>(flags | static_cast<unsigned>(flag));
}
/// Invalid, and why.
constexpr void reject(std::uint8_t& flags, PixelFlag why) {
  raise(flags, PixelFlag::Invalid);
  raise(flags, why);
}

/// Half the length of the light's way → range, for an emitter at distance L along x from the lens.
/// With s the whole way and u the ray's x component, |r u⃗ − L x⃗| = s − r gives
///     r = (s² − L²) / (2 (s − L u))
/// and libfreenect2 drops L² in it.
double rangeOfWay(double half_way_m, double ray_x, const DecodeSettings& settings);

/// The cycles, in [0, 1), that the factory's table gives for those seen.
void linearise(const std::vector<float>& true_cycles, std::span<float> cycles);

/// The zero phases in cycles, in [0, 1); zero where the settings have none.
std::vector<float> zeroCycles(const DecodeSettings& settings, std::size_t frequencies);

/// Turns a row's phasors back by the pixels' own phases, where the settings have tables of them.
void takeOffPixelPhase(const DecodeSettings& settings, std::size_t frequency, int y,
                       std::span<std::complex<float>> phasors);

}  // namespace toftwin::sim
