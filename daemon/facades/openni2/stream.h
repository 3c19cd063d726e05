// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <vector>

#include "daemon/facades/openni2/guarded.h"
#include "daemon/facades/openni2/stream_settings.h"

namespace toftwin::openni2 {

class Device;

/// One sensor's stream of an open device. Properties are set by the program's threads, frames come from the
/// device's link.
class Stream final : public oni::driver::StreamBase {
 public:
  Stream(Device& device, OniSensorType sensor);

  [[nodiscard]] OniSensorType sensor() const { return sensor_; }
  [[nodiscard]] bool isRunning() const { return is_running_; }
  [[nodiscard]] Device& device() const { return device_; }
  [[nodiscard]] bool isMirrored();
  void noteRate(int rate_hz);

  void deliver(const Frame& frame, const std::vector<double>& depth_per_range, int index);
  /// No frame comes any more, even one under way.
  void finish();

  OniBool isPropertySupported(int property) override;
  OniStatus getProperty(int property, void* data, int* size) override;
  OniStatus setProperty(int property, const void* data, int size) override;
  void notifyAllProperties() override;
  int getRequiredFrameSize() override;
  OniStatus start() override;
  void stop() override;
  OniStatus convertDepthToColorCoordinates(StreamBase* color, int x, int y, OniDepthPixel depth, int* color_x,
                                           int* color_y) override;

 private:
  /// Of the camera: the source's parameter that a property is, empty where it has none.
  [[nodiscard]] std::string parameterOf(int property) const;
  /// The camera cannot expose by itself, but programs ask before they set an exposure.
  [[nodiscard]] bool isFixed(int property) const;
  OniStatus setMode(const void* data, int size);
  bool fill(const Frame& frame, const std::vector<double>& depth_per_range, int index, OniFrame& out);

  Device& device_;
  OniSensorType sensor_;
  std::mutex settings_mutex_;
  StreamSettings settings_;
  std::mutex delivery_;  ///< held while a frame is handed over
  std::atomic<bool> is_running_{false};
};

}  // namespace toftwin::openni2
