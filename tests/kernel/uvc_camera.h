// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <optional>

#include "daemon/facades/usb_camera/uvc_device.h"
#include "usb_names.h"

namespace toftwin::kernel_test {

using daemon::usb_camera::Writer;

/// A USB depth camera as uvcvideo knows them: Z16 in one or two streams (the second is Y16 infrared), a gain
/// and an exposure time. It is the facade's, with pictures that tests know and faults that they ask for.
class UvcCamera final : public daemon::usb_camera::UvcDevice {
 public:
  using Endpoint = daemon::usb_camera::Endpoint;
  struct Options {
    Endpoint endpoint = Endpoint::Bulk;
    UsbSpeed speed = UsbSpeed::High;
    bool has_infrared = false;
    bool says_invz = false;  ///< as Intel's cameras call Z16 on the bus
    std::chrono::microseconds interval{33'333};
  };
  static constexpr std::uint16_t kWidth = 160, kHeight = 120;
  static constexpr const char* kName = "Emulated Depth Camera";
  static constexpr const char* kSerial = "TT-0001";
  static constexpr std::uint16_t kGain = 7, kMostGain = 30;
  static constexpr std::uint32_t kExposure_100us = 20, kMostExposure_100us = 300;

  explicit UvcCamera(Options options);

  /// The code at a pixel of picture number `frame` of a stream (0: depth).
  /// Pixel (0, 0) tells the number.
  static std::uint16_t codeAt(std::uint32_t frame, std::size_t stream, std::uint32_t x, std::uint32_t y);
  static std::uint32_t frameOf(std::uint16_t first_code) { return first_code - 1U; }

  // Faults, from any thread.
  void truncate(int pictures) { truncated_ = pictures; }
  void damage(int pictures) { damaged_ = pictures; }
  void hang(bool hangs) { hangs_ = hangs; }
  [[nodiscard]] std::uint16_t gain() const { return static_cast<std::uint16_t>(gain_); }
  [[nodiscard]] std::uint32_t exposure_100us() const { return exposure_; }

 private:
  [[nodiscard]] std::uint32_t number(Number which) const override {
    return which == Number::Gain ? gain_.load() : exposure_.load();
  }
  Answer setNumber(Number which, std::uint32_t value) override;
  std::optional<daemon::usb_camera::Picture> nextPicture(std::size_t stream, SteadyTime now) override;
  [[nodiscard]] SteadyTime nextPictureDue(std::size_t stream) const override;
  void onReset(std::size_t stream) override { next_.at(stream).reset(); }
  [[nodiscard]] std::uint32_t clockNow(SteadyTime now) const override;

  const Options options_;
  std::array<std::uint32_t, 2> frames_{};            // that the streams have sent
  std::array<std::optional<SteadyTime>, 2> next_{};  // none: not streaming
  std::atomic<int> truncated_{0}, damaged_{0};
  std::atomic<bool> hangs_{false};
  std::atomic<std::uint32_t> gain_{kGain}, exposure_{kExposure_100us};
};

}  // namespace toftwin::kernel_test
