// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dds/dds.h>
#include <toftwin/result.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "daemon/facades/ros2/keys.h"

namespace toftwin::daemon::ros2 {

struct Network {
  int domain = 0;
  std::string address;
  std::vector<std::string> peers;
};

/// How a topic's messages are delivered.
struct Quality {
  bool is_reliable = false;
  bool is_latched = false;  ///< those who come later get the last ones, too
  int keep_last = 1;
};

/// A topic to which one writes. Lives no longer than its participant.
class Writer {
 public:
  Writer() = default;
  explicit Writer(dds_entity_t entity) : entity_(entity) {}
  [[nodiscard]] std::uint32_t readers() const;
  [[nodiscard]] bool hasReaders() const { return readers() > 0; }
  /// `message` of the topic's type; copied.
  [[nodiscard]] Result<> write(const void* message) const;

 private:
  dds_entity_t entity_ = 0;
};

/// One participant of DDS with threads and sockets of its own, even beside others of the same domain.
class Participant {
 public:
  static Result<std::unique_ptr<Participant>> open(const Network& network);
  /// Waits for callbacks.
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// `topic` as in ROS 2: "/camera/points"; or without "/" one of ROS 2's own, as DDS has it.
  Result<Writer> write(const std::string& topic, const dds_topic_descriptor_t& type, const Quality& quality);
  /// `wake` is called on a thread of DDS when there is something to take.
  Result<dds_entity_t> read(const std::string& topic, const dds_topic_descriptor_t& type,
                            const Quality& quality, std::function<void()> wake);

  /// What the network knows it by, and the writers and readers that it has so far.
  using Guid = std::array<std::uint8_t, 16>;
  [[nodiscard]] Guid guid() const { return guidOf(participant_); }
  [[nodiscard]] std::vector<Guid> writers() const { return guidsOf(writers_); }
  [[nodiscard]] std::vector<Guid> readers() const { return guidsOf(readers_); }

 private:
  Participant() = default;
  static Guid guidOf(dds_entity_t entity);
  static std::vector<Guid> guidsOf(const std::vector<dds_entity_t>& entities);
  Result<dds_entity_t> topic(const std::string& name, const dds_topic_descriptor_t& type) const;

  dds_entity_t domain_ = 0, participant_ = 0;
  std::vector<dds_entity_t> writers_, readers_;
  std::vector<std::unique_ptr<std::function<void()>>> wakes_;  ///< DDS has their addresses
};

}  // namespace toftwin::daemon::ros2
