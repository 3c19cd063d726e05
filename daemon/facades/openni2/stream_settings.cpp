// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/openni2/stream_settings.h"

#include <algorithm>

#include "daemon/facades/openni2/properties.h"

namespace toftwin::openni2 {

StreamSettings::StreamSettings(OniSensorType sensor, const Facts& facts, const Keys& keys)
    : sensor_(sensor),
      width_(facts.width),
      height_(facts.height),
      horizontal_fov_rad_(facts.horizontal_fov_rad),
      vertical_fov_rad_(facts.vertical_fov_rad),
      image_{.mode = facts.modesOf(sensor).front(),
             .window = {0, 0, facts.width, facts.height},
             .is_mirrored = keys.mirror,
             .max_depth = keys.max_depth,
             .amplitude_per_count = keys.amplitude_per_count},
      cropping_{FALSE, 0, 0, facts.width, facts.height} {}

bool StreamSettings::has(int property) const {
  const bool is_of_numbers = property == ONI_STREAM_PROPERTY_MAX_VALUE || property == ONI_STREAM_PROPERTY_MIN_VALUE;
  return std::ranges::count(kProperties, property) > 0 && !(is_of_numbers && sensor_ == ONI_SENSOR_COLOR);
}

int StreamSettings::bytesPerRow() const { return image_.window.width * bytesPerPixel(image_.mode.pixelFormat); }
int StreamSettings::mostBytes() const { return width_ * height_ * bytesPerPixel(image_.mode.pixelFormat); }

OniStatus StreamSettings::get(int property, void* data, int* size) const {
  if (!has(property)) return ONI_STATUS_NOT_SUPPORTED;
  constexpr int kMost16 = 65'535;
  const bool is_depth = sensor_ == ONI_SENSOR_DEPTH;
  switch (property) {
    case ONI_STREAM_PROPERTY_CROPPING:
      return give(cropping_, data, size);
    case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
      return give(horizontal_fov_rad_, data, size);
    case ONI_STREAM_PROPERTY_VERTICAL_FOV:
      return give(vertical_fov_rad_, data, size);
    case ONI_STREAM_PROPERTY_VIDEO_MODE:
      return give(image_.mode, data, size);
    case ONI_STREAM_PROPERTY_MAX_VALUE:
      return give(is_depth ? maxDepthCode(image_.mode.pixelFormat, image_.max_depth) : kMost16, data, size);
    case ONI_STREAM_PROPERTY_MIN_VALUE:
      return give(0, data, size);
    case ONI_STREAM_PROPERTY_STRIDE:
      return give(bytesPerRow(), data, size);
    case ONI_STREAM_PROPERTY_MIRRORING:
      return give(OniBool{image_.is_mirrored ? TRUE : FALSE}, data, size);
    default:
      return ONI_STATUS_NOT_SUPPORTED;
  }
}

OniStatus StreamSettings::set(int property, const void* data, int size) {
  if (property == ONI_STREAM_PROPERTY_VIDEO_MODE) {
    const auto mode = modeIn(data, size);
    if (!mode) return ONI_STATUS_BAD_PARAMETER;
    image_.mode.pixelFormat = mode->pixelFormat;
    return ONI_STATUS_OK;
  }
  if (property == ONI_STREAM_PROPERTY_CROPPING) {
    OniCropping cropping{};
    return take(cropping, data, size) ? crop(cropping) : ONI_STATUS_BAD_PARAMETER;
  }
  if (property == ONI_STREAM_PROPERTY_MIRRORING) {
    OniBool on = FALSE;
    if (!take(on, data, size)) return ONI_STATUS_BAD_PARAMETER;
    image_.is_mirrored = on != FALSE;
    return ONI_STATUS_OK;
  }
  return ONI_STATUS_NOT_SUPPORTED;
}

std::optional<OniVideoMode> StreamSettings::modeIn(const void* data, int size) const {
  std::array<int, 4> asked{};  // first as numbers: any number may stand where an enumerator should
  static_assert(sizeof asked == sizeof(OniVideoMode));
  if (!take(asked, data, size)) return std::nullopt;
  const auto [format, width, height, rate_hz] = asked;
  const bool is_depth = sensor_ == ONI_SENSOR_DEPTH;
  const bool fits = is_depth ? format == ONI_PIXEL_FORMAT_DEPTH_1_MM || format == ONI_PIXEL_FORMAT_DEPTH_100_UM
                             : format == static_cast<int>(image_.mode.pixelFormat);
  if (!fits || width != width_ || height != height_ || rate_hz <= 0) return std::nullopt;
  return OniVideoMode{static_cast<OniPixelFormat>(format), width, height, rate_hz};
}

OniStatus StreamSettings::crop(const OniCropping& cropping) {
  if (cropping.enabled == FALSE) {
    cropping_ = {FALSE, 0, 0, width_, height_};
  } else {
    const bool fits = cropping.width > 0 && cropping.width <= width_ && cropping.height > 0 &&
                      cropping.height <= height_ && cropping.originX >= 0 &&
                      cropping.originX <= width_ - cropping.width && cropping.originY >= 0 &&
                      cropping.originY <= height_ - cropping.height;
    if (!fits) return ONI_STATUS_BAD_PARAMETER;
    cropping_ = cropping;
    cropping_.enabled = TRUE;
  }
  image_.window = {cropping_.originX, cropping_.originY, cropping_.width, cropping_.height};
  return ONI_STATUS_OK;
}

}  // namespace toftwin::openni2
