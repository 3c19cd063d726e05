// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/facades/facade.h"
#include "daemon/facades/struck_frames.h"

/// A SICK Visionary-T Mini as its clients know it, in front of any source: CoLa 2 to set it, blobs for
/// frames.
namespace toftwin::daemon::visionary {

/// What goes wrong on purpose with the frames' blobs, the same for all connections.
struct BlobLineKeys : FrameLineKeys {
  template <class Visitor>
  void visit(Visitor& v) {
    visitFrames(v);
    v.number("disconnect", disconnect, {0.0, 1.0},
             "share whose blobs break off halfway, with the connections they are on");
    visitSeedAndLog(v);
  }
};

/// The keys of a [[facade]] table with kind = "visionary".
struct Keys {
  int control_port = 2122;
  int stream_port = 2114;
  std::string client_password = "CLIENT";
  std::string maintenance_password = "MAIN";
  std::string service_password;
  double amplitude_per_count = 1.0;
  BlobLineKeys line;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("control_port", control_port, {0, 65'535},
             "TCP port of CoLa 2, the camera's own by default, which the maker's clients have built in; 0: "
             "any free one, "
             "which the log tells");
    v.number("stream_port", stream_port, {0, 65'535},
             "TCP port of the frames; clients ask for it (BlobTcpPortAPI). 0: any free one");
    v.text("client_password", client_password,
           "of the user level AuthorizedClient, which sets the camera; the camera's own");
    v.text("maintenance_password", maintenance_password, "of the user level Maintenance; the camera's own");
    v.text("service_password", service_password, "of the user level Service; empty: nobody logs in there");
    v.number("amplitude_per_count", amplitude_per_count, {1e-6, 1e9},
             "what one count of the intensity image stands for in the source's unit");
    v.group("line", line, "what goes wrong on purpose with the frames' blobs");
  }
};

FacadeKind facade();

}  // namespace toftwin::daemon::visionary
