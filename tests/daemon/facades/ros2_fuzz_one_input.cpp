// SPDX-License-Identifier: Apache-2.0
// The numbers of a pose that somebody sent, as Cyclone DDS gives them: any seven doubles.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "daemon/facades/ros2/pose.h"
#include "fuzz_one_input.h"

namespace toftwin::daemon {
namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

void fuzzOneInput(std::span<const std::byte> bytes) {
  std::array<double, 7> numbers{};
  std::memcpy(numbers.data(), bytes.data(), std::min(bytes.size(), sizeof numbers));
  const auto [x, y, z, qx, qy, qz, qw] = numbers;
  const auto pose = ros2::checkPose({x, y, z}, {qx, qy, qz, qw});
  if (!pose) return demand(!pose.error().message.empty());
  demand(std::ranges::all_of(numbers, [](double one) { return std::isfinite(one); }));
  double norm = 0.0;
  for (const double one : pose->rotation_wxyz) norm += one * one;
  demand(std::abs(norm - 1.0) < 1e-9);  // a unit quaternion, and the place as it was sent
  demand(pose->translation_m.x == x && pose->translation_m.y == y && pose->translation_m.z == z);
}

}  // namespace toftwin::daemon
