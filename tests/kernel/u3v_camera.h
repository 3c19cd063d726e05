// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <span>

#include "../drivers/emulated_tof.h"

namespace toftwin::kernel_test {

/// A USB3 Vision time-of-flight camera as its two lines see it: commands that read and write its memory
/// (GenCP), and frames of a leader, the image and a trailer. One image per frame: the range, unless another
/// is chosen.
class U3vCamera final : public test::EmulatedTof {
 public:
  using Bytes = std::vector<std::byte>;
  using SteadyTime = std::chrono::steady_clock::time_point;
  enum class Damage { None, BadLeader, ShortImage, LongImage, NoTrailer, Discarded };

  explicit U3vCamera(std::string serial);

  static constexpr const char *kMaker = "toftwin", *kName = "Emulated ToF";
  [[nodiscard]] const std::string& serial() const { return serial_; }

  // What happens to it:
  std::atomic<bool> is_hung = false;                  ///< it answers, but sends no frames
  std::atomic<bool> is_mute = false;                  ///< it does neither
  std::atomic<Damage> damage_next = Damage::None;     ///< of the next frame
  std::atomic<std::chrono::milliseconds> write_time;  ///< of a feature; meanwhile it says that it is at it
  std::atomic<int> pending_answers = 0;               ///< how often it has said so
  /// Changes the transfers of the stream before they leave.
  void setDamage(std::function<void(Bytes&)> damage);

  /// A command of the host. What was not answered yet is not answered any more.
  void command(std::span<const std::byte> bytes, SteadyTime now);
  /// What it answers next, once it is time.
  std::optional<Bytes> answer(SteadyTime now);
  /// The transfers of the next frame, if it is time for it.
  std::deque<Bytes> nextFrame();

  /// The longest that it takes to answer, as it says.
  static constexpr std::chrono::milliseconds kResponseTime{100};

 private:
  [[nodiscard]] std::optional<std::uint32_t> read(std::uint32_t address) const override;
  [[nodiscard]] std::optional<std::byte> byteAt(std::uint64_t address) const;
  void place(std::size_t at, std::uint64_t value, unsigned size);
  void placeText(std::size_t at, const std::string& text);
  std::uint16_t readMemory(std::uint64_t address, std::size_t size, Bytes& data);
  std::uint16_t writeMemory(std::uint64_t address, std::span<const std::byte> data);
  [[nodiscard]] Bytes payloadOf(const Image& image) const;
  [[nodiscard]] std::uint32_t payloadSize() const;
  [[nodiscard]] Bytes leader(const Image& image) const;
  [[nodiscard]] Bytes trailer(std::size_t valid_bytes, bool is_whole) const;
  [[nodiscard]] std::deque<Bytes> transfersOf(std::span<const std::byte> payload) const;

  struct Later {
    SteadyTime at;
    Bytes bytes;
  };
  std::string serial_, xml_;
  Bytes memory_;  ///< before the features: registers of GenCP and U3V, little-endian
  std::deque<Later> answers_;
  std::function<void(Bytes&)> damage_;
  std::uint64_t block_id_ = 65'533;  // ids have 64 bits: nothing happens after 65535
};

}  // namespace toftwin::kernel_test
