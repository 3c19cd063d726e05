// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <mutex>
#include <string>

#include "daemon/facades/openni2/device.h"
#include "daemon/facades/openni2/discovery.h"
#include "daemon/facades/openni2/guarded.h"
#include "daemon/facades/openni2/keys.h"

namespace toftwin::openni2 {
namespace {

/// The way to something that may be gone: for threads that are left behind (Worker::finish). Nothing is locked while
/// it is used, so a user that OpenNI2 holds up holds up no other.
template <class T>
class WayTo {
 public:
  explicit WayTo(T* end) : end_(end) {}
  /// What began before may go on, in a thread that is held up in OpenNI2 or is the caller; nothing begins any more.
  void close() {
    const std::scoped_lock lock{mutex_};
    end_ = nullptr;
  }
  template <class Use>
  void with(Use use) {
    if (T* const end = now()) use(*end);
  }

 private:
  T* now() {
    const std::scoped_lock lock{mutex_};
    return end_;
  }
  std::mutex mutex_;
  T* end_;
};

/// What OpenNI2 creates once when it starts and destroys when it ends.
class Driver final : public oni::driver::DriverBase {
 public:
  explicit Driver(OniDriverServices* services) : DriverBase(services) {}

  OniStatus initialize(oni::driver::DeviceConnectedCallback connected,
                       oni::driver::DeviceDisconnectedCallback disconnected,
                       oni::driver::DeviceStateChangedCallback changed, void* cookie) override {
    return guarded(ONI_STATUS_ERROR, [&] {
      const OniStatus status = DriverBase::initialize(connected, disconnected, changed, cookie);
      configuration_ = std::make_unique<Result<Configuration>>(configurationHere());
      // What is wrong with it is told to who opens a device of ours, not to every program that starts OpenNI2.
      if (!*configuration_ || (*configuration_)->is_off) return status;
      discovery_ = std::make_unique<Discovery>(
          (*configuration_)->keys.addresses,
          Discovery::Events{[way = way_](const OniDeviceInfo& info) {
                              way->with([&](Driver& it) { it.deviceConnected(&info); });
                            },
                            [way = way_](const OniDeviceInfo& info) {
                              way->with([&](Driver& it) { it.deviceDisconnected(&info); });
                            },
                            [way = way_](const OniDeviceInfo& info, OniDeviceState state) {
                              way->with([&](Driver& it) { it.deviceStateChanged(&info, state); });
                            }});
      return status;
    });
  }

  void shutdown() override {
    guarded([&] {
      // A thread that is left behind tells of nothing more (Discovery), and would find nobody to tell.
      if (discovery_ != nullptr) discovery_->finish();
      way_->close();
      discovery_.reset();
    });
  }

  OniStatus tryDevice(const char* uri) override {
    return guarded(ONI_STATUS_ERROR, [&] {
      if (uri == nullptr || !isOurs(uri) || configuration_ == nullptr) return ONI_STATUS_ERROR;
      if (!*configuration_) return statusOf(configuration_->error(), complain());
      if (discovery_ == nullptr) return ONI_STATUS_ERROR;
      return statusOf(discovery_->find(uri), complain());
    });
  }

  oni::driver::DeviceBase* deviceOpen(const char* uri, const char* /*mode*/) override {
    return guarded(static_cast<oni::driver::DeviceBase*>(nullptr), [&]() -> oni::driver::DeviceBase* {
      if (uri == nullptr || discovery_ == nullptr) return nullptr;
      const Configuration& configuration = **configuration_;
      auto place = placeOf(uri, configuration.firstAddress());
      if (!place) {
        complain()(place.error().message);
        return nullptr;
      }
      auto device = Device::open(*std::move(place), configuration,
                                 {.complain = complain(),
                                  .state = [post = discovery_->poster(), name = std::string{uri}](
                                               OniDeviceState state) { post(name, state); }});
      if (!device) {
        complain()(device.error().message);
        return nullptr;
      }
      return (*device).release();
    });
  }

  void deviceClose(oni::driver::DeviceBase* device) override {
    guarded([&] {
      std::unique_ptr<Device> ours{dynamic_cast<Device*>(device)};
      if (ours != nullptr && !ours->finish()) static_cast<void>(ours.release());
    });
  }

  /// All images of a device are made of the same frames, one after another, with the same numbers.
  void* enableFrameSync(oni::driver::StreamBase** streams, int count) override {
    return guarded(static_cast<void*>(nullptr), [&]() -> void* {
      if (streams == nullptr || count <= 0) return nullptr;
      const Device* device = nullptr;
      for (int i = 0; i < count; ++i) {
        const auto* stream = dynamic_cast<Stream*>(streams[i]);
        if (stream == nullptr || (device != nullptr && device != &stream->device())) return nullptr;
        device = &stream->device();
      }
      return this;
    });
  }

 private:
  Complain complain() {
    return [way = way_](std::string_view what) {
      way->with([&](Driver& it) {
        it.getServices().errorLoggerAppend("%.*s", static_cast<int>(what.size()), what.data());
      });
    };
  }

  std::shared_ptr<WayTo<Driver>> way_ = std::make_shared<WayTo<Driver>>(this);
  std::unique_ptr<Result<Configuration>> configuration_;
  std::unique_ptr<Discovery> discovery_;
};

}  // namespace
}  // namespace toftwin::openni2

using ToftwinDriver = toftwin::openni2::Driver;
ONI_EXPORT_DRIVER(ToftwinDriver)
