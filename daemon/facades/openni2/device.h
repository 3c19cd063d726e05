// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "daemon/facades/openni2/camera_link.h"
#include "daemon/facades/openni2/facts.h"
#include "daemon/facades/openni2/guarded.h"
#include "daemon/facades/openni2/stream.h"

namespace toftwin::openni2 {

/// An open device: a source, with a connection of its own.
class Device final : public oni::driver::DeviceBase {
 public:
  struct Services {
    Complain complain;
    std::function<void(OniDeviceState)> state;
  };
  static Result<std::unique_ptr<Device>> open(Place place, const Configuration& configuration,
                                              Services services);
  ~Device() override;

  /// False: a thread is held up in OpenNI2; the device must not be freed.
  bool finish();

  // For its streams:
  [[nodiscard]] const Facts& facts() const { return facts_; }
  [[nodiscard]] const Keys& keys() const { return keys_; }
  void complain(std::string_view what) const { services_.complain(what); }
  void streamsChanged();
  std::optional<int> parameter(const std::string& name);
  OniStatus setParameter(const std::string& name, double value);
  OniStatus setRate(int rate_hz);
  [[nodiscard]] bool isRegistered();

  OniStatus getSensorInfoList(OniSensorInfo** sensors, int* count) override;
  oni::driver::StreamBase* createStream(OniSensorType sensor) override;
  void destroyStream(oni::driver::StreamBase* stream) override;
  OniBool isPropertySupported(int property) override;
  OniStatus getProperty(int property, void* data, int* size) override;
  OniStatus setProperty(int property, const void* data, int size) override;
  void notifyAllProperties() override;
  OniBool isImageRegistrationModeSupported(OniImageRegistrationMode mode) override;
  OniStatus tryManualTrigger() override;

 private:
  Device(Keys keys, Services services) : keys_(std::move(keys)), services_(std::move(services)) {}
  void show(const Frame& frame, int index);
  void describeSensors();
  OniStatus setRegistration(const void* data, int size);

  Keys keys_;
  Services services_;
  Facts facts_;
  std::vector<double> depth_per_range_;  ///< only for sources without depth
  std::vector<std::vector<OniVideoMode>> modes_;
  std::vector<OniSensorInfo> sensors_;
  std::atomic<int> registration_{ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR};
  static constexpr int kNotAsked = -1;
  std::atomic<int> is_registered_{kNotAsked};  ///< as the source last said, until the next frame
  std::mutex wanting_;                         ///< held from looking at the streams until the link knows
  std::mutex mutex_;
  int rate_hz_ = 0;
  std::vector<std::shared_ptr<Stream>> streams_;  // shared with a frame under way
  std::unique_ptr<CameraLink> link_;              // last: its thread uses the rest
};

}  // namespace toftwin::openni2
