// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/facades/facade.h"
#include "daemon/facades/struck_frames.h"

/// Any source as a camera of this machine, written into a node of the kernel module v4l2loopback.
namespace toftwin::daemon::v4l2_loopback {

enum class Shown { Depth, Amplitude };
enum class WantedFormat { Any, Z16, Y16 };

/// The keys of a [[facade]] table with kind = "v4l2_loopback".
struct Keys {
  std::string device = "/dev/video10";
  Shown image = Shown::Depth;
  WantedFormat format = WantedFormat::Any;
  double depth_unit_mm = 1.0;
  double amplitude_per_count = 1.0;
  FrameLineKeys line;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("device", device, "node that is written to: modprobe v4l2loopback video_nr=10 makes this one");
    v.choice("image", image, {{"depth", Shown::Depth}, {"amplitude", Shown::Amplitude}},
             "what it shows; two images take two nodes and two facades");
    v.choice("format", format,
             {{"auto", WantedFormat::Any}, {"Z16", WantedFormat::Z16}, {"Y16", WantedFormat::Y16}},
             "of depth: auto is Z16 where the module knows it, else Y16 with the same numbers; amplitude is "
             "Y16 always");
    v.number("depth_unit_mm", depth_unit_mm, {1e-3, 100.0},
             "of one count of the depth image, in millimetres: 1 reaches to 65.5 m");
    v.number("amplitude_per_count", amplitude_per_count, {1e-6, 1e9},
             "what one count of the amplitude image stands for in the source's unit");
    v.group("line", line, "what goes wrong on purpose with the images");
  }
};

FacadeKind facade();

}  // namespace toftwin::daemon::v4l2_loopback
