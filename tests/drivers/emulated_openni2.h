// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

/// A camera inside OpenNI2: a plug-in that the real library loads as it loads those of real
/// sensors. The tests take hold of it by `emulatedOpenNI2()`, found with dlsym in the same plug-in.
namespace toftwin::test {

struct EmulatedOpenNI2 {
  static constexpr int kWidth = 160, kHeight = 120;
  static constexpr int kRate_hz = 50;
  static constexpr std::int64_t kInterval_us = 1'000'000 / kRate_hz;
  static constexpr double kFieldOfView_rad = 1.2;
  static constexpr const char* kUri = "emulated/0@1/5";

  static std::uint16_t depthAt(std::int64_t n, int x, int y) {
    if (x < 8 && y < 8) return 0;
    return static_cast<std::uint16_t>(1000 + (x + y + n) % 256 * 10);
  }
  static std::uint16_t infraredAt(int x, int y) {
    return static_cast<std::uint16_t>(100 + (x + 3 * y) % 900);
  }

  std::atomic<int> rate_hz{kRate_hz};  ///< of a camera that is opened from now on
  std::atomic<bool> is_hung{false};  ///< no frames, but the device answers
  std::atomic<bool> is_color_silent{false};
  std::atomic<bool> has_stamps{true};
  std::atomic<int> skip{0};               ///< so many frames are lost in the device
  std::atomic<std::int64_t> clock_us{0};  ///< added to its clock
  std::atomic<int> cut_bytes{0};          ///< its next depth frame is that much too short
  std::atomic<int> wrong_width{0};        ///< or so wide
  std::atomic<std::int64_t> last_depth{0}, last_infrared{0};  ///< of the frames that it sent
  /// An infrared image comes after the depth image of its time and before the next, however busy the machine is.
  std::atomic<bool> is_in_step{false};
  std::atomic<int> open_streams{0}, running_streams{0};
  std::atomic<int> exposure{33};  ///< the colour stream's, as the device has it

  void (*unplug)() = nullptr;
  void (*plugIn)() = nullptr;
};

}  // namespace toftwin::test
