// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/units.h>

#include "drivers/lens.h"
#include "drivers/source.h"
#include "drivers/v4l2/stream.h"
#include "drivers/v4l2/system.h"

namespace toftwin::drivers::v4l2 {

/// The keys of a [[source]] table with driver = "v4l2".
struct Keys {
  std::string uri = "v4l2:/dev/video0";
  std::string camera;
  std::string calibration;
  int width = 0;
  int height = 0;
  Frequency frame_rate = 0_Hz;
  bool infrared = true;
  std::vector<std::string> set;
  int buffers = 4;
  Memory memory = Memory::Mmap;
  Duration delay = 0_ms;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("uri", uri,
           "v4l2: and a node (/dev/video0, or a link in /dev/v4l/by-id), or the camera's bus info, "
           "serial number, USB ids (usb:1d27:0601) or name; the latter find it whatever its node");
    v.text("camera", camera,
           "its description: a file, relative to this one, or the name of one that comes with "
           "toftwin; empty: the one that matches, or none");
    v.text("calibration", calibration, kCalibrationHelp);
    v.number("width", width, {0, 16384},
             "pixels per row; 0: as described, or as the camera is set");
    v.number("height", height, {0, 16384}, "rows; likewise");
    v.quantity("frame_rate", frame_rate, hertz, {0, 1000}, "0: as the camera is set");
    v.flag("infrared", infrared, "whether to take the infrared image too, if one is described");
    v.texts("set", set, "parameters to be set whenever it is opened: \"gain = 4\"");
    v.number("buffers", buffers, {2, 32}, "pictures that the kernel can hold before it drops some");
    v.choice("memory", memory, {{"mmap", Memory::Mmap}, {"dmabuf", Memory::Dmabuf}},
             "how pictures are read: the node's own mapping, or exported as DMA-BUF");
    v.quantity(
        "delay", delay, millisecond, {0, 1000},
        "from the exposure to the picture's time stamp, if you measured it; 0: unknown, anything "
        "up to a frame interval");
  }
};

/// The row's words, which a build without V4L2 has too.
struct About {
  static constexpr std::string_view name = "v4l2";
  static constexpr std::string_view summary =
      "depth cameras that the Linux kernel has a driver for (Video4Linux)";
  static constexpr std::string_view remedy = "install linux-libc-dev and configure again";
  using Keys = v4l2::Keys;
};

Driver row();

/// As the row does, on any kernel.
std::vector<std::string> listOn(System& system);
Result<std::unique_ptr<Source>> openOn(System& system, settings::Table& table);

}  // namespace toftwin::drivers::v4l2
