// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sim/effects/effects.h"
#include "sim/sensor/correlate.h"

namespace toftwin::sim {

/// DecodeSettings::true_cycles of a frequency: what a factory measures when it moves a flat target away
/// from the camera, without noise. Multipath, scatter and saturation are not in it, so they are left
/// in the range, as on a real device. Where two ranges look alike, the table gives the farther one.
std::vector<float> trueCyclesOf(const Response& response, int steps);

/// DecodeSettings::pixel_turns: what a factory measures pixel by pixel, of a device with these effects:
/// those on light that depend on nothing but the pixel's position. In steps of 0.000031 π as in the Kinect
/// v2's p0 tables (libfreenect2).
std::vector<Image<std::complex<float>>> pixelTurnsOf(const std::vector<AnyEffect>& effects,
                                                     const std::vector<Response>& responses,
                                                     const CameraInfo& camera);

}  // namespace toftwin::sim
