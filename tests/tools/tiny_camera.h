// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <string>

#include "sim/sensor/sensor_model.h"
#include "tests/record/record_testing.h"

namespace toftwin::cli {

/// A camera of few pixels, two frequencies and eight raw exposures, that remembers the frame before.
inline constexpr const char* kTinyCamera = R"(model = "Tiny"
[lens]
width = 24
height = 18
fx = 20.0
fy = 20.0
cx = 11.5
cy = 8.5
[[emitter]]
power_w = 2.0
[[modulation]]
frequency_mhz = 20.0
exposure_us = 1000.0
[[modulation]]
frequency_mhz = 100.0
exposure_us = 1000.0
[sampling]
steps = 4
taps = 2
gap_us = 500.0
frame_interval_ms = 50.0
[pixel]
electrons_per_radiance_s = 8.2e7
[decoder]
algorithm = "n_phase"
[[effect]]
type = "shot_noise"
)";
inline constexpr const char* kRemembers =
    "[[effect]]\ntype = \"temporal_filter\"\n[[effect]]\ntype = \"lag\"\n";

/// A box that moves before a wall.
inline constexpr const char* kMovingScene = R"([[material]]
name = "grey"
albedo = 0.5
[[object]]
shape = "rectangle"
size_m = [8, 6, 0]
position_m = [0, 0, 2]
material = "grey"
[[object]]
shape = "box"
size_m = [0.4, 0.4, 0.4]
position_m = [-0.3, 0, 1.2]
velocity_m_per_s = [0.5, 0, 0]
material = "grey"
)";

/// Half a metre to the right in a second, without a turn: every number is exact.
inline constexpr const char* kRightwards =
    "time_s,x_m,y_m,z_m,q_w,q_x,q_y,q_z\n0,0,0,0,1,0,0,0\n1,0.5,0,0,1,0,0,0\n";

inline void writeText(const std::filesystem::path& file, const std::string& text) {
  std::ofstream{file, std::ios::binary} << text;
}

}  // namespace toftwin::cli
