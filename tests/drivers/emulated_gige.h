// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace toftwin::test {

/// A GigE Vision time-of-flight camera on an address of the loopback network: the control and
/// stream protocols as a real one speaks them, with range, intensity and confidence in multipart
/// frames or one image per frame, chunk data, resending, and everything that a cable or a camera
/// does. Its features are those of aravis/tof_camera.xml.
class EmulatedGige {
 public:
  static constexpr int kWidth = 48, kHeight = 32;
  static constexpr double kFocal_px = 40.0, kU_px = 23.0, kV_px = 16.0;
  static constexpr double kScale_mm = 0.25, kOffset_mm = 100.0;  // of C
  // PFNC
  static constexpr std::uint32_t kC16 = 0x011000B8, kC32f = 0x012000BF, kABC32f = 0x026000C0,
                                 kABC32fPlanar = 0x026000C1, kMono8 = 0x01080001,
                                 kMono16 = 0x01100007, kConfidence8 = 0x010800C6,
                                 kConfidence16 = 0x011000C7, kBayer8 = 0x01080009;

  /// `address`: on 127.0.0.0/8; several cameras need several. Throws if it is taken.
  explicit EmulatedGige(std::string address, std::string serial = "EMU-1");
  EmulatedGige(const EmulatedGige&) = delete;
  EmulatedGige& operator=(const EmulatedGige&) = delete;
  ~EmulatedGige();

  [[nodiscard]] const std::string& address() const { return address_; }

  // What happens to it:
  std::atomic<bool> is_cut = false;             ///< the line: nothing comes in or goes out
  std::atomic<bool> is_hung = false;            ///< it answers, but sends no frames
  std::atomic<bool> is_full_size_lost = false;  ///< packets beyond 1500 bytes do not come through
  std::atomic<int> drop_every = 0;  ///< of its stream's packets, the first time they are sent
  std::atomic<bool> drops_resent = false;         ///< those sent again get lost as well
  std::atomic<int> skip_frames = 0;               ///< ids left out before the next frame
  std::atomic<std::int64_t> clock_ns = 0;         ///< added to its clock
  std::atomic<bool> is_other_controller = false;  ///< another program controls it
  std::atomic<int> resent = 0, test_packets = 0, largest_packet = 0, starts = 0;
  /// Changes packets of the stream before they leave.
  std::function<void(std::vector<std::byte>&)> damage;  ///< set while no frames are sent
  /// Off and on again: its settings are those of the factory, and nobody controls it.
  void reboot();
  /// An edge on Line1.
  void edge() { ++triggers_; }

  [[nodiscard]] std::uint32_t reg(std::uint32_t address) const;
  void setReg(std::uint32_t address, std::uint32_t value);
  [[nodiscard]] double floatReg(std::uint32_t address) const;
  void setFloatReg(std::uint32_t address, double value);
  // Its registers that tests look at:
  static constexpr std::uint32_t kWidthReg = 0x10000, kExposure = 0x10030, kRate = 0x10038, kGain = 0x10040,
                                 kFilter = 0x10044, kSystem = 0x10058, kDistanceUnit = 0x10054,
                                 kFocal = 0x10060, kEnable = 0x10120, kFormat = 0x10140, kControl = 0x0A00,
                                 kHeartbeat = 0x0938, kActivation = 0x10024, kInvalid = 0x10240,
                                 kPtp = 0x100A0, kPtpStatus = 0x100A4, kPtpLatch = 0x100A8,
                                 kMultipartAble = 0x0D20, kUserText = 0x100B0, kTriggerActivation = 0x10024;

  // What it sends in frame n:
  static std::uint16_t rangeCode(std::uint64_t n, int x, int y);  ///< 0: no value
  static std::uint16_t intensity(int x, int y);
  static std::uint16_t confidence(int x, int y);

 private:
  using Clock = std::chrono::steady_clock;
  using Bytes = std::vector<std::byte>;
  struct Image {
    std::uint32_t component, format;
    Bytes bytes;
  };

  void run(const std::stop_token& stop);
  void answer(int socket);
  Bytes handle(std::uint16_t command, std::span<const std::byte> data, bool may_write,
               std::uint16_t& status);
  [[nodiscard]] std::optional<std::uint32_t> read(std::uint32_t address) const;
  void write(std::uint32_t address, std::uint32_t value);
  void resend(std::span<const std::byte> data, bool is_extended);
  void fireTestPacket();
  [[nodiscard]] bool isDue();
  void sendFrame();
  [[nodiscard]] std::vector<Image> images() const;
  [[nodiscard]] Bytes imageBytes(std::uint32_t format) const;
  [[nodiscard]] std::vector<Bytes> packetsOfImage(const Image& image) const;
  [[nodiscard]] std::vector<Bytes> packetsOfParts(const std::vector<Image>& images) const;
  void send(Bytes packet, bool is_first_time);
  [[nodiscard]] std::uint64_t deviceTime() const;
  [[nodiscard]] std::uint32_t payloadSize() const;
  void factorySettings();

  std::string address_, serial_, xml_;
  int control_ = -1, broadcast_ = -1, stream_ = -1;
  mutable std::mutex mutex_;
  std::map<std::uint32_t, std::uint32_t> registers_;
  std::uint64_t frame_ = 0, frame_id_ = 65'530;  // so that ids of 16 bits soon wrap around
  std::uint32_t controller_address_ = 0;
  std::uint16_t controller_port_ = 0;
  Clock::time_point heard_at_{}, due_{};
  std::atomic<int> triggers_ = 0;
  int packets_ = 0;
  struct Sent {
    std::uint64_t id;
    std::vector<Bytes> packets;
  };
  std::deque<Sent> sent_;
  std::jthread thread_;
};

/// An address of the loopback network that no other test process uses at the time.
std::string ownLoopbackAddress();

}  // namespace toftwin::test
