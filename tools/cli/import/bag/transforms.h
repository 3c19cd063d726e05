// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/geometry.h>

#include "protocol/ros/messages.h"

namespace toftwin::cli {

/// Where frames of reference are in their parents, as /tf and /tf_static tell it.
class Transforms {
 public:
  /// Those that are no rotation, or go in a circle, are left out. Of each frame the last 4096 are kept.
  void add(const ros::TFMessage& message, bool is_static);
  /// Of that frame in the topmost one above it, at that time: between two that are told is interpolated. Nothing if it has no
  /// parent, or one on the way was told more than 0.1 s from then.
  [[nodiscard]] std::optional<Transform<World, Camera>> poseOf(const std::string& frame, std::int64_t time_ns) const;
  /// The topmost frame above.
  [[nodiscard]] std::string rootOf(std::string frame) const;

 private:
  using Any = Transform<World, Camera>;  ///< of a child in its parent, whichever those are
  struct Child {
    std::string parent;
    bool is_static = false;
    std::map<std::int64_t, Any> at;
  };
  static std::optional<Any> valueAt(const Child& child, std::int64_t time_ns);
  std::map<std::string, Child> children_;
};

}  // namespace toftwin::cli
