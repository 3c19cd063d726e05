// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include <toftwin/result.h>

#include "drivers/usb/cameras.h"

namespace toftwin::usb {

/// Whether this build has libusb.
bool hasLibusb();

/// Tells of known cameras that come and go. It has no thread: `wait` calls back. Which device left
/// is known by its port alone.
class Watch {
 public:
  struct Event {
    bool has_arrived = false;
    std::string port;
    const KnownCamera* camera = nullptr;
  };
  using Listener = std::function<void(const Event&)>;

  /// `listener` is also told of what is there already, in the first wait().
  static Result<std::unique_ptr<Watch>> begin(Listener listener);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Calls the listener for all that happens, and comes back at the latest then.
  Result<> wait(std::chrono::milliseconds timeout);

 private:
  struct State;
  explicit Watch(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Resets the known camera at that port, as if it was unplugged and plugged in: for one that hangs.
/// NotFound, PermissionDenied (with what to do), or Disconnected if it did not come back as it was,
/// which means that it is a new device now.
Result<> reset(const std::string& port);

}  // namespace toftwin::usb
