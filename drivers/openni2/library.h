// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openni2/OniCAPI.h>

#include <atomic>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <toftwin/result.h>

/// OpenNI2's C interface with owners for what it hands out.
namespace toftwin::drivers::openni2 {

/// The library is one for the whole process: the first who needs it starts it, and it stays. Ending
/// and starting it loses 110 kB each time (2.2.0.33, in its plug-ins' static constructors), which a
/// daemon whose camera is away would do every few seconds. What is plugged in later it hears from
/// udev.
class Library {
 public:
  static Result<Library> acquire();

  /// Devices that it sees now. Files and devices made up by name are not among them.
  [[nodiscard]] std::vector<OniDeviceInfo> devices() const;

 private:
  Library() = default;
};

struct CloseDevice {
  void operator()(OniDeviceHandle device) const { oniDeviceClose(device); }
};
struct DestroyStream {
  void operator()(OniStreamHandle stream) const { oniStreamDestroy(stream); }
};
struct ReleaseFrame {
  void operator()(OniFrame* frame) const { oniFrameRelease(frame); }
};
using DevicePtr = std::unique_ptr<std::remove_pointer_t<OniDeviceHandle>, CloseDevice>;
using StreamPtr = std::unique_ptr<std::remove_pointer_t<OniStreamHandle>, DestroyStream>;
using FramePtr = std::unique_ptr<OniFrame, ReleaseFrame>;

/// What the library says of the call that just failed.
Error failure(std::string_view what, OniStatus status);

/// Hears, from the library's threads, what becomes of one device.
class Watch {
 public:
  explicit Watch(std::string uri);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  [[nodiscard]] bool isLost() const { return is_lost_; }
  [[nodiscard]] bool isAtEnd() const { return is_at_end_; }  ///< of a file
  void clear() { is_lost_ = is_at_end_ = false; }

 private:
  static void disconnected(const OniDeviceInfo* device, void* self);
  static void changed(const OniDeviceInfo* device, OniDeviceState state, void* self);

  std::string uri_;
  std::atomic<bool> is_lost_{false}, is_at_end_{false};
  OniCallbackHandle handle_ = nullptr;
};

}  // namespace toftwin::drivers::openni2
