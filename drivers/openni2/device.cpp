// SPDX-License-Identifier: Apache-2.0
#include "drivers/openni2/device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <thread>
#include <utility>

#include "drivers/openni2/images.h"

namespace toftwin::drivers::openni2 {
namespace {

/// What can be set while it runs: a property of the first stream that has it, of all streams, or of
/// the device.
struct Adjustable {
  std::string_view name;
  enum class Of { OneStream, AllStreams, Device } of;
  int property;
  bool is_switch;
};
constexpr std::array kAdjustables{
    Adjustable{"auto_exposure", Adjustable::Of::OneStream, ONI_STREAM_PROPERTY_AUTO_EXPOSURE, true},
    Adjustable{"auto_white_balance", Adjustable::Of::OneStream,
               ONI_STREAM_PROPERTY_AUTO_WHITE_BALANCE, true},
    Adjustable{"exposure", Adjustable::Of::OneStream, ONI_STREAM_PROPERTY_EXPOSURE, false},
    Adjustable{"gain", Adjustable::Of::OneStream, ONI_STREAM_PROPERTY_GAIN, false},
    Adjustable{"mirror", Adjustable::Of::AllStreams, ONI_STREAM_PROPERTY_MIRRORING, true},
    Adjustable{"registration", Adjustable::Of::Device, ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION,
               true},
};

template <class T>
std::optional<T> streamProperty(OniStreamHandle stream, int id) {
  T value{};
  int size = sizeof value;
  if (oniStreamGetProperty(stream, id, &value, &size) != ONI_STATUS_OK ||
      size != static_cast<int>(sizeof value)) {
    return std::nullopt;
  }
  return value;
}

std::span<const OniVideoMode> modesOf(OniDeviceHandle device, OniSensorType sensor) {
  const OniSensorInfo* info = oniDeviceGetSensorInfo(device, sensor);
  if (info == nullptr || info->numSupportedVideoModes <= 0) return {};
  return {info->pSupportedVideoModes, static_cast<std::size_t>(info->numSupportedVideoModes)};
}

bool isUsable(OniSensorType sensor, const OniVideoMode& mode) {
  constexpr int kLargest = 16384;
  const bool has_size = mode.resolutionX > 0 && mode.resolutionX <= kLargest &&
                        mode.resolutionY > 0 && mode.resolutionY <= kLargest;
  const bool has_format = sensor == ONI_SENSOR_DEPTH ? isDepth(formatOf(mode))
                          : sensor == ONI_SENSOR_IR  ? isInfrared(formatOf(mode))
                                                     : isColor(formatOf(mode));
  return has_size && has_format;
}

std::string textOf(const OniVideoMode& mode) {
  return fmt::format("{} x {} at {} Hz", mode.resolutionX, mode.resolutionY, mode.fps);
}

Result<OniVideoMode> depthMode(OniDeviceHandle device, const Keys& keys) {
  std::vector<std::string> there;
  for (const OniVideoMode& mode : modesOf(device, ONI_SENSOR_DEPTH)) {
    if (!isUsable(ONI_SENSOR_DEPTH, mode)) continue;
    const bool fits =
        (keys.width == 0 || keys.width == mode.resolutionX) &&
        (keys.height == 0 || keys.height == mode.resolutionY) &&
        (keys.frame_rate <= 0_Hz || std::abs(keys.frame_rate.in(hertz)-mode.fps) < 0.5);
    if (fits) return mode;
    there.push_back(textOf(mode));
  }
  if (there.empty()) {
    return Error{Error::Code::Incompatible,
                 "openni2: the device has no depth in units of 1 mm or 0.1 mm"};
  }
  return Error{
      Error::Code::Incompatible,
      fmt::format("openni2: there is no depth of that width, height and frame_rate_hz; there "
                  "is: {}",
                  fmt::join(there, ", "))};
}

/// Of the depth image's size, and its rate if there is one.
std::optional<OniVideoMode> companionMode(OniDeviceHandle device, OniSensorType sensor,
                                          const OniVideoMode& depth) {
  std::optional<OniVideoMode> best;
  for (const OniVideoMode& mode : modesOf(device, sensor)) {
    if (!isUsable(sensor, mode) || mode.resolutionX != depth.resolutionX ||
        mode.resolutionY != depth.resolutionY) {
      continue;
    }
    if (!best || (best->fps != depth.fps && mode.fps == depth.fps)) best = mode;
  }
  return best;
}

}  // namespace

Result<Device> Device::open(const std::string& uri, const Keys& keys) {
  Device device;
  OniDeviceHandle handle = nullptr;
  OniStatus status = ONI_STATUS_ERROR;
  device.reading_ = ReadingThread::startedBy([&] { status = oniDeviceOpen(uri.c_str(), &handle); });
  if (status != ONI_STATUS_OK) return failure(fmt::format("{} cannot be opened", uri), status);
  device.handle_.reset(handle);
  if (oniDeviceGetInfo(handle, &device.info_) != ONI_STATUS_OK) device.info_ = {};
  device.readFileAsAsked();
  const auto depth = depthMode(handle, keys);
  if (!depth) return depth.error();
  device.rate_hz_ = depth->fps;
  if (auto added = device.addStream(ONI_SENSOR_DEPTH, *depth); !added) return added.error();
  if (auto added = device.addCompanions(keys); !added) return added.error();
  if (uri.ends_with(".oni")) return device;  // what a file shows cannot be changed
  if (auto configured = device.configure(keys); !configured) return configured.error();
  return device;
}

Device& Device::operator=(Device&& other) noexcept {
  close();
  handle_ = std::move(other.handle_);
  info_ = other.info_;
  streams_ = std::move(other.streams_);
  started_at_ = std::exchange(other.started_at_, std::nullopt);
  stopped_at_ = other.stopped_at_;
  rate_hz_ = other.rate_hz_;
  reading_ = other.reading_;
  return *this;
}

void Device::close() {
  if (handle_ == nullptr) return;
  stop();
  if (stopped_at_) settle(*stopped_at_);
  if (reading_) reading_->waitUntilAsleep();
  streams_.clear();
  // At the end of a file, the library's reading thread looks at streams that are gone.
  settle(std::chrono::steady_clock::now());
  handle_.reset();
}

/// Waits two frames from then on. A device's thread that is told to stop before it has begun may
/// never hear it, may go on for a frame after it was told, and needs its stream until then
/// (OpenNI's own Dummy does all three); started again before, it would run twice.
void Device::settle(SteadyTime since) const {
  const std::chrono::duration<double> two_frames{2.0 / std::max(1, rate_hz_)};
  std::this_thread::sleep_until(since +
                                std::chrono::duration_cast<std::chrono::nanoseconds>(two_frames));
}

/// A file is read frame by frame as we ask, which loses none: the library's own pace is 4 % fast,
/// and its own loop leaves out the last frame.
void Device::readFileAsAsked() const {
  const float as_asked = -1.0F;
  const OniBool once = FALSE;
  const auto has = [&](int id) { return oniDeviceIsPropertySupported(handle_.get(), id) != FALSE; };
  if (has(ONI_DEVICE_PROPERTY_PLAYBACK_SPEED)) {
    oniDeviceSetProperty(handle_.get(), ONI_DEVICE_PROPERTY_PLAYBACK_SPEED, &as_asked,
                         sizeof as_asked);
  }
  if (has(ONI_DEVICE_PROPERTY_PLAYBACK_REPEAT_ENABLED)) {
    oniDeviceSetProperty(handle_.get(), ONI_DEVICE_PROPERTY_PLAYBACK_REPEAT_ENABLED, &once,
                         sizeof once);
  }
}

Result<> Device::addStream(OniSensorType sensor, const OniVideoMode& mode) {
  OniStreamHandle handle = nullptr;
  OniStatus status = oniDeviceCreateStream(handle_.get(), sensor, &handle);
  if (status != ONI_STATUS_OK) return failure("a stream cannot be created", status);
  Stream stream{sensor, mode, StreamPtr{handle}};
  const auto now = streamProperty<OniVideoMode>(handle, ONI_STREAM_PROPERTY_VIDEO_MODE);
  const bool is_so =
      !now || (formatOf(*now) == formatOf(mode) && now->fps == mode.fps &&
               now->resolutionX == mode.resolutionX && now->resolutionY == mode.resolutionY);
  if (!is_so) {
    status = oniStreamSetProperty(handle, ONI_STREAM_PROPERTY_VIDEO_MODE, &mode, sizeof mode);
    if (status != ONI_STATUS_OK)
      return failure(fmt::format("{} cannot be set", textOf(mode)), status);
  }
  streams_.push_back(std::move(stream));
  return {};
}

Result<> Device::addCompanions(const Keys& keys) {
  const OniVideoMode depth = streams_.front().mode;
  bool has_infrared = false;
  for (const auto& [sensor, use, name] : {std::tuple{ONI_SENSOR_IR, keys.infrared, "infrared"},
                                          {ONI_SENSOR_COLOR, keys.color, "color"}}) {
    if (use == Use::No || (use == Use::Auto && has_infrared)) continue;
    const auto mode = companionMode(handle_.get(), sensor, depth);
    if (!mode && use == Use::Auto) continue;
    if (!mode) {
      return Error{
          Error::Code::Incompatible,
          fmt::format("openni2: {} = \"yes\", but the device has no such image of the depth "
                      "image's {} x {}; choose another width and height",
                      name, depth.resolutionX, depth.resolutionY)};
    }
    if (auto added = addStream(sensor, *mode); !added) return added;
    has_infrared = sensor == ONI_SENSOR_IR;
  }
  return {};
}

Result<> Device::configure(const Keys& keys) {
  const int registration = keys.registration == Registration::DepthToColor ? 1 : 0;
  if (keys.registration != Registration::AsSet && property("registration") != registration) {
    const auto mode = static_cast<OniImageRegistrationMode>(registration);
    if (registration == 1 &&
        oniDeviceIsImageRegistrationModeSupported(handle_.get(), mode) == FALSE) {
      return Error{Error::Code::Incompatible,
                   "openni2: the device cannot register depth to colour; leave out registration"};
    }
    if (auto set = setParameter("registration", registration); !set && registration == 1)
      return set;
  }
  const int mirror = keys.mirror == Mirror::On ? 1 : 0;
  if (keys.mirror == Mirror::AsSet || property("mirror").value_or(0) == mirror) return {};
  return setParameter("mirror", mirror);
}

Result<> Device::start() {
  if (stopped_at_) settle(*stopped_at_);
  for (const Stream& stream : streams_) {
    const OniStatus status = oniStreamStart(stream.handle.get());
    if (status == ONI_STATUS_OK) {
      started_at_ = std::chrono::steady_clock::now();
      continue;
    }
    stop();
    return failure(
        fmt::format("the {} stream does not start; some devices give infrared or colour, "
                    "not both",
                    stream.sensor == ONI_SENSOR_DEPTH ? "depth"
                    : stream.sensor == ONI_SENSOR_IR  ? "infrared"
                                                      : "colour"),
        status);
  }
  return {};
}

void Device::stop() {
  if (!started_at_) return;
  settle(*std::exchange(started_at_, std::nullopt));
  for (const Stream& stream : streams_) oniStreamStop(stream.handle.get());
  stopped_at_ = std::chrono::steady_clock::now();
}

std::string Device::serial() const {
  std::array<char, ONI_MAX_STR> text{};
  int size = static_cast<int>(text.size()) - 1;
  const bool has_one =
      oniDeviceIsPropertySupported(handle_.get(), ONI_DEVICE_PROPERTY_SERIAL_NUMBER) != FALSE &&
      oniDeviceGetProperty(handle_.get(), ONI_DEVICE_PROPERTY_SERIAL_NUMBER, text.data(), &size) ==
          ONI_STATUS_OK;
  return has_one ? std::string{text.data()} : std::string{info_.uri};
}

std::optional<Angle> Device::fieldOfView() const {
  const auto radians =
      streamProperty<float>(streams_.front().handle.get(), ONI_STREAM_PROPERTY_HORIZONTAL_FOV);
  if (!radians || !(*radians > 0.01F && *radians < 3.1F)) return std::nullopt;
  return static_cast<double>(*radians) * radian;
}

// ---- parameters --------------------------------------------------------------------------------

/// The colour camera's before the depth camera's: it is the one whose exposure can be set.
OniStreamHandle Device::streamWith(int property) const {
  for (auto stream = streams_.rbegin(); stream != streams_.rend(); ++stream) {
    OniStreamHandle handle = stream->handle.get();
    if (oniStreamIsPropertySupported(handle, property) != FALSE &&
        streamProperty<int>(handle, property)) {
      return handle;
    }
  }
  return nullptr;
}

std::optional<int> Device::property(std::string_view name) const {
  if (!isOpen()) return std::nullopt;
  const auto one = std::ranges::find(kAdjustables, name, &Adjustable::name);
  if (one->of != Adjustable::Of::Device) {
    const OniStreamHandle stream = streamWith(one->property);
    return stream == nullptr ? std::nullopt : streamProperty<int>(stream, one->property);
  }
  int value = 0, size = sizeof value;
  const bool is_there =
      oniDeviceIsPropertySupported(handle_.get(), one->property) != FALSE &&
      oniDeviceGetProperty(handle_.get(), one->property, &value, &size) == ONI_STATUS_OK;
  return is_there ? std::optional{value} : std::nullopt;
}

std::vector<Parameter> Device::parameters() const {
  std::vector<Parameter> parameters;
  const bool is_automatic = property("auto_exposure").value_or(0) != 0;
  for (const Adjustable& one : kAdjustables) {
    const auto value = property(one.name);
    if (!value) continue;
    Parameter parameter{.name = std::string{one.name}, .value = *value};
    if (one.is_switch) parameter.bounds = {0.0, 1.0};
    if (is_automatic && (one.name == "exposure" || one.name == "gain")) parameter.value.reset();
    parameters.push_back(std::move(parameter));
  }
  return parameters;
}

Result<> Device::setParameter(std::string_view name, double value) {
  const auto one = std::ranges::find(kAdjustables, name, &Adjustable::name);
  if (one == kAdjustables.end() || !property(name)) {
    std::vector<std::string> names;
    for (const Parameter& parameter : parameters()) names.push_back(parameter.name);
    return Error{Error::Code::NotFound,
                 fmt::format("the device has no parameter \"{}\"; it has: {}", name,
                             names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")))};
  }
  constexpr double kMost = 2'147'483'647.0;
  const double least = one->is_switch ? 0.0 : -kMost, most = one->is_switch ? 1.0 : kMost;
  if (!(value >= least && value <= most) || value != std::floor(value)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} = {} is out of bounds: it must be {}", name, value,
                             one->is_switch ? "0 or 1" : "a whole number")};
  }
  const int number = static_cast<int>(value);
  std::vector<OniStreamHandle> streams;
  if (one->of == Adjustable::Of::OneStream) streams.push_back(streamWith(one->property));
  if (one->of == Adjustable::Of::AllStreams) {
    for (const Stream& stream : streams_) streams.push_back(stream.handle.get());
  }
  OniStatus status = ONI_STATUS_OK;
  if (streams.empty()) {
    status = oniDeviceSetProperty(handle_.get(), one->property, &number, sizeof number);
  }
  for (OniStreamHandle stream : streams) {
    if (status != ONI_STATUS_OK) break;
    status = oniStreamSetProperty(stream, one->property, &number, sizeof number);
  }
  if (status == ONI_STATUS_OK) return {};
  return Error{Error::Code::InvalidArgument,
               failure(fmt::format("the device refuses {} = {}", name, value), status).message};
}

}  // namespace toftwin::drivers::openni2
