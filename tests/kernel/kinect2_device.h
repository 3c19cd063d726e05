// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <deque>

#include "../drivers/emulated_kinect2.h"
#include "usb_names.h"

namespace toftwin::kernel_test {

/// An emulated Kinect v2 as a USB 3 device: commands over bulk endpoints, the stream over an isochronous one
/// with packets of up to 33792 bytes, which only its alternate setting 1 has.
class Kinect2Device final : public UsbDevice {
 public:
  struct Options {
    test::EmulatedKinect2::Options camera{};
    std::chrono::milliseconds interval{700};  ///< between frames; the emulated machine is slow
    std::uint16_t product = 0x02C4;
    UsbSpeed speed = UsbSpeed::Super;
  };
  static constexpr const char* kName = "Xbox NUI Sensor";

  explicit Kinect2Device(Options options);
  test::EmulatedKinect2& camera() { return camera_; }

  [[nodiscard]] UsbSpeed speed() const override { return options_.speed; }
  [[nodiscard]] Bytes deviceDescriptor() const override;
  [[nodiscard]] Bytes configurationDescriptor() const override;
  [[nodiscard]] std::string text(int index) const override;
  Answer control(const Setup& setup, std::span<const std::byte> out) override;
  void onFunctionSuspend(bool is_suspended) override { camera_.suspend(is_suspended); }
  void onInterface(int number, int alternate) override;
  bool serve(Transfer& transfer, SteadyTime now) override;
  [[nodiscard]] SteadyTime due(std::uint8_t endpoint) const override;

 private:
  bool serveAnswer(Transfer& transfer);
  bool serveStream(Transfer& transfer, SteadyTime now);

  Options options_;
  test::EmulatedKinect2 camera_;
  Bytes message_;  ///< of endpoint 0x81, what is left of it
  std::deque<test::EmulatedKinect2::Packet> packets_;
  SteadyTime next_frame_{};
};

}  // namespace toftwin::kernel_test
