// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openni2/OniCTypes.h>

#include <string>
#include <vector>

#include <toftwin/client.h>
#include <toftwin/result.h>

#include "daemon/facades/openni2/keys.h"

namespace toftwin::openni2 {

/// The names of the source's parameters that are properties here; empty where it has none.
struct ParameterNames {
  std::string exposure, gain, auto_exposure, auto_white_balance, frame_rate, registration;
};

/// What a device is, from the source's description.
struct Facts {
  int width = 0, height = 0, rate_hz = 0;
  float horizontal_fov_rad = 0.0F, vertical_fov_rad = 0.0F;
  CameraInfo camera;
  PlaneKind distance = PlaneKind::Depth;  ///< that of depth and range that is asked for
  bool has_depth = false, has_infrared = false, has_color = false;
  ParameterNames parameters;
  std::string model, serial;
  bool can_trigger = false;

  /// Depth's first format is millimetres.
  [[nodiscard]] std::vector<OniVideoMode> modesOf(OniSensorType sensor) const;
  [[nodiscard]] bool has(OniSensorType sensor) const;
};

/// Errors say what OpenNI2 cannot show of that source.
Result<Facts> factsOf(const SourceDetails& details);

/// The plane that a sensor's image is made of.
PlaneKind planeOf(OniSensorType sensor, const Facts& facts);

int bytesPerPixel(OniPixelFormat format);

}  // namespace toftwin::openni2
