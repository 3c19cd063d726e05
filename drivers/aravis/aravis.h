// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <toftwin/units.h>

#include "drivers/lens.h"
#include "drivers/source.h"

/// GigE Vision and USB3 Vision cameras, through libaravis.
namespace toftwin::drivers::aravis {

enum class Trigger { AsSet, FreeRun, Software, Hardware };
enum class Measures { AsSaid, Depth, Range };

/// The keys of a [[source]] table with driver = "aravis".
struct Keys {
  std::string uri = "aravis:any";
  std::vector<std::string> components;
  std::string pixel_format;
  std::vector<std::string> set;
  std::vector<std::string> parameters;
  Trigger trigger = Trigger::AsSet;
  std::string trigger_source = "Line1";
  Frequency frame_rate = 0_Hz;
  Measures measures = Measures::AsSaid;
  Length unit = 0_mm;
  double least_confidence = 1.0;
  LensKeys lens;
  std::string calibration;
  int packet_size = 0;
  bool resend = true;
  Duration packet_timeout = 20_ms;
  Duration frame_retention = 100_ms;
  int socket_buffer_kb = 0;
  Duration heartbeat = 1500_ms;
  int buffers = 8;
  bool chunks = false;
  bool ptp = false;
  Duration delay = 0_ms;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("uri", uri,
           "aravis: and the camera's IP address, or its serial number, its name that a user gave, "
           "its MAC address or its whole name (vendor-model-serial), or any");
    v.texts("components", components,
            "which images it sends, by their GenICam names (Range, Intensity, Confidence); empty: "
            "as the camera is set");
    v.text("pixel_format", pixel_format,
           "of the range image, by its GenICam name (Coord3D_C16); empty: as the camera is set");
    v.texts("set", set,
            "features to be set whenever it is opened, in this order: \"ExposureTime = 1000\", "
            "\"TriggerActivation = FallingEdge\"");
    v.texts("parameters", parameters,
            "the features that clients can read and set while it runs, by their GenICam names; empty: those "
            "for exposure and gain that the camera has");
    v.choice("trigger", trigger,
             {{"as_set", Trigger::AsSet},
              {"free_run", Trigger::FreeRun},
              {"software", Trigger::Software},
              {"hardware", Trigger::Hardware}},
             "what starts a frame; as_set: as the camera is set");
    v.text("trigger_source", trigger_source, "the input of a hardware trigger");
    v.quantity("frame_rate", frame_rate, hertz, {0, 1000}, "in free run; 0: as the camera is set");
    v.choice(
        "measures", measures,
        {{"as_said", Measures::AsSaid}, {"depth", Measures::Depth}, {"range", Measures::Range}},
        "what a single coordinate C is: along the optical axis, or along each pixel's ray; "
        "as_said: range where the camera says Spherical, else depth");
    v.quantity(
        "unit", unit, millimetre, {0, 1000},
        "length of one unit of its coordinates; 0: as the camera says, 1 if it says nothing");
    v.number("least_confidence", least_confidence, {0, 65535},
             "a pixel of less confidence is invalid, in the camera's unit");
    v.group("lens", lens, "of the range image, if the camera does not say it");
    v.text("calibration", calibration, kCalibrationHelp);
    v.number(
        "packet_size", packet_size, {0, 65535},
        "bytes of a GigE packet; 0: the largest that comes through, found out when it is opened");
    v.flag("resend", resend, "whether lost packets are asked for again");
    v.quantity("packet_timeout", packet_timeout, millisecond, {1, 10000},
               "until a packet that was asked for again is asked for once more");
    v.quantity("frame_retention", frame_retention, millisecond, {1, 10000},
               "how long an incomplete frame waits for its packets before it is lost");
    v.number("socket_buffer_kb", socket_buffer_kb, {0, 1048576},
             "of the stream's socket; 0: two frames, a megabyte at least (the kernel's "
             "net.core.rmem_max bounds it)");
    v.quantity(
        "heartbeat", heartbeat, millisecond, {0, 60000},
        "how long a GigE camera waits for a daemon that has vanished; 0: as the camera is set");
    v.number("buffers", buffers, {2, 64}, "frames that can wait before some are lost");
    v.flag(
        "chunks", chunks,
        "whether the camera adds what it measured to each frame (chunk data: ChunkExposureTime)");
    v.flag("ptp", ptp, "whether the camera's clock follows the network's (IEEE 1588)");
    v.quantity("delay", delay, millisecond, {0, 1000},
               "from a frame's device time until its first packet is here, if you measured it; 0: "
               "unknown, anything up to a frame interval");
  }
};

struct About {
  using Keys = aravis::Keys;
  static constexpr std::string_view name = "aravis";
  static constexpr std::string_view summary = "GigE Vision and USB3 Vision cameras (GenICam)";
  static constexpr std::string_view remedy = "install libaravis-dev and configure again";
};

Driver row();

}  // namespace toftwin::drivers::aravis
