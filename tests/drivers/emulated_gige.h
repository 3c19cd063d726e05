// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "emulated_tof.h"

namespace toftwin::test {

/// A GigE Vision time-of-flight camera on an address of the loopback network: the control and
/// stream protocols as a real one speaks them, with range, intensity and confidence in multipart
/// frames or one image per frame, chunk data, resending, and everything that a cable or a camera
/// does.
class EmulatedGige final : public EmulatedTof {
 public:
  /// `address`: on 127.0.0.0/8; several cameras need several. Throws if it is taken.
  explicit EmulatedGige(std::string address, std::string serial = "EMU-1", std::string user_name = "dock");
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
  std::atomic<bool> is_other_controller = false;  ///< another program controls it
  std::atomic<int> resent = 0, test_packets = 0, largest_packet = 0;
  /// Changes packets of the stream before they leave.
  std::function<void(std::vector<std::byte>&)> damage;  ///< set while no frames are sent
  /// Off and on again: its settings are those of the factory, and nobody controls it.
  void reboot();
  // Its registers that tests look at, of GigE Vision:
  static constexpr std::uint32_t kControl = 0x0A00, kHeartbeat = 0x0938, kMultipartAble = 0x0D20;

 private:
  void run(const std::stop_token& stop);
  void answer(int socket);
  Bytes handle(std::uint16_t command, std::span<const std::byte> data, bool may_write,
               std::uint16_t& status);
  [[nodiscard]] std::optional<std::uint32_t> read(std::uint32_t address) const override;
  void write(std::uint32_t address, std::uint32_t value) override;
  void resend(std::span<const std::byte> data, bool is_extended);
  void fireTestPacket();
  [[nodiscard]] bool isDue();
  void sendFrame();
  [[nodiscard]] std::vector<Bytes> packetsOfImage(const Image& image) const;
  [[nodiscard]] std::vector<Bytes> packetsOfParts(const std::vector<Image>& images) const;
  void send(Bytes packet, bool is_first_time);
  [[nodiscard]] std::uint32_t payloadSize() const;
  void factorySettings();

  std::string address_, serial_, user_name_;
  int control_ = -1, broadcast_ = -1, stream_ = -1;
  std::uint64_t frame_id_ = 65'530;  // so that ids of 16 bits soon wrap around
  std::uint32_t controller_address_ = 0;
  std::uint16_t controller_port_ = 0;
  Clock::time_point heard_at_{};
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
