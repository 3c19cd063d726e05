// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

/// What a simulated camera sees and gives unless told otherwise, as a source and for `toftwin
/// render`.
namespace toftwin::drivers::simulator {

/// What is seen without a scene file: a grey box before a white wall, on a grey floor.
inline constexpr std::string_view kDefaultScene = R"(
[[material]]
name = "white"
albedo = 0.8
[[material]]
name = "grey"
albedo = 0.3
[[object]]
name = "wall"
shape = "rectangle"
size_m = [8, 6, 0]
position_m = [0, 0, 2.5]
material = "white"
[[object]]
name = "floor"
shape = "rectangle"
size_m = [8, 6, 0]
position_m = [0, 0.9, 0]
euler_deg = [90, 0, 0]
material = "grey"
[[object]]
name = "box"
shape = "box"
size_m = [0.4, 0.5, 0.4]
position_m = [0.1, 0.65, 1.6]
euler_deg = [0, 30, 0]
material = "grey"
)";

/// So many of sim::allPlanes(), from the first.
inline constexpr std::ptrdiff_t kDefaultPlanes = 5;

}  // namespace toftwin::drivers::simulator
