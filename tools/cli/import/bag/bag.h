// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "protocol/ros/messages.h"

/// Files of messages on topics, whatever their container.
namespace toftwin::cli {

/// How a topic's messages are written.
enum class Dialect { Cdr, Ros1, FlatBuffers, Protobuf, Other };

struct BagTopic {
  std::string name;
  std::string type;  ///< "sensor_msgs/Image", "foxglove.RawImage"
  Dialect dialect = Dialect::Other;
};

struct BagMessage {
  std::size_t topic = 0;  ///< of topics()
  std::int64_t log_time_ns = 0;
  ros::ByteView data;     ///< good until the next call
};

/// Messages in the order of the file. Nothing in the file is believed before it is checked.
class Bag {
 public:
  virtual ~Bag() = default;
  [[nodiscard]] virtual const std::vector<BagTopic>& topics() const = 0;
  /// Error EndOfStream after the last. What is damaged is one error; the call after it goes on behind.
  virtual Result<BagMessage> next() = 0;
  /// What the file says, or 0.
  [[nodiscard]] virtual std::uint64_t messages() const { return 0; }
  [[nodiscard]] virtual std::string damage() const { return {}; }
};

/// The type's name without "/msg", which ROS 2 has in it.
std::string plainType(std::string type);

// One for each container.
Result<std::unique_ptr<Bag>> openMcapBag(const std::filesystem::path& file);
/// A bag of ROS 2 in SQLite (.db3).
Result<std::unique_ptr<Bag>> openDb3Bag(const std::filesystem::path& file);
/// A bag of ROS 1, version 2.0; chunks as they are, lz4 or bz2.
Result<std::unique_ptr<Bag>> openRos1Bag(const std::filesystem::path& file);

/// Whether a file begins as a bag, or a folder has such files.
bool isBag(const std::filesystem::path& what);
/// Any of these; of a folder all of its files, one after the other.
Result<std::unique_ptr<Bag>> openBag(const std::filesystem::path& what);

}  // namespace toftwin::cli
