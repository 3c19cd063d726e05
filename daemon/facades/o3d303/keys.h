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

enum class Timing { Camera, Fast };

/// The keys of a [[facade]] table with kind = "o3d303".
struct Keys {
  int xmlrpc_port = 80;
  int pcic_port = 50'010;
  int discovery_port = 3321;
  bool discoverable = true;
  std::string name = "toftwin";
  std::string password;
  double electrons_per_count = 6.0;
  Timing timing = Timing::Camera;
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
    v.choice("timing", timing, {{"camera", Timing::Camera}, {"fast", Timing::Fast}},
             "camera: frames leave when a real O3D303's did, set to these exposure times, frequencies and "
             "this frame "
             "rate, some are left out when it cannot keep up, and a reboot takes 10 s unless boot_time_s "
             "says how long; "
             "fast: frames leave as the source gives them, and a reboot takes no time");
    v.quantity("most_illumination", most_illumination, celsius, {-40.0, 200.0},
               "clients are told the error 110004000 when the illumination gets hotter than that");
    v.group("line", line, "what goes wrong on purpose with the frames' messages");
  }
};

FacadeKind facade();

}  // namespace toftwin::daemon::o3d303
