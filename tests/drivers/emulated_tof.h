// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace toftwin::test {

/// A GenICam time-of-flight camera whatever line it is on: its features, which are those of
/// aravis/tof_camera.xml, in registers of four bytes, the highest first, and the images that it takes as they
/// are set. Who inherits it sends them, and holds its lock meanwhile.
class EmulatedTof {
 public:
  static constexpr int kWidth = 48, kHeight = 32;
  static constexpr double kFocal_px = 40.0, kU_px = 23.0, kV_px = 16.0;
  static constexpr double kScale_mm = 0.25, kOffset_mm = 100.0;  // of C
  static constexpr double kScaleAside_mm = 0.5,
                          kOffsetAside_mm = -2000.0;  // of A and B, where they are codes
  // PFNC
  static constexpr std::uint32_t kC16 = 0x011000B8, kC32f = 0x012000BF, kABC16 = 0x023000B9,
                                 kABC16Planar = 0x023000BA, kABC32f = 0x026000C0, kABC32fPlanar = 0x026000C1,
                                 kMono8 = 0x01080001, kMono16 = 0x01100007, kConfidence8 = 0x010800C6,
                                 kConfidence16 = 0x011000C7, kBayer8 = 0x01080009;
  // Its registers that tests look at:
  static constexpr std::uint32_t kWidthReg = 0x10000, kExposure = 0x10030, kRate = 0x10038, kGain = 0x10040,
                                 kFilter = 0x10044, kSystem = 0x10058, kDistanceUnit = 0x10054,
                                 kFocal = 0x10060, kEnable = 0x10120, kFormat = 0x10140, kScale = 0x10200,
                                 kOffset = 0x10220, kActivation = 0x10024, kInvalid = 0x10240, kPtp = 0x100A0,
                                 kPtpStatus = 0x100A4, kPtpLatch = 0x100A8, kUserText = 0x100B0,
                                 kTriggerActivation = 0x10024;

  std::atomic<std::int64_t> clock_ns = 0;  ///< added to its clock
  std::atomic<int> starts = 0;
  std::atomic<int> skip_frames = 0;  ///< numbered and not sent, each in the time of one
  /// An edge on Line1.
  void edge() { ++triggers_; }

  [[nodiscard]] std::uint32_t reg(std::uint32_t address) const;
  void setReg(std::uint32_t address, std::uint32_t value);
  [[nodiscard]] double floatReg(std::uint32_t address) const;
  void setFloatReg(std::uint32_t address, double value);

  // What it sends in frame n:
  static std::uint16_t rangeCode(std::uint64_t n, int x, int y);  ///< 0: no value
  /// A, B and C of the point there, of which any may be 0: no value.
  static std::array<std::uint16_t, 3> pointCodes(std::uint64_t n, int x, int y);
  static std::uint16_t intensity(int x, int y);
  static std::uint16_t confidence(int x, int y);

 protected:
  using Clock = std::chrono::steady_clock;
  using Bytes = std::vector<std::byte>;
  struct Image {
    std::uint32_t component, format;
    Bytes bytes;
  };
  // Of the features, those that are no setting alone:
  static constexpr std::uint32_t kPayloadReg = 0x1000C, kAcquisition = 0x10014, kTriggerMode = 0x1001C,
                                 kTriggerSource = 0x10020, kTriggerSoftware = 0x10028, kInvalidFlag = 0x10264,
                                 kIds = 0x10160, kChunkMode = 0x10080, kChunkEnable = 0x10090,
                                 kTemperature = 0x10048;

  EmulatedTof() = default;
  ~EmulatedTof() = default;

  static std::string_view description();  ///< aravis/tof_camera.xml
  void factoryFeatures();
  void setText(std::uint32_t at, const std::string& value, std::size_t size);
  [[nodiscard]] virtual std::optional<std::uint32_t> read(std::uint32_t address) const;
  virtual void write(std::uint32_t address, std::uint32_t value);

  [[nodiscard]] bool isFrameDue();
  /// Before the frame that is due.
  [[nodiscard]] std::uint64_t idsLeftOut() { return std::exchange(left_out_, 0); }
  [[nodiscard]] std::vector<Image> images() const;
  [[nodiscard]] bool hasChunks() const;
  [[nodiscard]] std::uint64_t deviceTime() const;

  mutable std::mutex mutex_;
  std::map<std::uint32_t, std::uint32_t> registers_;
  std::uint64_t frame_ = 0;
  std::atomic<int> triggers_ = 0;

 private:
  void setReal(std::uint32_t at, double value);
  [[nodiscard]] Bytes imageBytes(std::uint32_t format) const;
  Clock::time_point due_{};
  std::uint64_t left_out_ = 0;
};

}  // namespace toftwin::test
