// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stop_token>
#include <vector>

#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {

/// An object and the geometry id that it gets.
struct NumberedObject {
  unsigned id;
  const BuiltObject* object;
};

/// An Embree scene of these objects, ready to be traced. They must outlive it. If `stop` asks, it ends early and must
/// not be traced.
RTCScene makeEmbreeScene(RTCDevice device, const std::vector<NumberedObject>& objects, const std::stop_token& stop);

}  // namespace toftwin::sim
