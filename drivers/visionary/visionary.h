// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/units.h>

#include "drivers/lens.h"
#include "drivers/source.h"

/// A SICK Visionary-T Mini over its own protocols: CoLa 2 to set it, blobs for frames.
namespace toftwin::drivers::visionary {

/// The keys of a [[source]] table with driver = "visionary".
struct Keys {
  std::string uri = "visionary:192.168.1.10";
  std::string password = "CLIENT";
  Duration exposure = 0_us;
  Frequency frame_rate = 0_Hz;
  std::string calibration;
  Duration delay = 0_ms;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("uri", uri, "visionary: and the camera's address, with :port if its CoLa 2 is not on port 2122");
    v.text("password", password, "of the user level AuthorizedClient, to set the camera; the camera's own");
    v.quantity("exposure", exposure, microsecond, {0.0, 100'000.0}, "integrationTimeUs; 0: as set");
    v.quantity("frame_rate", frame_rate, hertz, {0.0, 60.0}, "framePeriodUs; 0: as set");
    v.text("calibration", calibration, kCalibrationHelp);
    v.quantity("delay", delay, millisecond, {0.0, 1000.0},
               "from a frame's time stamp until its first byte is here, if you measured it; 0: unknown, "
               "anything up to a "
               "frame interval");
  }
};

Driver row();

}  // namespace toftwin::drivers::visionary
