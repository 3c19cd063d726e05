// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/camera_info.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "daemon/facades/gige_vision/gvcp.h"
#include "daemon/facades/gige_vision/images.h"
#include "daemon/facades/gige_vision/memory.h"

namespace toftwin::daemon::gige_vision {

/// A UDP port of a computer (IPv4).
struct Peer {
  std::uint32_t address = 0;
  std::uint16_t port = 0;
  bool operator==(const Peer&) const = default;
};

/// A number of the source, as it is now.
struct SourceNumber {
  double value = 0.0, least = 0.0, most = 0.0;
  std::string parameter{};  ///< empty: it cannot be set
};

/// What of the source the camera shows.
struct SourceFacts {
  bool is_there = false;
  std::string model;
  CameraInfo camera;
  bool has_range = false, has_intensity = false, has_confidence = false;
  std::optional<SourceNumber> exposure_us, frame_rate_hz;
  bool is_triggered = false, can_choose_trigger = false;
  /// Illumination, sensor, housing, room.
  std::array<double, 4> temperatures_c{kNone, kNone, kNone, kNone};
  std::int64_t now_ns = 0;  ///< on the clock of the time stamps
  std::optional<std::int64_t>
      clock_uncertainty_ns;  ///< of the relation to the daemon's clock, if it is known

  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
};

using SourceChanges = std::vector<std::pair<std::string, double>>;

/// Where and how frames are sent.
struct StreamSetup {
  Peer to;  ///< port 0: nowhere
  std::uint32_t packet_size = 0;
  std::chrono::nanoseconds packet_delay{};
  bool is_multipart = false, has_long_ids = false;
  bool uses_host_clock = false;
  ImageSetup images;
  std::uint64_t frames = 0;  ///< until it stops by itself; 0: never
};

/// The camera behind its control protocol: registers, who controls it, what commands mean. No sockets, no
/// source; used on one thread.
class Device {
 public:
  using Time = std::chrono::steady_clock::time_point;
  struct Identity {
    std::uint32_t address = 0, netmask = 0;
    std::array<std::uint8_t, 6> mac{};
    std::string source{}, serial{}, user_name{}, version{};
    std::uint16_t source_port = 0;
    std::uint32_t packet_size = 1500;
    std::uint32_t packet_delay_ns = 0;
    double scale_mm = 1.0, amplitude_per_count = 1.0;
  };
  /// What follows from a command. The answer waits until the changes are made and the trigger is taken, if
  /// there are any.
  struct Outcome {
    Bytes answer{};  ///< empty: none
    SourceChanges changes{};
    bool is_trigger = false, is_test_packet = false;
    std::optional<Resend> resend{};
    [[nodiscard]] bool mustWait() const { return !changes.empty() || is_trigger; }
  };

  explicit Device(const Identity& identity);

  /// An image of another size sets the region to all of it, and ends the stream.
  void update(const SourceFacts& facts);
  Outcome take(const Peer& from, std::span<const std::byte> datagram, Time now);
  /// The answer to a command whose changes failed, or nothing where none is wanted.
  Bytes refusal(std::span<const std::byte> datagram, std::uint16_t status) const;
  /// That the answer which waited was sent; it is what the same command gets if it comes again.
  void noteAnswer(const Bytes& command, const Bytes& answer) {
    if (last_.datagram == command) last_.answer = answer;
  }
  /// A command whose answer waits may be told that it does.
  [[nodiscard]] bool announcesPending() const;
  /// Whether the controller was silent for too long; it has lost the camera then.
  bool expire(Time now);
  [[nodiscard]] std::optional<Peer> controller() const { return controller_; }

  [[nodiscard]] bool isStreaming() const { return is_streaming_; }
  /// How often the stream was started so far: block ids begin anew with each.
  [[nodiscard]] std::uint64_t starts() const { return starts_; }
  void stopStreaming() { is_streaming_ = false; }
  [[nodiscard]] StreamSetup stream() const;

 private:
  struct Last {
    Peer from;
    Bytes datagram, answer;
    Time at{};
  };
  struct Half {
    Memory::Element element;
    Bytes bytes;
  };

  void setConstants(const Identity& identity);
  Outcome obey(const Peer& from, const Request& request);
  Bytes discovered(const Request& request) const;
  Bytes readRegisters(const Request& request) const;
  Bytes readMemory(const Request& request) const;
  Bytes writeRegisters(const Peer& from, const Request& request, Outcome& outcome);
  Bytes writeMemory(const Peer& from, const Request& request, Outcome& outcome);
  [[nodiscard]] bool isClosedTo(const Peer& from) const;

  // device_write.cpp
  std::uint16_t write(const Peer& from, std::uint64_t address, std::span<const std::byte> bytes,
                      Outcome& outcome);
  std::uint16_t set(const Peer& from, const Memory::Element& element, std::span<const std::byte> bytes,
                    Outcome& outcome);
  [[nodiscard]] std::uint16_t check(const Memory::Element& element, std::uint64_t value) const;
  [[nodiscard]] std::uint16_t checkEntry(const Memory::Element& element, std::uint64_t value) const;
  std::uint16_t setBootstrap(const Memory::Element& element, std::uint64_t value, Outcome& outcome);
  std::uint16_t setFeature(const Memory::Element& element, std::uint64_t value, Outcome& outcome);
  std::uint16_t setControl(const Peer& from, std::uint32_t value);
  std::uint16_t setSource(Item item, double value, Outcome& outcome) const;
  std::uint16_t start();
  void release();
  void refresh();

  Memory memory_;
  SourceFacts facts_;
  std::array<std::uint64_t, 2> size_{};  ///< of the source's last image
  double scale_mm_, amplitude_per_count_;
  std::optional<Peer> controller_;
  Time heard_at_{};
  bool is_streaming_ = false;
  std::uint64_t starts_ = 0;
  Last last_;                 ///< command that wrote
  std::optional<Half> half_;  ///< of a register, written so far
};

}  // namespace toftwin::daemon::gige_vision
