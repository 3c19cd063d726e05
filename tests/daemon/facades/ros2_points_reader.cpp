// SPDX-License-Identifier: Apache-2.0
// Reads the points of the camera "cam" in a DDS domain for ever, and makes a file when the first came:
//   ros2_points_reader DOMAIN FILE
#include <fstream>
#include <string>

#include "ros2_reader.h"

int main(int count, char** arguments) {
  using namespace toftwin::test;
  if (count != 3) return 2;
  RosProgram program{std::stoi(arguments[1])};
  auto* points = program.read("/cam/points", "sensor_msgs::msg::dds_::PointCloud2_", Asks::Reliable);
  while (nextOf(points)) std::ofstream{arguments[2]} << "reads";
}
