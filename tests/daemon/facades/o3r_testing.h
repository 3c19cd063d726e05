// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "daemon/facades/o3r/device.h"

/// A unit with a 2D head at port0 and a 3D head at port2, whose source can be set as a simulated one.
namespace toftwin::daemon::test {

inline o3r::Device o3rDevice() {
  return {o3r::Identity{.name = "unit",
                        .address = "127.0.0.1",
                        .serial = "1",
                        .macs = {"02:00", "02:01"},
                        .diagnostic_port = 50'009},
          {o3r::PortIdentity{.number = 0, .is_3d = false, .pcic_port = 50'010, .serial = "2"},
           o3r::PortIdentity{.number = 2, .is_3d = true, .pcic_port = 50'012, .serial = "3"}},
          6.0};
}

inline o3r::UnitFacts o3rFacts() {
  o3r::UnitFacts facts{.host_ns = 1'700'000'000'000'000'000, .since_boot_ns = 1};
  o3r::PortFacts& head = facts.ports[2];
  head.camera = {.width = 224,
                 .height = 172,
                 .fx = 124.0,
                 .fy = 124.0,
                 .cx = 111.5,
                 .cy = 85.5,
                 .distortion = {},
                 .calibration_id = {}};
  head.parameters = {{.name = "exposure_us", .value = 1000.0, .bounds = {10.0, 8000.0}},
                     {.name = "exposure_ratio", .value = 25.0, .bounds = {2.0, 50.0}},
                     {.name = "frame_rate_hz", .value = 10.0, .bounds = {0.1, 60.0}},
                     {.name = "minimum_amplitude_electrons", .value = 300.0, .bounds = {0.0, 1e6}},
                     {.name = "spatial_filter", .value = 0.0, .bounds = {0.0, 3.0}},
                     {.name = "spatial_filter_reach", .value = 1.0, .bounds = {1.0, 2.0}},
                     {.name = "temporal_filter", .value = 0.0, .bounds = {0.0, 2.0}}};
  facts.ports[0] = {};
  return facts;
}

}  // namespace toftwin::daemon::test
