// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/openni2/stream.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/facades/openni2/device.h"
#include "daemon/facades/openni2/properties.h"

namespace toftwin::openni2 {
namespace {

constexpr std::array<int, 4> kOfTheCamera{ONI_STREAM_PROPERTY_AUTO_WHITE_BALANCE, ONI_STREAM_PROPERTY_AUTO_EXPOSURE,
                                  ONI_STREAM_PROPERTY_EXPOSURE, ONI_STREAM_PROPERTY_GAIN};

}  // namespace

Stream::Stream(Device& device, OniSensorType sensor)
    : device_(device), sensor_(sensor), settings_(sensor, device.facts(), device.keys()) {}

void Stream::noteRate(int rate_hz) {
  const std::scoped_lock lock{settings_mutex_};
  settings_.setRate(rate_hz);
}

bool Stream::isMirrored() {
  const std::scoped_lock lock{settings_mutex_};
  return settings_.image().is_mirrored;
}

// ---- frames ------------------------------------------------------------------------------------

void Stream::deliver(const Frame& frame, const std::vector<double>& depth_per_range, int index) {
  const std::scoped_lock lock{delivery_};
  if (!is_running_) return;
  OniFrame* out = getServices().acquireFrame();
  if (out == nullptr) return;
  if (fill(frame, depth_per_range, index, *out)) raiseNewFrame(out);
  getServices().releaseFrame(out);
}

bool Stream::fill(const Frame& frame, const std::vector<double>& depth_per_range, int index, OniFrame& out) {
  const std::scoped_lock lock{settings_mutex_};
  const ImageSetup& image = settings_.image();
  const auto room = static_cast<std::size_t>(std::max(0, out.dataSize));
  const std::size_t size =
      draw(frame, depth_per_range, image, {static_cast<std::byte*>(out.data), out.data == nullptr ? 0 : room});
  if (size == 0) return false;
  out.dataSize = static_cast<int>(size);
  out.sensorType = sensor_;
  out.timestamp = stampOf(frame);
  out.frameIndex = index;
  out.width = image.window.width;
  out.height = image.window.height;
  out.videoMode = image.mode;
  out.croppingEnabled = settings_.cropping().enabled;
  out.cropOriginX = image.window.x;
  out.cropOriginY = image.window.y;
  out.stride = settings_.bytesPerRow();
  return true;
}

OniStatus Stream::start() {
  return guarded(ONI_STATUS_ERROR, [&] {
    is_running_ = true;
    device_.streamsChanged();
    return ONI_STATUS_OK;
  });
}

void Stream::stop() {
  guarded([&] {
    finish();
    device_.streamsChanged();
  });
}

void Stream::finish() {
  is_running_ = false;
  const std::scoped_lock one_under_way{delivery_};
}

int Stream::getRequiredFrameSize() {
  const std::scoped_lock lock{settings_mutex_};
  return settings_.mostBytes();
}

// ---- properties --------------------------------------------------------------------------------

std::string Stream::parameterOf(int property) const {
  const ParameterNames& names = device_.facts().parameters;
  const bool is_color = sensor_ == ONI_SENSOR_COLOR;
  switch (property) {
    case ONI_STREAM_PROPERTY_AUTO_WHITE_BALANCE:
      return is_color ? names.auto_white_balance : "";
    case ONI_STREAM_PROPERTY_AUTO_EXPOSURE:
      return is_color ? "" : names.auto_exposure;
    case ONI_STREAM_PROPERTY_EXPOSURE:
      return is_color ? "" : names.exposure;
    case ONI_STREAM_PROPERTY_GAIN:
      return is_color ? "" : names.gain;
    default:
      return {};
  }
}

bool Stream::isFixed(int property) const {
  return property == ONI_STREAM_PROPERTY_AUTO_EXPOSURE && parameterOf(property).empty() &&
         !parameterOf(ONI_STREAM_PROPERTY_EXPOSURE).empty();
}

OniBool Stream::isPropertySupported(int property) {
  return guarded(OniBool{FALSE}, [&] {
    return settings_.has(property) || isFixed(property) || !parameterOf(property).empty() ? OniBool{TRUE}
                                                                                            : OniBool{FALSE};
  });
}

OniStatus Stream::getProperty(int property, void* data, int* size) {
  return guarded(ONI_STATUS_ERROR, [&] {
    if (isFixed(property)) return give(OniBool{FALSE}, data, size);
    const std::string parameter = parameterOf(property);
    if (!parameter.empty()) {
      const auto value = device_.parameter(parameter);
      return value ? give(*value, data, size) : ONI_STATUS_ERROR;
    }
    const std::scoped_lock lock{settings_mutex_};
    return settings_.get(property, data, size);
  });
}

OniStatus Stream::setProperty(int property, const void* data, int size) {
  return guarded(ONI_STATUS_ERROR, [&] {
    if (property == ONI_STREAM_PROPERTY_VIDEO_MODE) return setMode(data, size);
    const std::string parameter = parameterOf(property);
    if (parameter.empty() && !isFixed(property)) {
      const std::scoped_lock lock{settings_mutex_};
      return settings_.set(property, data, size);
    }
    int value = 0;
    if (!take(value, data, size)) return ONI_STATUS_BAD_PARAMETER;
    if (!parameter.empty()) return device_.setParameter(parameter, value);
    if (value == FALSE) return ONI_STATUS_OK;
    device_.complain("toftwin: this camera does not choose its exposure by itself");
    return ONI_STATUS_NOT_SUPPORTED;
  });
}

OniStatus Stream::setMode(const void* data, int size) {
  std::optional<OniVideoMode> mode;
  {
    const std::scoped_lock lock{settings_mutex_};
    mode = settings_.modeIn(data, size);
    if (mode && mode->fps == settings_.image().mode.fps)
      return settings_.set(ONI_STREAM_PROPERTY_VIDEO_MODE, data, size);
  }
  if (!mode) {
    device_.complain("toftwin: the source has no such format or resolution");
    return ONI_STATUS_BAD_PARAMETER;
  }
  // The frame rate is the camera's, and with it that of all streams.
  if (const OniStatus changed = device_.setRate(mode->fps); changed != ONI_STATUS_OK) return changed;
  const std::scoped_lock lock{settings_mutex_};
  return settings_.set(ONI_STREAM_PROPERTY_VIDEO_MODE, data, size);
}

void Stream::notifyAllProperties() {
  guarded([&] {
    const auto tell = [&](int property) {
      std::array<char, 64> value{};
      int size = static_cast<int>(value.size());
      if (isPropertySupported(property) != FALSE && getProperty(property, value.data(), &size) == ONI_STATUS_OK)
        raisePropertyChanged(property, value.data(), size);
    };
    for (const int property : StreamSettings::kProperties) tell(property);
    for (const int property : kOfTheCamera) tell(property);
  });
}

/// The colour that a frame has at a pixel is what the colour camera sees there, laid over the depth image.
OniStatus Stream::convertDepthToColorCoordinates(StreamBase* color, int x, int y, OniDepthPixel /*depth*/,
                                                 int* color_x, int* color_y) {
  return guarded(ONI_STATUS_ERROR, [&] {
    auto* const other = dynamic_cast<Stream*>(color);
    const Facts& facts = device_.facts();
    if (other == nullptr || color_x == nullptr || color_y == nullptr) return ONI_STATUS_BAD_PARAMETER;
    if (x < 0 || x >= facts.width || y < 0 || y >= facts.height) return ONI_STATUS_BAD_PARAMETER;
    if (!device_.isRegistered()) {
      device_.complain("toftwin: only registered images say where depth is in the colour image");
      return ONI_STATUS_NOT_SUPPORTED;
    }
    *color_x = isMirrored() == other->isMirrored() ? x : facts.width - 1 - x;
    *color_y = y;
    return ONI_STATUS_OK;
  });
}

}  // namespace toftwin::openni2
