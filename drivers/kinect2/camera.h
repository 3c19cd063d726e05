// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/kinect2/commands.h"
#include "drivers/kinect2/link.h"

namespace toftwin::drivers::kinect2 {

/// A conversation with the camera's firmware, in the order in which libfreenect2 leads it (libfreenect2.cpp).
/// When a command fails nothing more is said: the camera is gone, or hangs.
class CameraSession {
 public:
  explicit CameraSession(std::unique_ptr<Link> link) : link_(std::move(link)) {}
  CameraSession(const CameraSession&) = delete;
  CameraSession& operator=(const CameraSession&) = delete;
  ~CameraSession() { close(); }

  struct About {
    std::string serial, firmware;
    Lens lens;
  };
  Result<About> open();
  /// The tables are the factory's, but are said to be of use only for as long as the camera is on, so that
  /// they are read whenever it starts [libfreenect2, issue 169].
  Result<PhaseTables> start(PacketSink& sink, int transfers);
  void stop();

  /// How long it may take until it is ready to stream.
  static constexpr std::chrono::seconds kReadyWithin{3};

 private:
  Result<Bytes> execute(const Command& command);
  Result<> waitUntilReady();
  Result<> sayMode();
  void close();

  std::unique_ptr<Link> link_;
  std::uint32_t number_ = 0;
  bool is_alive_ = true, is_open_ = false, is_suspended_ = true, is_streaming_ = false;
};

}  // namespace toftwin::drivers::kinect2
