// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "drivers/o3d303/wire/extrinsics.h"
#include "frame_schedule.h"
#include "o3d303_device.h"

namespace toftwin::test {

/// An O3D303 on loopback: XML-RPC over HTTP and PCIC, each on a port of its own, with what goes
/// wrong with cameras. Runs on one thread of its own; every member may be called from any other.
class EmulatedO3d303 {
 public:
  struct Options {
    FrameSchedule schedule{std::chrono::milliseconds{50}};
    double clock_skew = 0.0;  ///< device seconds gained per host second
    o3d303::ExtrinsicCalibration extrinsics{};
  };
  EmulatedO3d303() : EmulatedO3d303(Options{}) {}
  explicit EmulatedO3d303(Options options);
  ~EmulatedO3d303();

  /// For the driver's key `uri`; the same for the emulator's whole life.
  [[nodiscard]] std::string uri() const;

  /// The cable is out: connections are reset, nobody listens.
  void unplug();
  void plugIn();
  /// Connections stay, nothing is said any more.
  void hang();
  void recover();
  /// unplug(), lose what was not saved, begin the clock and the frame count anew; plugIn() ends it.
  void reboot(bool to_factory_settings = false);
  /// The connections are reset, as by a switch; new ones are welcome at once.
  void dropLine();
  /// The next so many frames have bytes flipped within their chunks (or in the message's first
  /// line).
  void corrupt(int frames, bool framing = false);
  /// So many messages, one in two frames and one in twenty answers to calls, come with random bytes
  /// overwritten, left out or repeated anywhere.
  void garble(int messages);
  [[nodiscard]] int toGarble();
  /// The next so many frames are taken and counted, but not sent.
  void loseFrames(int frames);
  /// Somebody sets the camera's clock.
  void setClock(std::chrono::nanoseconds by);

  /// Runs on the emulator's thread, with nothing else touching the device.
  void withDevice(const std::function<void(O3d303Device&)>& look);
  /// Open at present, of both kinds.
  [[nodiscard]] int connections();
  [[nodiscard]] int framesMade();

  static constexpr std::uint32_t kWidth = 176, kHeight = 132;
  static constexpr double kFocalLength_px = 153.0;
  static constexpr float kIllumination_c = 42.5F;
  struct Pixel {
    std::uint16_t distance_mm, amplitude;
    std::uint8_t confidence;
  };
  /// What a pixel shows in a frame.
  static Pixel pixelAt(std::uint32_t frame_count, std::uint32_t x, std::uint32_t y);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toftwin::test
