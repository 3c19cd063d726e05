// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/units.h>

#include "drivers/lens.h"
#include "drivers/source.h"

/// A 3D head of an ifm O3R over the unit's own protocols: XML-RPC with its JSON configuration, PCIC for
/// frames.
namespace toftwin::drivers::o3r {

/// The keys of a [[source]] table with driver = "o3r".
struct Keys {
  std::string uri = "o3r:192.168.0.69/port2";
  Duration exposure = 0_us;
  Frequency frame_rate = 0_Hz;
  std::string calibration;
  Duration delay = 0_ms;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("uri", uri,
           "o3r: and the unit's address, with :port if its XML-RPC is not on port 80, then / and the head's "
           "port; port2 if "
           "that is left out");
    v.quantity("exposure", exposure, microsecond, {0.0, 10'000.0},
               "the longest one (exposureLong); 0: as set");
    v.quantity("frame_rate", frame_rate, hertz, {0.0, 20.0}, "0: as set");
    v.text("calibration", calibration, kCalibrationHelp);
    v.quantity("delay", delay, millisecond, {0.0, 1000.0},
               "from a frame's time stamp until its first byte is here, if you measured it; 0: unknown, "
               "anything up to a "
               "frame interval");
  }
};

Driver row();

}  // namespace toftwin::drivers::o3r
