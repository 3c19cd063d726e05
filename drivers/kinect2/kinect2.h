// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/units.h>

#include "drivers/lens.h"
#include "drivers/source.h"

/// The Microsoft Kinect v2 over USB, by what the libfreenect2 project found out about it.
namespace toftwin::drivers::kinect2 {

/// The keys of a [[source]] table with driver = "kinect2".
struct Keys {
  std::string uri = "kinect2:any";
  std::vector<std::string> planes;
  std::string calibration;
  bool mirror = false;
  Length nearest = 0.5_m;
  Length farthest = 18.7_m;
  double speed_of_light = kSpeedOfLight_m_per_s;
  bool bilateral_filter = true;
  bool edge_filter = true;
  bool reset = true;
  int transfers = 60;
  Duration delay = 0_ms;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("uri", uri, "kinect2: and the camera's serial number, or its USB port (2-1.4), or any");
    v.texts("planes", planes,
            "which of range, depth, amplitude, flags, samples, phasors; empty: the first four");
    v.text("calibration", calibration, kCalibrationHelp);
    v.flag("mirror", mirror, "left is right, as the camera sends it");
    v.quantity("nearest", nearest, metre, {0.05, 20.0}, "nearer depths are invalid");
    v.quantity("farthest", farthest, metre, {0.05, 20.0}, "farther depths are invalid");
    v.number("speed_of_light_m_per_s", speed_of_light, {2.9e8, 3.1e8},
             "that ranges are computed with; libfreenect2 takes 3e8, which reads 0.07 % too far");
    v.flag("bilateral_filter", bilateral_filter, "average phases over 3 x 3 pixels that are alike");
    v.flag("edge_filter", edge_filter, "drop pixels at edges and those that hang in between");
    v.flag("reset", reset,
           "reset the camera when it is opened, as libfreenect2 does; it may still be as another program "
           "left it");
    v.number("transfers", transfers, {2, 1000},
             "waiting at a time, a millisecond each; the kernel's limit for all USB programs together is 16 "
             "MB, which "
             "60 fit in");
    v.quantity(
        "delay", delay, millisecond, {0.0, 1000.0},
        "from a frame's device time until it is here, if you measured it; 0: unknown, anything up to a frame "
        "interval");
  }
};

struct About {
  using Keys = kinect2::Keys;
  static constexpr std::string_view name = "kinect2";
  static constexpr std::string_view summary =
      "Microsoft Kinect v2 over USB 3 (experimental: not yet run on the device)";
  static constexpr std::string_view remedy = "install libusb-1.0-0-dev and configure again";
};

Driver row();

class Bus;
/// As the row does, on any bus.
std::vector<std::string> listOn(Bus& bus);
Result<std::unique_ptr<Source>> openOn(Bus& bus, settings::Table& table);

}  // namespace toftwin::drivers::kinect2
