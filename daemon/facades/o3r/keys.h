// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/units.h>

#include "daemon/facades/facade.h"
#include "daemon/facades/struck_frames.h"

/// An ifm O3R as its clients know it: a video processing unit with heads at its ports, each of which is a
/// source. XML-RPC with one JSON configuration, PCIC for each port's frames, UDP to be found.
namespace toftwin::daemon::o3r {

/// What goes wrong on purpose with the frames' PCIC messages, of all ports.
struct MessageLineKeys : FrameLineKeys {
  template <class Visitor>
  void visit(Visitor& v) {
    visitFrames(v);
    v.number("disconnect", disconnect, {0.0, 1.0},
             "share whose messages break off halfway, with the connections they are on");
    visitSeedAndLog(v);
  }
};

/// The keys of a [[facade]] table with kind = "o3r".
struct Keys {
  int xmlrpc_port = 80;
  int pcic_port = 50'010;
  int diagnostic_port = 50'009;
  bool discoverable = true;
  int discovery_port = 3321;
  std::string name = "toftwin";
  std::vector<std::string> ports;
  double electrons_per_count = 6.0;
  Length longest_range = 10_m;
  double jpeg_quality = 90;
  MessageLineKeys line;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number(
        "xmlrpc_port", xmlrpc_port, {0, 65'535},
        "TCP port of the configuration, the device's own by default; 0: any free one, which the log tells");
    v.number("pcic_port", pcic_port, {0, 65'529},
             "TCP port of the frames of port0; port1 has the next one, and so on; clients ask for it "
             "(data/pcicTCPPort). 0: any free ones");
    v.number("diagnostic_port", diagnostic_port, {0, 65'535},
             "TCP port of device/diagnostic, on which no frames come");
    v.flag("discoverable", discoverable, "whether it answers the vendor's search for devices");
    v.number("discovery_port", discovery_port, {1, 65'535}, "UDP port of that search");
    v.text("name", name, "of the device (device/info/name), until a client sets another");
    v.texts(
        "ports", ports,
        "what is plugged in: for port0, port1, and so on to port5 the name of a [[source]] for its 3D "
        "images, NAME/2D "
        "for its colour image, or \"\" for nothing. Empty: source at port2, 3D, as in the vendor's examples");
    v.number("electrons_per_count", electrons_per_count, {1e-6, 1e9},
             "what one count of amplitude stands for in the source's unit, before it is divided by the "
             "exposure time");
    v.quantity("longest_range", longest_range, metre, {0.1, 1000.0},
               "of the distance image, which has 65,535 steps up to there: 10 m as in a real head");
    v.number("jpeg_quality", jpeg_quality, {1, 100}, "of the colour image");
    v.group("line", line, "what goes wrong on purpose with the frames' messages");
  }
};

FacadeKind facade();

}  // namespace toftwin::daemon::o3r
