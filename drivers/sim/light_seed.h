// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>

#include <toftwin/geometry.h>

#include "sim/images/mix_bits.h"

namespace toftwin::drivers::simulator {

/// The seed of the light's paths as a camera at that place sees it. Each place has its own: what light has by chance
/// would else be the same from all of them, and look like a pattern of the camera's pixels. It depends on the place
/// alone, so that a frame can be made again.
inline std::uint64_t lightSeed(std::uint64_t seed, const Transform<World, Camera>& world_from_camera) {
  std::uint64_t key = 0;
  const auto add = [&](double value) {
    constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15U;  // 2⁶⁴ / golden ratio
    key = sim::mixBits(key + std::bit_cast<std::uint64_t>(value + 0.0) + kGolden);  // −0 + 0 is 0
  };
  for (const double q : world_from_camera.rotation_wxyz) add(q);
  const Vec3d& t = world_from_camera.translation_m;
  for (const double x : {t.x, t.y, t.z}) add(x);
  return seed + key;
}

}  // namespace toftwin::drivers::simulator
