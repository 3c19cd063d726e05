// SPDX-License-Identifier: Apache-2.0
// PLY: the valid pixels as points, or all of them in rows and columns; binary, metres.
#include <fmt/format.h>

#include "tools/cli/export/cloud.h"

namespace toftwin::cli {

Result<Exported> toPly(const Frame& frame, const ExportOptions& options) {
  const auto cloud = cloudOf(frame, options);
  if (!cloud) return cloud.error();
  // Range images in PLY say their columns and rows as "obj_info", since those of Stanford's scanner did.
  const std::string grid =
      options.organised ? fmt::format("obj_info num_cols {}\nobj_info num_rows {}\n", cloud->width, cloud->height) : "";
  const std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\n"
      "comment {}\ncomment metres in the {} frame\n{}"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}end_header\n",
      titleOf(frame), options.world ? "world" : "camera's (x right, y down, z along the optical axis)", grid,
      cloud->width * cloud->height, cloud->has_amplitude ? "property float amplitude\n" : "");
  Exported exported;
  for (const auto part : {std::as_bytes(std::span{header}), std::as_bytes(std::span{cloud->numbers})})
    exported.bytes.insert(exported.bytes.end(), part.begin(), part.end());
  exported.note = cloud->note;
  return exported;
}

}  // namespace toftwin::cli
