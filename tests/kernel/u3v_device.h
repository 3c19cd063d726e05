// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "u3v_camera.h"
#include "usb_names.h"

namespace toftwin::kernel_test {

/// An emulated USB3 Vision camera as a USB device: interfaces for its control, its events, of which there are
/// none, and its stream. [USB3 Vision 1.0, 2 and 3]
class U3vDevice final : public UsbDevice {
 public:
  explicit U3vDevice(std::string serial, UsbSpeed speed = UsbSpeed::Super);
  U3vCamera& camera() { return camera_; }
  /// How often the kernel has asked who it is: when it is plugged in, and when it is reset.
  [[nodiscard]] int introductions() const { return introductions_; }

  [[nodiscard]] UsbSpeed speed() const override { return speed_; }
  [[nodiscard]] Bytes deviceDescriptor() const override;
  [[nodiscard]] Bytes configurationDescriptor() const override;
  [[nodiscard]] std::string text(int index) const override;
  Answer control(const Setup& setup, std::span<const std::byte> out) override;
  void onClearHalt(std::uint8_t endpoint) override;
  bool serve(Transfer& transfer, SteadyTime now) override;
  [[nodiscard]] SteadyTime due(std::uint8_t endpoint) const override;

 private:
  bool serveStream(Transfer& transfer);

  UsbSpeed speed_;
  U3vCamera camera_;
  mutable std::atomic<int> introductions_ = 0;
  std::deque<Bytes> frame_;  ///< what is left of it
};

}  // namespace toftwin::kernel_test
