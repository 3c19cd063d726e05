// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/units.h>

#include "daemon/facades/facade.h"
#include "daemon/facades/struck_frames.h"

/// An ifm O3D303 as its clients know it, in front of any source: XML-RPC to configure it, PCIC for frames,
/// UDP to be found.
namespace toftwin::daemon::o3d303 {

/// What goes wrong on purpose with the frames' PCIC messages, the same for all connections.
struct MessageLineKeys : FrameLineKeys {
  template <class Visitor>
  void visit(Visitor& v) {
    visitFrames(v);
    v.number("disconnect", disconnect, {0.0, 1.0},
             "share whose messages break off halfway, with the connections they are on");
    visitSeedAndLog(v);
  }
};

/// The keys of a [[facade]] table with kind = "o3d303".
struct Keys {
  int xmlrpc_port = 80;
  int pcic_port = 50'010;
  int discovery_port = 3321;
  bool discoverable = true;
  std::string name = "toftwin";
  std::string password;
  double electrons_per_count = 6.0;
  std::string intervals;
  Duration latency = 0_s;
  Duration boot_time = 0_s;
  Temperature most_illumination = 90_degC;
  MessageLineKeys line;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number(
        "xmlrpc_port", xmlrpc_port, {0, 65'535},
        "TCP port of the configuration, the camera's own by default; 0: any free one, which the log tells");
    v.number("pcic_port", pcic_port, {0, 65'535},
             "TCP port of the frames; clients ask for it (PcicTcpPort). 0: any free one");
    v.flag("discoverable", discoverable, "whether it answers the vendor's search for cameras");
    v.number("discovery_port", discovery_port, {1, 65'535}, "UDP port of that search");
    v.text("name", name, "of the camera, until a client sets another");
    v.text("password", password, "of the configuration; empty: none");
    v.number(
        "electrons_per_count", electrons_per_count, {1e-6, 1e9},
        "what one count of the camera's amplitude stands for in the source's unit; 6: the camera's usual "
        "MinimumAmplitude of 42 is sim:o3d303's 250 electrons; of sim:o3d303_binned 500 are 83");
    v.text("intervals", intervals,
           "a file with the intervals between a real camera's frames, one number in milliseconds per line, "
           "relative "
           "to this file: frames leave as unevenly as those; empty: as they come");
    v.quantity(
        "latency", latency, millisecond, {0.0, 10'000.0},
        "by how much later than the source's every frame leaves, as if the camera had taken that long");
    v.quantity(
        "boot_time", boot_time, second, {0.0, 600.0},
        "how long nobody answers after the facade's start and after a client's reboot; UpTime counts from "
        "there");
    v.quantity("most_illumination", most_illumination, celsius, {-40.0, 200.0},
               "clients are told the error 110004000 when the illumination gets hotter than that");
    v.group("line", line, "what goes wrong on purpose with the frames' messages");
  }
};

FacadeKind facade();

}  // namespace toftwin::daemon::o3d303
