// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/units.h>

#include <string>

#include "daemon/facades/facade.h"
#include "daemon/facades/line_faults.h"

/// Any source as a GigE Vision 3D camera: GVCP to find, describe and set it, GVSP for frames, GenICam's SFNC
/// for names.
namespace toftwin::daemon::gige_vision {

/// The keys of a [[facade]] table with kind = "gige_vision".
struct Keys {
  std::string serial;
  std::string user_name;
  double scale_mm = 0.5;
  double amplitude_per_count = 1.0;
  int packet_size = 1500;
  double packet_delay_us = 10.0;
  int resend_mb = 64;
  LineFaultKeys line;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("serial", serial, "serial number, at most 15 bytes; empty: the source's name");
    v.text("user_name", user_name,
           "name that a user gave (DeviceUserID), at most 15 bytes, until a client sets another");
    v.number("scale_mm", scale_mm, {1e-3, 100.0},
             "of one count of the 16-bit coordinate formats, in millimetres: 0.5 reaches to 32.7 m");
    v.number("amplitude_per_count", amplitude_per_count, {1e-6, 1e9},
             "what one count of the intensity image stands for in the source's unit");
    v.number("packet_size", packet_size, {576, 16'112},
             "bytes of a packet with all headers, until a client sets another (GevSCPSPacketSize)");
    v.number("packet_delay_us", packet_delay_us, {0.0, 1000.0},
             "at least, between two packets, until a client sets another (GevSCPD); 0: at once");
    v.number("resend_mb", resend_mb, {1, 4096}, "of frames that were sent are kept, to be sent once more");
    v.group("line", line, "what goes wrong on purpose with the packets of frames");
  }
};

FacadeKind facade();

}  // namespace toftwin::daemon::gige_vision
