// SPDX-License-Identifier: Apache-2.0
// PCD, the point clouds of PCL, version 0.7: binary, metres. The viewpoint is the camera's pose, if the points are its own.
#include <fmt/format.h>

#include "tools/cli/export/cloud.h"

namespace toftwin::cli {
namespace {

/// tx ty tz qw qx qy qz
std::string viewpointOf(const Frame& frame, bool is_world) {
  if (is_world || !frame.moment.world_from_camera) return "0 0 0 1 0 0 0";
  const auto& [rotation, translation] = *frame.moment.world_from_camera;
  return fmt::format("{} {} {} {}", translation.x, translation.y, translation.z, fmt::join(rotation, " "));
}

}  // namespace

Result<Exported> toPcd(const Frame& frame, const ExportOptions& options) {
  const auto cloud = cloudOf(frame, options);
  if (!cloud) return cloud.error();
  const std::size_t fields = cloud->has_amplitude ? 4 : 3;
  const auto repeated = [&](const char* word) {
    std::string line;
    for (std::size_t i = 0; i < fields; ++i) line += std::string{" "} + word;
    return line;
  };
  const std::string header = fmt::format(
      "# .PCD v0.7 - {}\nVERSION 0.7\nFIELDS x y z{}\nSIZE{}\nTYPE{}\nCOUNT{}\nWIDTH {}\nHEIGHT {}\nVIEWPOINT {}\nPOINTS {}\n"
      "DATA binary\n",
      titleOf(frame), cloud->has_amplitude ? " intensity" : "", repeated("4"), repeated("F"), repeated("1"), cloud->width, cloud->height,
      viewpointOf(frame, options.world), cloud->width * cloud->height);
  Exported exported;
  for (const auto part : {std::as_bytes(std::span{header}), std::as_bytes(std::span{cloud->numbers})})
    exported.bytes.insert(exported.bytes.end(), part.begin(), part.end());
  exported.note = cloud->note;
  return exported;
}

}  // namespace toftwin::cli
