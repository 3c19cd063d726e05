// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/kinect_in_room.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <fstream>
#include <numbers>

namespace toftwin::bench {
namespace {

constexpr auto kRoom = R"([[material]]
name = "white"
albedo = 0.8
[[object]]
shape = "box"
size_m = [4, 2.5, 5]
position_m = [0, 0, 2]
material = "white"
[[object]]
mesh = "bumpy.ply"
material = "white"
)";
/// Of the sphere: to and fro.
constexpr auto kMoves = R"(period_s = 2.0
[[object.keyframe]]
time_s = 0.0
position_m = [0.05, 0.1, 2.2]
[[object.keyframe]]
time_s = 1.0
position_m = [0.35, 0.1, 2.2]
[[object.keyframe]]
time_s = 2.0
position_m = [0.05, 0.1, 2.2]
)";

}  // namespace

void writeBumpySphere(const std::filesystem::path& file, int steps) {
  std::ofstream out{file, std::ios::binary};
  out << fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      (steps + 1) * steps, 2 * steps * steps);
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const double theta = std::numbers::pi * i / steps, phi = 2.0 * std::numbers::pi * j / steps;
      const double r = 0.6 * (1.0 + 0.05 * std::sin(12.0 * theta) * std::sin(12.0 * phi));
      const float at[] = {static_cast<float>(r * std::sin(theta) * std::cos(phi)),
                          static_cast<float>(r * std::sin(theta) * std::sin(phi)),
                          static_cast<float>(r * std::cos(theta))};
      out.write(reinterpret_cast<const char*>(at), sizeof at);
    }
  }
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const int a = i * steps + j, b = i * steps + (j + 1) % steps;
      for (const auto& corners : {std::array{a, b, b + steps}, std::array{a, b + steps, a + steps}}) {
        out.put(3);
        out.write(reinterpret_cast<const char*>(corners.data()), sizeof corners);
      }
    }
  }
}

Files::Files(int steps)
    : folder_(std::filesystem::temp_directory_path() /
              fmt::format("toftwin_simulator_bench_{}", ::getpid())) {
  std::filesystem::create_directories(folder_);
  writeBumpySphere(folder_ / "bumpy.ply", steps);
  std::ofstream{scene()} << kRoom << kMoves;
  std::ofstream{stillScene()} << kRoom << "position_m = [0.2, 0.1, 2.2]\n";
  std::ofstream{camera()}
      << orGiveUp(SensorModel::presetText("kinect_v2"))
      << "\n[[effect]]\ntype = \"lens_scatter\"\nveil = 0.01\nhalo = 0.02\nhalo_radius_px = 15\n";
}

}  // namespace toftwin::bench
