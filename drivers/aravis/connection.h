// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "drivers/aravis/library.h"

namespace toftwin::drivers::aravis {

/// To be held while the library makes objects: its lists are of the process, and so are its
/// sockets.
std::unique_lock<std::mutex> lockLibrary();

/// Cameras that are there now, by what the key `uri` takes after "aravis:".
std::vector<std::string> listCameras();

/// An open camera. Its library object is closed with it, and soon even if the camera is gone.
class Connection {
 public:
  /// `name`: what the key `uri` says after "aravis:".
  static Result<Connection> open(const std::string& name);
  Connection(Connection&&) noexcept = default;
  Connection& operator=(Connection&&) = delete;
  ~Connection();

  [[nodiscard]] ArvCamera* camera() const { return camera_.get(); }
  [[nodiscard]] ArvDevice* device() const { return arv_camera_get_device(camera_.get()); }
  /// Of a GigE camera.
  [[nodiscard]] std::optional<std::uint32_t> address() const { return address_; }

  /// Whether the camera answers and is still ours. Disconnected if not. Takes as long as `wait`
  /// where a camera is gone.
  Result<> check(std::chrono::milliseconds wait);
  /// The library lost the control of the camera: its heartbeat said so, or its USB.
  [[nodiscard]] bool isLost() const { return *is_lost_; }
  /// The socket of this process on the interface towards the camera that has that port, or -1.
  [[nodiscard]] int socketOfPort(std::uint16_t port) const;
  /// The camera is gone. From here on nothing waits for its answers.
  void giveUp();

 private:
  /// A socket of the library, told from whatever has its number later by its port.
  struct ControlSocket {
    int file = -1;
    std::uint16_t port = 0;
  };
  Connection(Object<ArvCamera> camera, std::optional<std::uint32_t> address);
  static std::vector<ControlSocket> socketsOn(std::uint32_t address);
  static Result<Connection> openGige(std::uint32_t address);
  static Result<Connection> openUsb(const std::string& maker, const std::string& product,
                                    const std::string& serial);

  std::unique_ptr<std::atomic<bool>> is_lost_ = std::make_unique<std::atomic<bool>>(false);
  Object<ArvCamera> camera_;
  gulong lost_signal_ = 0;
  std::optional<std::uint32_t> address_;
  std::uint32_t interface_ = 0;           ///< towards a GigE camera
  std::optional<ControlSocket> control_;  ///< the library's, if it is known
};

}  // namespace toftwin::drivers::aravis
