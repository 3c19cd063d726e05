// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/facades/facade.h"
#include "daemon/facades/struck_frames.h"
#include "daemon/facades/usb_camera/uvc_descriptors.h"

/// Any source as a USB depth camera (UVC), which Linux machines plug in over USB/IP.
namespace toftwin::daemon::usb_camera {

/// What goes wrong on purpose with a frame's images, and with the cable.
struct CableKeys : FrameLineKeys {
  template <class Visitor>
  void visit(Visitor& v) {
    visitFrames(v);
    v.number(
        "disconnect", disconnect, {0.0, 1.0},
        "share instead of which the cable is pulled; a tenth of a second later the camera is there again");
    visitSeedAndLog(v);
  }
};

/// The keys of a [[facade]] table with kind = "usb_camera".
struct Keys {
  int port = 3240;
  std::string serial;
  int vendor_id = 0x1209;
  int product_id = 0x0001;
  UsbSpeed speed = UsbSpeed::High;
  Endpoint transfers = Endpoint::Bulk;
  double depth_unit_mm = 1.0;
  double amplitude_per_count = 1.0;
  CableKeys line;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("port", port, {0, 65'535},
             "TCP port, USB/IP's own by default; 0: any free one, which the log tells");
    v.text("serial", serial, "serial number; empty: the source's name");
    v.number("vendor_id", vendor_id, {0, 65'535},
             "USB's; 0x1209 with product 0x0001 is for tests (pid.codes)");
    v.number("product_id", product_id, {0, 65'535}, "USB's");
    v.choice(
        "speed", speed, {{"high", UsbSpeed::High}, {"super", UsbSpeed::Super}},
        "what it says of itself, USB 2 or USB 3; with bulk transfers, how fast frames come does not depend "
        "on it");
    v.choice(
        "transfers", transfers, {{"bulk", Endpoint::Bulk}, {"isochronous", Endpoint::Isochronous}},
        "how images are sent: as fast as the host takes them, or at most 24 MB/s (high), 98 MB/s (super)");
    v.number("depth_unit_mm", depth_unit_mm, {1e-3, 100.0},
             "of one count of the depth image, in millimetres: 1 reaches to 65.5 m");
    v.number("amplitude_per_count", amplitude_per_count, {1e-6, 1e9},
             "what one count of the infrared image stands for in the source's unit");
    v.group("line", line, "what goes wrong on purpose with a frame's images");
  }
};

FacadeKind facade();

}  // namespace toftwin::daemon::usb_camera
