// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include "sim/sensor/sensor_model.h"
#include "sim/tracer/transient.h"
#include "tools/cli/command.h"
#include "tools/cli/render_campaign.h"

namespace toftwin::cli {

/// What is traced for a histogram of path lengths: the light of a camera's emitters, without its modulation.
sim::TraceRequest transientRequest(const sim::SensorModel& camera, const drivers::simulator::Keys& keys,
                                   const Transform<World, Camera>& pose);

/// Writes the light of the scene at device time 0 by the length of its way (sim::Transient) as an NPY file,
/// bins × rows × columns, and beside it a TOML file that says where the bins lie and of what it is.
Result<Exit> renderTransient(const RenderOptions& options);

}  // namespace toftwin::cli
