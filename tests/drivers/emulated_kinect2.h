// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/kinect2/assembly.h"
#include "drivers/kinect2/commands.h"
#include "sim/images/samples.h"

namespace toftwin::test {

using drivers::kinect2::Bytes;

/// The code of 11 bits whose counts these are, or the nearest.
std::uint32_t codeOf(float counts);
/// Samples at 80, 16 and 120 MHz, three steps each, as the ten images of a frame (the tenth is empty). Two
/// taps are taken as their difference; `counts_per_electron` converts them.
Bytes imagesOf(const sim::Samples& samples, double counts_per_electron = 1.0);
/// An image with the footer that it has on the wire.
Bytes withFooter(std::span<const std::byte> image, std::uint32_t stamp, std::uint32_t number,
                 std::uint32_t index);

/// The answers that hold what the factory measured.
Bytes lensAnswer(const drivers::kinect2::Lens& lens);
Bytes phaseTablesAnswer(const drivers::kinect2::PhaseTables& tables);

constexpr std::size_t kPacketBytes = 33792;  ///< 11 × 3 times 1024 bytes in each 125 µs

/// What a Kinect v2 does, without the cable: takes commands, answers them, and makes packets when it is told
/// to stream. As far as it is publicly known; from any thread.
class EmulatedKinect2 {
 public:
  struct Options {
    std::string serial = "003370163847";
    drivers::kinect2::Lens lens{365.8608, 365.8608, 254.5022, 205.2526, 0.0964, -0.2758, 0, 0, 0.0921};
    drivers::kinect2::PhaseTables tables{};   ///< empty: zeros
    Bytes images{};                           ///< of every frame; empty: a wall at 2 m
    std::uint32_t first_number = 65'530;      ///< wraps around soon
    std::uint32_t first_stamp = 0xFFFF'F000;  ///< likewise
    std::uint32_t stamps_per_frame = 267;
  };
  explicit EmulatedKinect2(Options options);

  void command(std::span<const std::byte> bytes);
  /// The next message of endpoint 0x81, if it has one to send.
  std::optional<Bytes> answer();
  void suspend(bool is_suspended);
  void alternate(int setting);
  /// As if its power had been off and on again, its serial number and tables aside.
  void restart();
  [[nodiscard]] bool isStreaming() const;

  struct Packet {
    Bytes bytes;
    bool is_lost = false;
  };
  /// The packets of the next frame, an empty one behind each image.
  std::vector<Packet> nextFrame();
  /// The frame's number as it can be read in image 0 at (1, 0), as a code.
  static constexpr std::uint32_t kNumberCodes = 1000;

  // Faults.
  void losePackets(int count) { set(lost_packets_, count); }
  void shortenImages(int count) { set(short_images_, count); }
  void skipFrames(int count) { set(skipped_, count); }
  void hang(bool hangs);  ///< it takes commands and answers none, and streams nothing
  [[nodiscard]] bool hangs() const;
  void notReadyFor(int questions) { set(not_ready_, questions); }
  [[nodiscard]] std::vector<drivers::kinect2::Code> seen() const;  ///< the first thousand commands
  [[nodiscard]] const Options& options() const { return options_; }

 private:
  void set(int& what, int count);
  Bytes dataFor(drivers::kinect2::Code code, std::span<const std::uint32_t> parameters);
  bool takeOne(int& count);

  mutable std::mutex mutex_;
  Options options_;
  std::deque<Bytes> answers_;
  std::vector<drivers::kinect2::Code> seen_;
  bool is_suspended_ = true, is_initialised_ = false, is_streaming_ = false, hangs_ = false;
  int alternate_ = 0;
  const Bytes tables_;  // the answer, which is long, made once
  std::uint32_t number_, stamp_;
  int lost_packets_ = 0, short_images_ = 0, skipped_ = 0, not_ready_ = 0;
};

/// A wall across the view at that depth, as the camera of the options sees it with its decoder's formula.
Bytes imagesOfWall(const drivers::kinect2::Lens& lens, double depth_m, double amplitude_counts = 600.0);

}  // namespace toftwin::test
