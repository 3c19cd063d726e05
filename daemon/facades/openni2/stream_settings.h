// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openni2/OniCProperties.h>
#include <openni2/OniCTypes.h>

#include <array>
#include <optional>

#include "daemon/facades/openni2/facts.h"
#include "daemon/facades/openni2/images.h"

namespace toftwin::openni2 {

/// The properties of a stream that are ours alone; those of the camera are Stream's. Belongs to one thread at a
/// time.
class StreamSettings {
 public:
  StreamSettings(OniSensorType sensor, const Facts& facts, const Keys& keys);

  static constexpr std::array<int, 8> kProperties{
      ONI_STREAM_PROPERTY_CROPPING,       ONI_STREAM_PROPERTY_HORIZONTAL_FOV, ONI_STREAM_PROPERTY_VERTICAL_FOV,
      ONI_STREAM_PROPERTY_VIDEO_MODE,     ONI_STREAM_PROPERTY_MAX_VALUE,      ONI_STREAM_PROPERTY_MIN_VALUE,
      ONI_STREAM_PROPERTY_STRIDE,         ONI_STREAM_PROPERTY_MIRRORING};
  [[nodiscard]] bool has(int property) const;
  OniStatus get(int property, void* data, int* size) const;
  /// Everything but the frame rate of a video mode, which is the camera's.
  OniStatus set(int property, const void* data, int size);

  /// The mode that these bytes ask for, if the sensor has it, whatever its frame rate.
  [[nodiscard]] std::optional<OniVideoMode> modeIn(const void* data, int size) const;
  void setRate(int rate_hz) { image_.mode.fps = rate_hz; }

  /// How images are drawn as it is set up.
  [[nodiscard]] const ImageSetup& image() const { return image_; }
  [[nodiscard]] const OniCropping& cropping() const { return cropping_; }
  [[nodiscard]] int bytesPerRow() const;
  /// Of an uncropped image.
  [[nodiscard]] int mostBytes() const;

 private:
  OniStatus crop(const OniCropping& cropping);

  OniSensorType sensor_;
  int width_, height_;
  float horizontal_fov_rad_, vertical_fov_rad_;
  ImageSetup image_;
  OniCropping cropping_;
};

}  // namespace toftwin::openni2
