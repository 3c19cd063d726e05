// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace toftwin::cli {

/// A camera file whose frames are made in milliseconds. {0}: its name, {1}: what it reads too far, mm.
inline constexpr const char* kTinyCamera = R"(model = "Tiny {0}"
[lens]
width = 24
height = 18
fx = 60.0
fy = 60.0
cx = 11.5
cy = 8.5
[[emitter]]
power_w = 2000.0
[[modulation]]
frequency_mhz = 20.0
exposure_us = 1000.0
[sampling]
steps = 4
[decoder]
algorithm = "n_phase"
nearest_m = 0.1
farthest_m = 7.4
[[effect]]
type = "shot_noise"
[[effect]]
type = "delay"
offset_mm = {1:.1f}
)";

}  // namespace toftwin::cli
