// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/cli/import/import_source.h"

namespace toftwin::cli {

/// A plane that came, and where it is from.
struct TakenPlane {
  Plane plane;
  std::string topic, space, frame_id;
  bool is_rectified = false;
};

/// What came of one camera with one stamp.
struct PendingFrame {
  std::string camera;
  std::int64_t stamp_ns = 0, received_ns = 0;
  std::vector<TakenPlane> planes;
};

/// Frames that wait for the rest of their messages. One is complete when two later ones of its camera have begun, or when all
/// together hold too much; at the end all are.
class PendingFrames {
 public:
  /// The first that comes of a plane is taken; whether this one is.
  bool add(const std::string& camera, std::int64_t stamp_ns, std::int64_t received_ns, TakenPlane plane);
  /// The next that is complete.
  std::optional<PendingFrame> take(bool is_end);

 private:
  static constexpr std::size_t kLater = 2;
  static constexpr std::size_t kMostBytes = 512u << 20;
  std::map<std::string, std::deque<PendingFrame>> of_camera_;
  std::size_t bytes_ = 0;
};

}  // namespace toftwin::cli
