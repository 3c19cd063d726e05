// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/parameter.h>
#include <toftwin/result.h>

#include "drivers/openni2/library.h"
#include "drivers/openni2/openni2.h"
#include "drivers/openni2/reading_thread.h"
#include "drivers/pace.h"

namespace toftwin::drivers::openni2 {

struct Stream {
  OniSensorType sensor = ONI_SENSOR_DEPTH;
  OniVideoMode mode{};
  StreamPtr handle;
};

/// An open device with the streams that the keys ask for; the depth stream is the first. Streams
/// are stopped and destroyed before the device is closed.
class Device {
 public:
  static Result<Device> open(const std::string& uri, const Keys& keys);
  Device(Device&& other) noexcept { *this = std::move(other); }
  Device& operator=(Device&& other) noexcept;
  ~Device() { close(); }
  void close();
  [[nodiscard]] bool isOpen() const { return handle_ != nullptr; }

  Result<> start();
  void stop();

  [[nodiscard]] const std::vector<Stream>& streams() const { return streams_; }
  [[nodiscard]] const OniDeviceInfo& info() const { return info_; }
  [[nodiscard]] std::string serial() const;
  [[nodiscard]] std::optional<Angle> fieldOfView() const;  ///< horizontal, of the depth stream

  /// Those of kAdjustables that it has.
  [[nodiscard]] std::vector<Parameter> parameters() const;
  Result<> setParameter(std::string_view name, double value);

 private:
  Device() = default;
  void settle(SteadyTime since) const;
  void readFileAsAsked() const;
  Result<> addStream(OniSensorType sensor, const OniVideoMode& mode);
  Result<> addCompanions(const Keys& keys);
  Result<> configure(const Keys& keys);
  [[nodiscard]] std::optional<int> property(std::string_view name) const;
  [[nodiscard]] OniStreamHandle streamWith(int property) const;

  DevicePtr handle_;
  OniDeviceInfo info_{};
  std::vector<Stream> streams_;
  int rate_hz_ = 30;
  std::optional<SteadyTime> started_at_, stopped_at_;
  std::optional<ReadingThread> reading_;  ///< of a file
};

}  // namespace toftwin::drivers::openni2
