// SPDX-License-Identifier: Apache-2.0
#include "emulated_openni2.h"

#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <set>
#include <thread>

#define XN_NEW(type, ...) new type(__VA_ARGS__)
#define XN_DELETE(pointer) delete (pointer)
#include <openni2/Driver/OniDriverAPI.h>

namespace toftwin::test {
namespace {

using Emulated = EmulatedOpenNI2;
using Clock = std::chrono::steady_clock;

Emulated emulated;

template <class T>
OniStatus give(const T& value, void* data, int* size) {
  if (*size < static_cast<int>(sizeof value)) return ONI_STATUS_BAD_PARAMETER;
  std::memcpy(data, &value, sizeof value);
  *size = static_cast<int>(sizeof value);
  return ONI_STATUS_OK;
}
template <class T>
OniStatus take(T& value, const void* data, int size) {
  if (size != static_cast<int>(sizeof value)) return ONI_STATUS_BAD_PARAMETER;
  std::memcpy(&value, data, sizeof value);
  return ONI_STATUS_OK;
}

OniPixelFormat formatOf(OniSensorType sensor) {
  return sensor == ONI_SENSOR_DEPTH ? ONI_PIXEL_FORMAT_DEPTH_1_MM
         : sensor == ONI_SENSOR_IR  ? ONI_PIXEL_FORMAT_GRAY16
                                    : ONI_PIXEL_FORMAT_RGB888;
}
OniVideoMode modeOf(OniSensorType sensor) {
  return {formatOf(sensor), Emulated::kWidth, Emulated::kHeight, emulated.rate_hz};
}
std::int64_t interval_us() { return 1'000'000 / emulated.rate_hz; }

class Stream final : public oni::driver::StreamBase {
 public:
  explicit Stream(OniSensorType sensor) : sensor_(sensor) { ++emulated.open_streams; }
  ~Stream() override {
    stop();
    --emulated.open_streams;
  }

  OniStatus start() override {
    stop();
    ++emulated.running_streams;
    thread_ = std::jthread{[this](const std::stop_token& stop) { run(stop); }};
    return ONI_STATUS_OK;
  }
  void stop() override {
    if (!thread_.joinable()) return;
    thread_.request_stop();
    thread_.join();
    --emulated.running_streams;
  }

  OniBool isPropertySupported(int id) override {
    if (id == ONI_STREAM_PROPERTY_MAX_VALUE) return sensor_ == ONI_SENSOR_DEPTH ? TRUE : FALSE;
    const bool is_of_all =
        id == ONI_STREAM_PROPERTY_CROPPING || id == ONI_STREAM_PROPERTY_VIDEO_MODE ||
        id == ONI_STREAM_PROPERTY_HORIZONTAL_FOV || id == ONI_STREAM_PROPERTY_VERTICAL_FOV ||
        id == ONI_STREAM_PROPERTY_STRIDE || id == ONI_STREAM_PROPERTY_MIRRORING;
    const bool is_of_color =
        id == ONI_STREAM_PROPERTY_AUTO_EXPOSURE || id == ONI_STREAM_PROPERTY_EXPOSURE;
    return is_of_all || (is_of_color && sensor_ == ONI_SENSOR_COLOR) ? TRUE : FALSE;
  }
  OniStatus getProperty(int id, void* data, int* size) override {
    const OniVideoMode mode = modeOf(sensor_);
    const auto fov = static_cast<float>(Emulated::kFieldOfView_rad);
    switch (id) {
      case ONI_STREAM_PROPERTY_CROPPING:
        return give(OniCropping{}, data, size);
      case ONI_STREAM_PROPERTY_VIDEO_MODE:
        return give(mode, data, size);
      case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
      case ONI_STREAM_PROPERTY_VERTICAL_FOV:
        return give(fov, data, size);
      case ONI_STREAM_PROPERTY_MAX_VALUE:
        return give(10'000, data, size);
      case ONI_STREAM_PROPERTY_STRIDE:
        return give(mode.resolutionX * bytesPerPixel(), data, size);
      case ONI_STREAM_PROPERTY_MIRRORING:
        return give(is_mirrored_.load(), data, size);
      case ONI_STREAM_PROPERTY_AUTO_EXPOSURE:
        return give(is_automatic_, data, size);
      case ONI_STREAM_PROPERTY_EXPOSURE:
        return give(emulated.exposure.load(), data, size);
      default:
        return ONI_STATUS_NOT_SUPPORTED;
    }
  }
  OniStatus setProperty(int id, const void* data, int size) override {
    int value = 0;
    switch (id) {
      case ONI_STREAM_PROPERTY_VIDEO_MODE: {
        OniVideoMode mode{};
        if (take(mode, data, size) != ONI_STATUS_OK) return ONI_STATUS_BAD_PARAMETER;
        const OniVideoMode mine = modeOf(sensor_);
        return std::memcmp(&mode, &mine, sizeof mode) == 0 ? ONI_STATUS_OK
                                                           : ONI_STATUS_NOT_SUPPORTED;
      }
      case ONI_STREAM_PROPERTY_MIRRORING:
        if (take(value, data, size) != ONI_STATUS_OK) return ONI_STATUS_BAD_PARAMETER;
        is_mirrored_ = value;
        return ONI_STATUS_OK;
      case ONI_STREAM_PROPERTY_AUTO_EXPOSURE:
        return take(is_automatic_, data, size);
      case ONI_STREAM_PROPERTY_EXPOSURE:
        if (take(value, data, size) != ONI_STATUS_OK) return ONI_STATUS_BAD_PARAMETER;
        if (value < 1 || value > 100) return ONI_STATUS_BAD_PARAMETER;
        emulated.exposure = value;
        return ONI_STATUS_OK;
      default:
        return ONI_STATUS_NOT_SUPPORTED;
    }
  }

  /// A recorder asks for everything that a player needs.
  void notifyAllProperties() override {
    for (int id = ONI_STREAM_PROPERTY_CROPPING; id <= ONI_STREAM_PROPERTY_MIRRORING; ++id) {
      if (isPropertySupported(id) == FALSE) continue;
      char value[64];
      int size = sizeof value;
      if (getProperty(id, value, &size) == ONI_STATUS_OK) raisePropertyChanged(id, value, size);
    }
  }

 private:
  [[nodiscard]] int bytesPerPixel() const { return sensor_ == ONI_SENSOR_COLOR ? 3 : 2; }

  void run(const std::stop_token& stop) {
    const std::chrono::microseconds interval{interval_us()};
    const auto begin = Clock::now();
    const std::int64_t first = begin.time_since_epoch() / interval;  // all streams in step
    if (sensor_ == ONI_SENSOR_DEPTH) emulated.last_depth = first;
    if (sensor_ == ONI_SENSOR_IR) emulated.last_infrared = first;
    for (std::int64_t n = first + 1; !stop.stop_requested(); ++n) {
      std::this_thread::sleep_until(Clock::time_point{n * interval});
      waitForTheOther(n, stop);
      const bool is_silent =
          emulated.is_hung || (sensor_ == ONI_SENSOR_COLOR && emulated.is_color_silent);
      if (is_silent) continue;
      if (sensor_ == ONI_SENSOR_DEPTH && emulated.skip > 0) {
        --emulated.skip;
        continue;
      }
      send(n, static_cast<int>(n - first));
    }
  }

  void waitForTheOther(std::int64_t n, const std::stop_token& stop) const {
    const auto isToWait = [&] {
      return sensor_ == ONI_SENSOR_DEPTH ? emulated.last_infrared < n - 1 : emulated.last_depth < n;
    };
    while (emulated.is_in_step && isToWait() && !stop.stop_requested())
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }

  void send(std::int64_t n, int index) {
    OniFrame* frame = getServices().acquireFrame();
    if (frame == nullptr) return;
    const OniVideoMode mode = modeOf(sensor_);
    frame->sensorType = sensor_;
    frame->frameIndex = index;
    // The other cameras expose a little later.
    const std::int64_t lag_us = sensor_ == ONI_SENSOR_DEPTH ? 0 : interval_us() * 3 / 20;
    const std::int64_t stamp_us = n * interval_us() + emulated.clock_us + lag_us;
    frame->timestamp = emulated.has_stamps ? static_cast<std::uint64_t>(stamp_us) : 0;
    frame->width = mode.resolutionX;
    frame->height = mode.resolutionY;
    frame->videoMode = mode;
    frame->croppingEnabled = FALSE;
    frame->cropOriginX = frame->cropOriginY = 0;
    frame->stride = mode.resolutionX * bytesPerPixel();
    frame->dataSize = frame->stride * frame->height;
    draw(static_cast<unsigned char*>(frame->data), n);
    if (sensor_ == ONI_SENSOR_DEPTH) {
      frame->dataSize -= emulated.cut_bytes.exchange(0);
      if (const int width = emulated.wrong_width.exchange(0); width > 0) frame->width = width;
    }
    raiseNewFrame(frame);
    if (sensor_ == ONI_SENSOR_DEPTH) emulated.last_depth = n;
    if (sensor_ == ONI_SENSOR_IR) emulated.last_infrared = n;
    getServices().releaseFrame(frame);
  }

  void draw(unsigned char* out, std::int64_t n) const {
    for (int y = 0; y < Emulated::kHeight; ++y) {
      for (int column = 0; column < Emulated::kWidth; ++column) {
        const int x = is_mirrored_ != 0 ? Emulated::kWidth - 1 - column : column;
        if (sensor_ == ONI_SENSOR_COLOR) {
          *out++ = static_cast<unsigned char>(x);
          *out++ = static_cast<unsigned char>(y);
          *out++ = static_cast<unsigned char>(n);
          continue;
        }
        const std::uint16_t value =
            sensor_ == ONI_SENSOR_DEPTH ? Emulated::depthAt(n, x, y) : Emulated::infraredAt(x, y);
        std::memcpy(out, &value, sizeof value);
        out += sizeof value;
      }
    }
  }

  OniSensorType sensor_;
  std::atomic<int> is_mirrored_{1};  // as the PrimeSense sensors begin
  int is_automatic_ = 1;
  std::jthread thread_;
};

class Device final : public oni::driver::DeviceBase {
 public:
  OniStatus getSensorInfoList(OniSensorInfo** sensors, int* count) override {
    *sensors = sensors_;
    *count = 3;
    return ONI_STATUS_OK;
  }
  oni::driver::StreamBase* createStream(OniSensorType sensor) override {
    return new Stream{sensor};
  }
  void destroyStream(oni::driver::StreamBase* stream) override { delete stream; }

  OniBool isPropertySupported(int id) override {
    return id == ONI_DEVICE_PROPERTY_SERIAL_NUMBER || id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION
               ? TRUE
               : FALSE;
  }
  OniStatus getProperty(int id, void* data, int* size) override {
    if (id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION) return give(registration_, data, size);
    if (id != ONI_DEVICE_PROPERTY_SERIAL_NUMBER) return ONI_STATUS_NOT_SUPPORTED;
    constexpr char kSerial[] = "EMU-0001";
    if (*size < static_cast<int>(sizeof kSerial)) return ONI_STATUS_BAD_PARAMETER;
    std::memcpy(data, kSerial, sizeof kSerial);
    *size = sizeof kSerial;
    return ONI_STATUS_OK;
  }
  OniStatus setProperty(int id, const void* data, int size) override {
    return id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION ? take(registration_, data, size)
                                                        : ONI_STATUS_NOT_SUPPORTED;
  }
  OniBool isImageRegistrationModeSupported(OniImageRegistrationMode) override { return TRUE; }

 private:
  OniVideoMode modes_[3]{modeOf(ONI_SENSOR_IR), modeOf(ONI_SENSOR_COLOR), modeOf(ONI_SENSOR_DEPTH)};
  OniSensorInfo sensors_[3]{{ONI_SENSOR_IR, 1, &modes_[0]},
                            {ONI_SENSOR_COLOR, 1, &modes_[1]},
                            {ONI_SENSOR_DEPTH, 1, &modes_[2]}};
  OniImageRegistrationMode registration_ = ONI_IMAGE_REGISTRATION_OFF;
};

class Driver final : public oni::driver::DriverBase {
 public:
  explicit Driver(OniDriverServices* services) : DriverBase(services) {
    std::strcpy(info_.uri, Emulated::kUri);
    std::strcpy(info_.vendor, "toftwin");
    std::strcpy(info_.name, "emulated");
  }
  OniStatus initialize(oni::driver::DeviceConnectedCallback connected,
                       oni::driver::DeviceDisconnectedCallback disconnected,
                       oni::driver::DeviceStateChangedCallback changed, void* cookie) override {
    const OniStatus status = DriverBase::initialize(connected, disconnected, changed, cookie);
    current = this;
    emulated.unplug = [] { current.load()->unplug(); };
    emulated.plugIn = [] { current.load()->plugIn(); };
    if (is_plugged) deviceConnected(&info_);
    return status;
  }
  oni::driver::DeviceBase* deviceOpen(const char* uri, const char*) override {
    return is_plugged && std::strcmp(uri, Emulated::kUri) == 0 ? new Device : nullptr;
  }
  void deviceClose(oni::driver::DeviceBase* device) override { delete device; }
  void shutdown() override { current = nullptr; }

 private:
  void unplug() {
    is_plugged = false;
    emulated.is_hung = true;
    deviceDisconnected(&info_);
  }
  void plugIn() {
    emulated.is_hung = false;
    if (!is_plugged.exchange(true)) deviceConnected(&info_);
  }
  static inline std::atomic<Driver*> current{nullptr};
  static inline std::atomic<bool> is_plugged{true};
  OniDeviceInfo info_{};
};

}  // namespace
}  // namespace toftwin::test

using EmulatedDriver = toftwin::test::Driver;
ONI_EXPORT_DRIVER(EmulatedDriver)

extern "C" __attribute__((visibility("default"))) toftwin::test::EmulatedOpenNI2*
emulatedOpenNI2() {
  return &toftwin::test::emulated;
}
