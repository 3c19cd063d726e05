// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <optional>

#include "usb_device.h"

namespace toftwin::kernel_test {

/// A USB depth camera as uvcvideo knows them: Z16 in one or two streams (the
/// second is Y16 infrared), a gain and an exposure time. [USB Video Class 1.0]
class UvcCamera final : public UsbDevice {
 public:
  enum class Endpoint { Bulk, Isochronous };
  struct Options {
    Endpoint endpoint = Endpoint::Bulk;
    UsbSpeed speed = UsbSpeed::High;
    bool has_infrared = false;
    std::chrono::microseconds interval{33'333};
  };
  static constexpr std::uint32_t kWidth = 160, kHeight = 120;
  static constexpr const char* kName = "Emulated Depth Camera";
  static constexpr const char* kSerial = "TT-0001";
  static constexpr std::uint16_t kGain = 7, kMostGain = 30;
  static constexpr std::uint32_t kExposure_100us = 20, kMostExposure_100us = 300;

  explicit UvcCamera(Options options);

  /// The code at a pixel of picture number `frame` of a stream (0: depth).
  /// Pixel (0, 0) tells the number.
  static std::uint16_t codeAt(std::uint32_t frame, int stream, std::uint32_t x, std::uint32_t y);
  static std::uint32_t frameOf(std::uint16_t first_code) { return first_code - 1U; }

  // Faults, from any thread.
  void truncate(int pictures) { truncated_ = pictures; }
  void damage(int pictures) { damaged_ = pictures; }
  void hang(bool hangs) { hangs_ = hangs; }
  [[nodiscard]] std::uint16_t gain() const { return gain_; }
  [[nodiscard]] std::uint32_t exposure_100us() const { return exposure_; }

  [[nodiscard]] UsbSpeed speed() const override { return options_.speed; }
  [[nodiscard]] Bytes deviceDescriptor() const override;
  [[nodiscard]] Bytes configurationDescriptor() const override;
  [[nodiscard]] std::string text(int index) const override;
  Answer control(const Setup& setup, std::span<const std::byte> out) override;
  void onInterface(int number, int alternate) override;
  void onClearHalt(std::uint8_t endpoint) override;
  bool serve(Transfer& transfer, SteadyTime now) override;
  [[nodiscard]] SteadyTime due() const override;

 private:
  struct Stream {
    std::uint32_t frame = 0;
    Bytes picture;  ///< being sent
    std::size_t sent = 0;
    bool is_toggled = false, is_damaged = false;
    std::optional<SteadyTime> next_picture,
        next_transfer;  ///< none: not streaming
  };
  [[nodiscard]] Answer probe(const Setup& setup, std::span<const std::byte> out);
  [[nodiscard]] Answer exposureControl(const Setup& setup, std::span<const std::byte> out);
  [[nodiscard]] Answer gainControl(const Setup& setup, std::span<const std::byte> out);
  bool begin(Stream& stream, int index, SteadyTime now);
  std::uint32_t putPayload(Stream& stream, Bytes& out, std::size_t most);
  bool serveIsochronous(Stream& stream, int index, Transfer& transfer, SteadyTime now);

  Options options_;
  std::vector<Stream> streams_;
  std::atomic<int> truncated_{0}, damaged_{0};
  std::atomic<bool> hangs_{false};
  std::atomic<std::uint16_t> gain_{kGain};
  std::atomic<std::uint32_t> exposure_{kExposure_100us};
};

}  // namespace toftwin::kernel_test
