// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <toftwin/frame.h>

#include "sim/sensor/registration.h"
#include "sim/sensor/sensor_model.h"

namespace toftwin::sim {

/// The planes that simulated cameras can give, in the order in which they give them.
std::span<const PlaneKind> allPlanes();
/// Those that this one can give.
std::vector<PlaneKind> planesOfCamera(const SensorModel& model);

/// The camera of a region of the image: the same rays, counted from the region's top left pixel.
CameraInfo cameraOfRegion(const CameraInfo& camera, int left, int top, int width, int height);

/// What was exposed as planes, one for each kind asked for, in that order; but
/// Color, which is of another lens, and LightSigma, which is of the light, are left out. `left`, `top` say
/// where the images lie in the full image. Range and depth are finite and positive, or NaN where the flags
/// say Invalid: a range that an effect pushed to zero or below becomes invalid here. Samples of two taps are
/// given as their difference, which is what such cameras hand out.
std::vector<Plane> planesOf(const SensorModel& model, SensorModel::Exposed exposed,
                            const Truth& truth, std::span<const PlaneKind> kinds, int left = 0,
                            int top = 0);

/// Colours as a plane of three channels.
Plane planeOf(const ColorImage& color);

/// What the tracer's own noise leaves in the range, as it states it itself: one standard deviation [m], a
/// channel for each frequency; the range is that of this frequency alone, before effects on the light. NaN
/// where no light comes back, and everywhere where one sample a pixel was taken. Says nothing of bias.
Plane lightSigmaOf(const Light& light);

/// Where a frame of this model, scene and seed comes from.
Provenance provenanceOf(const SensorModel& model, std::string scene_id, std::uint64_t seed);

}  // namespace toftwin::sim
