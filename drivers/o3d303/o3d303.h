// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/units.h>

#include "drivers/lens.h"
#include "drivers/source.h"

/// The ifm O3D303 (and its relatives O3D301, O3D302) over its own protocols: XML-RPC to configure
/// it, PCIC for frames.
namespace toftwin::drivers::o3d303 {

enum class Trigger { AsSet, FreeRun, Software };
enum class MeasuringRange { AsSet, Under5m, UpTo30m, MoreThan30m };
enum class Exposures { AsSet, Low, Moderate, High };
enum class Amplitude { Normalised, Raw };

/// The keys of a [[source]] table with driver = "o3d303".
struct Keys {
  std::string uri = "o3d303:192.168.0.69";
  std::string password;
  Trigger trigger = Trigger::AsSet;
  MeasuringRange measuring_range = MeasuringRange::AsSet;
  Exposures exposures = Exposures::AsSet;
  Duration exposure = 0_us;
  Frequency frame_rate = 0_Hz;
  int channel = -1;
  Amplitude amplitude = Amplitude::Normalised;
  std::string calibration;
  Duration delay = 0_ms;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("uri", uri,
           "o3d303: and the camera's address, with :port if its XML-RPC is not on port 80");
    v.text("password", password, "of the camera's configuration, if it has one");
    v.choice("trigger", trigger,
             {{"as_set", Trigger::AsSet},
              {"free_run", Trigger::FreeRun},
              {"software", Trigger::Software}},
             "what starts an exposure; as_set: as the camera is configured");
    v.choice("measuring_range", measuring_range,
             {{"as_set", MeasuringRange::AsSet},
              {"under_5m", MeasuringRange::Under5m},
              {"up_to_30m", MeasuringRange::UpTo30m},
              {"more_than_30m", MeasuringRange::MoreThan30m}},
             "one, two or three modulation frequencies");
    v.choice("exposures", exposures,
             {{"as_set", Exposures::AsSet},
              {"low", Exposures::Low},
              {"moderate", Exposures::Moderate},
              {"high", Exposures::High}},
             "one, two or three exposures per frame, for little, some or much contrast");
    v.quantity("exposure", exposure, microsecond, {0.0, 10'000.0}, "the longest one; 0: as set");
    v.quantity("frame_rate", frame_rate, hertz, {0.0, 30.0}, "in free run; 0: as set");
    v.number("channel", channel, {-1, 3},
             "of the modulation, so that cameras beside each other do not disturb each other; -1: "
             "as set");
    v.choice("amplitude", amplitude,
             {{"normalised", Amplitude::Normalised}, {"raw", Amplitude::Raw}},
             "which amplitude image: normalised by exposure time, or as measured");
    v.text("calibration", calibration, kCalibrationHelp);
    v.quantity(
        "delay", delay, millisecond, {0.0, 1000.0},
        "from a frame's device time until its first byte is here, if you measured it; 0: unknown, "
        "anything up to a frame interval");
  }
};

Driver row();

}  // namespace toftwin::drivers::o3d303
