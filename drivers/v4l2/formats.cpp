// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/formats.h"

#include <fmt/format.h>

#include "drivers/v4l2/device.h"
#include "drivers/v4l2/selection.h"

namespace toftwin::drivers::v4l2 {
namespace {

std::string nameFor(std::uint32_t fourcc) {
  const PixelFormat* known = pixelFormatOf(fourcc);
  return known != nullptr ? std::string{known->name}
                          : fmt::format("{} (not read by this driver)", nameOf(fourcc));
}

}  // namespace

std::vector<std::string> formatLines(System& system, const std::string& uri) {
  std::vector<std::string> lines;
  const auto camera = findCamera(system, uri, uri);
  if (!camera) return lines;
  for (const Node& node : camera->nodes) {
    const auto device = Device::open(system, node.path);
    if (!device) continue;
    for (const std::uint32_t fourcc : node.formats) {
      const auto sizes = sizesOf(*device, fourcc);
      if (sizes.empty())
        lines.push_back(fmt::format("{}: {}, sizes that it does not tell", node.path, nameFor(fourcc)));
      for (const Size& size : sizes) {
        lines.push_back(fmt::format("{}: {}, {} x {}, {} Hz", node.path, nameFor(fourcc), size.width,
                                    size.height, frameRatesOf(*device, fourcc, size)));
      }
    }
  }
  return lines;
}

}  // namespace toftwin::drivers::v4l2
