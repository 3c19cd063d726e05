// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstring>
#include <type_traits>
#include <vector>

#include "protocol/foxglove/messages.h"
#include "protocol/foxglove/protobuf.h"
#include "protocol/ros/cdr.h"
#include "protocol/ros/ros1.h"
#include "tools/cli/import/bag/bag.h"

namespace toftwin::cli {

/// Messages in any of the dialects as ROS's values.
class MessageReader {
 public:
  /// The bytes that it views are good until the next call, as the message's are.
  template <ros::Message M>
  Result<M> read(const BagTopic& topic, ros::ByteView bytes) {
    if (topic.dialect == Dialect::Cdr) return ros::fromCdr<M>(bytes);
    if (topic.dialect == Dialect::Ros1) return ros::fromRos1<M>(bytes);
    if (topic.dialect == Dialect::Protobuf) return fromProtobuf<M>(bytes);
    if constexpr (std::is_same_v<M, ros::CompressedImage>) {
      return Error{Error::Code::Unsupported, "compressed images of Foxglove in FlatBuffers are not read"};
    } else {
      // In a chunk a message begins anywhere; FlatBuffers wants its numbers at multiples of their sizes.
      aligned_.resize((bytes.size() + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t));
      if (!bytes.empty()) std::memcpy(aligned_.data(), bytes.data(), bytes.size());
      M message;
      const auto decoded = foxglove::decode(std::as_bytes(std::span{aligned_}).first(bytes.size()), message);
      return decoded ? Result<M>{std::move(message)} : Result<M>{decoded.error()};
    }
  }

 private:
  template <ros::Message M>
  static Result<M> fromProtobuf(ros::ByteView bytes) {
    if constexpr (std::is_same_v<M, ros::PointCloud2>) {
      return Error{Error::Code::Unsupported, "clouds without rows and columns are not read"};
    } else {
      M message;
      const auto decoded = foxglove::decodeProtobuf(bytes, message);
      return decoded ? Result<M>{std::move(message)} : Result<M>{decoded.error()};
    }
  }

  std::vector<std::uint64_t> aligned_;
};

}  // namespace toftwin::cli
