// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/client.h>
#include <toftwin/frame.h>
#include <toftwin/parameter.h>

#include "calib/compare/json.h"
#include "protocol/record/frame_times.h"

/// Cameras and recordings in words and as JSON, for `toftwin info` and `toftwin replay`.
namespace toftwin::cli {

/// "streaming", "idle" or "absent".
std::string_view stateOf(const SourceEntry& source);
/// Those that show the source.
std::vector<FacadeHealthEntry> facadesOf(const DaemonHealth& health, const std::string& source);
compare::Json toJson(const std::vector<FacadeHealthEntry>& facades);
/// "o3d303 running, 2 clients: XML-RPC on 127.0.0.1 port 80", or why it is not there.
std::string toText(const FacadeHealthEntry& facade);
compare::Json toJson(const CameraInfo& camera);
std::string toText(const CameraInfo& camera);
compare::Json toJson(const Transform<World, Camera>& world_from_camera);
/// Place, rotation and axis, one a line.
std::string toText(const Transform<World, Camera>& world_from_camera);
compare::Json toJson(const std::vector<Parameter>& parameters);
/// A line for each: name, value, bounds.
std::string toText(const std::vector<Parameter>& parameters);
/// Nanoseconds since 1970 as "2026-11-21 08:15:00.123 UTC"; "unknown" for 0.
std::string toText(HostTime time);
/// "the host's clock jumped by +1795940967.900 s at frame 25, from 1970-01-01 … to …".
std::string toText(const record::ClockJump& jump);
std::string namesOf(const std::vector<PlaneKind>& planes);
/// "512×424 range, …" of what the frame holds.
std::string planesOf(const Frame& frame);

}  // namespace toftwin::cli
