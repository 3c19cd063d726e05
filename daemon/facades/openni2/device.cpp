// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/openni2/device.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

#include "daemon/facades/openni2/properties.h"

namespace toftwin::openni2 {
namespace {

constexpr std::array kSensors{ONI_SENSOR_DEPTH, ONI_SENSOR_IR, ONI_SENSOR_COLOR};
constexpr OniVersion kVersion{ONI_TOFTWIN_MAJOR, ONI_TOFTWIN_MINOR, ONI_TOFTWIN_PATCH, 0};

}  // namespace

Result<std::unique_ptr<Device>> Device::open(Place place, const Configuration& configuration,
                                             Services services) {
  const Keys& keys = configuration.keys;
  std::unique_ptr<Device> device{new Device{keys, std::move(services)}};
  Device* const self = device.get();
  auto link = CameraLink::open(
      std::move(place),
      {configuration.unevenness, std::chrono::nanoseconds{std::llround(keys.latency.in(nanosecond))}},
      {.frame = [self](const Frame& frame, int index) { guarded([&] { self->show(frame, index); }); },
       .state = [self](OniDeviceState state) { guarded([&] { self->services_.state(state); }); }});
  if (!link) return link.error();
  auto facts = factsOf((*link)->details());
  if (!facts) return facts.error();
  device->facts_ = *std::move(facts);
  device->rate_hz_ = device->facts_.rate_hz;
  if (device->facts_.has_depth && device->facts_.distance == PlaneKind::Range)
    device->depth_per_range_ = depthPerRange(device->facts_.camera);
  device->describeSensors();
  device->link_ = *std::move(link);
  return device;
}

Device::~Device() { finish(); }

bool Device::finish() { return link_ == nullptr || link_->finish(); }

void Device::describeSensors() {
  for (const OniSensorType sensor : kSensors) {
    if (facts_.has(sensor)) modes_.push_back(facts_.modesOf(sensor));
  }
  auto modes = modes_.begin();
  for (const OniSensorType sensor : kSensors) {
    if (!facts_.has(sensor)) continue;
    sensors_.push_back({sensor, static_cast<int>(modes->size()), modes->data()});
    ++modes;
  }
}

// ---- streams -----------------------------------------------------------------------------------

OniStatus Device::getSensorInfoList(OniSensorInfo** sensors, int* count) {
  if (sensors == nullptr || count == nullptr) return ONI_STATUS_BAD_PARAMETER;
  *sensors = sensors_.data();
  *count = static_cast<int>(sensors_.size());
  return ONI_STATUS_OK;
}

oni::driver::StreamBase* Device::createStream(OniSensorType sensor) {
  return guarded(static_cast<oni::driver::StreamBase*>(nullptr), [&]() -> oni::driver::StreamBase* {
    if (!facts_.has(sensor)) return nullptr;
    auto stream = std::make_shared<Stream>(*this, sensor);
    const std::scoped_lock lock{mutex_};
    stream->noteRate(rate_hz_);
    streams_.push_back(stream);
    return stream.get();
  });
}

void Device::destroyStream(oni::driver::StreamBase* stream) {
  guarded([&] {
    std::shared_ptr<Stream> gone;
    {
      const std::scoped_lock lock{mutex_};
      const auto one = std::ranges::find(streams_, stream, [](const auto& s) -> oni::driver::StreamBase* { return s.get(); });
      if (one == streams_.end()) return;
      gone = *one;
      streams_.erase(one);
    }
    gone->finish();
    streamsChanged();
  });
}

/// What is subscribed to is what all streams need, so that one that starts a little later disturbs no other.
void Device::streamsChanged() {
  // Two streams that change at once: what is wanted last must be what was found last.
  const std::scoped_lock one_after_the_other{wanting_};
  std::vector<PlaneKind> planes;
  bool is_any_running = false;
  {
    const std::scoped_lock lock{mutex_};
    for (const auto& stream : streams_) {
      is_any_running = is_any_running || stream->isRunning();
      planes.push_back(planeOf(stream->sensor(), facts_));
    }
  }
  link_->want(is_any_running ? std::move(planes) : std::vector<PlaneKind>{});
}

void Device::show(const Frame& frame, int index) {
  std::vector<std::shared_ptr<Stream>> streams;
  {
    const std::scoped_lock lock{mutex_};
    streams = streams_;
  }
  is_registered_ = kNotAsked;
  for (const auto& stream : streams) stream->deliver(frame, depth_per_range_, index);
}

OniStatus Device::tryManualTrigger() {
  return guarded(ONI_STATUS_ERROR, [&] {
    if (facts_.can_trigger) link_->poke();
    return ONI_STATUS_OK;
  });
}

// ---- what the camera can be set to ---------------------------------------------------------------

std::optional<int> Device::parameter(const std::string& name) {
  const auto details = link_->describe();
  if (!details) {
    complain(details.error().message);
    return std::nullopt;
  }
  const auto one = std::ranges::find(details->parameters, name, &Parameter::name);
  if (one == details->parameters.end() || !one->value || !(std::abs(*one->value) < 2e9)) return std::nullopt;
  return static_cast<int>(std::lround(*one->value));
}

OniStatus Device::setParameter(const std::string& name, double value) {
  is_registered_ = kNotAsked;
  return statusOf(link_->setParameter(name, value), services_.complain);
}

OniStatus Device::setRate(int rate_hz) {
  const std::string& name = facts_.parameters.frame_rate;
  if (name.empty()) {
    complain("toftwin: the frame rate of this source cannot be set");
    return ONI_STATUS_NOT_SUPPORTED;
  }
  if (const OniStatus status = setParameter(name, rate_hz); status != ONI_STATUS_OK) return status;
  const std::scoped_lock lock{mutex_};
  rate_hz_ = rate_hz;
  for (const auto& stream : streams_) stream->noteRate(rate_hz);
  return ONI_STATUS_OK;
}

// ---- properties --------------------------------------------------------------------------------

/// Programs convert pixel by pixel: the daemon is asked once a frame.
bool Device::isRegistered() {
  const std::string& name = facts_.parameters.registration;
  if (name.empty()) return true;
  if (const int known = is_registered_; known != kNotAsked) return known != 0;
  const auto now = parameter(name);
  if (now) is_registered_ = *now == 0 ? 0 : 1;
  return now.value_or(0) != 0;
}

OniBool Device::isImageRegistrationModeSupported(OniImageRegistrationMode mode) {
  return mode == ONI_IMAGE_REGISTRATION_OFF || (mode == ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR && facts_.has_color)
             ? TRUE
             : FALSE;
}

OniBool Device::isPropertySupported(int property) {
  switch (property) {
    case ONI_DEVICE_PROPERTY_FIRMWARE_VERSION:
    case ONI_DEVICE_PROPERTY_DRIVER_VERSION:
    case ONI_DEVICE_PROPERTY_HARDWARE_VERSION:
    case ONI_DEVICE_PROPERTY_SERIAL_NUMBER:
      return TRUE;
    case ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION:
      return facts_.has_color ? TRUE : FALSE;
    default:
      return FALSE;
  }
}

OniStatus Device::getProperty(int property, void* data, int* size) {
  return guarded(ONI_STATUS_ERROR, [&] {
    if (isPropertySupported(property) == FALSE) return ONI_STATUS_NOT_SUPPORTED;
    switch (property) {
      case ONI_DEVICE_PROPERTY_FIRMWARE_VERSION:
        return giveText(TOFTWIN_VERSION, data, size);
      case ONI_DEVICE_PROPERTY_DRIVER_VERSION:
        return give(kVersion, data, size);
      case ONI_DEVICE_PROPERTY_HARDWARE_VERSION:
        return give(OniHardwareVersion{0}, data, size);
      case ONI_DEVICE_PROPERTY_SERIAL_NUMBER:
        return giveText(facts_.serial, data, size);
      default: {
        const bool is_chosen = facts_.parameters.registration.empty();
        return give(is_chosen ? registration_.load() : int{isRegistered()}, data, size);
      }
    }
  });
}

OniStatus Device::setProperty(int property, const void* data, int size) {
  return guarded(ONI_STATUS_ERROR, [&] {
    return property == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION && facts_.has_color
               ? setRegistration(data, size)
               : ONI_STATUS_NOT_SUPPORTED;
  });
}

/// Colour lies over depth already where the source has no such parameter: then both modes show the same.
OniStatus Device::setRegistration(const void* data, int size) {
  int mode = 0;
  if (!take(mode, data, size) || mode < 0 || mode > 1) return ONI_STATUS_BAD_PARAMETER;
  const std::string& name = facts_.parameters.registration;
  if (!name.empty()) return setParameter(name, mode);
  registration_ = mode;
  return ONI_STATUS_OK;
}

void Device::notifyAllProperties() {
  guarded([&] {
    for (int property = 0; property <= ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION; ++property) {
      std::array<char, ONI_MAX_STR> value{};
      int size = static_cast<int>(value.size());
      if (getProperty(property, value.data(), &size) == ONI_STATUS_OK)
        raisePropertyChanged(property, value.data(), size);
    }
  });
}

}  // namespace toftwin::openni2
