// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/frame.h>

#include "calib/compare/json.h"

/// Cameras and recordings in words and as JSON, for `toftwin info` and `toftwin replay`.
namespace toftwin::cli {

compare::Json toJson(const CameraInfo& camera);
std::string toText(const CameraInfo& camera);
/// Nanoseconds since 1970 as "2026-11-21 08:15:00.123 UTC"; "unknown" for 0.
std::string toText(HostTime time);
std::string namesOf(const std::vector<PlaneKind>& planes);
/// "512×424 range, …" of what the frame holds.
std::string planesOf(const Frame& frame);

}  // namespace toftwin::cli
