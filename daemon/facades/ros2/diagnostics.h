// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/clock.h>
#include <toftwin/result.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "daemon/facades/ros2/participant.h"

namespace toftwin::daemon::ros2 {

/// What diagnostic_msgs/DiagnosticStatus says of the camera.
struct Diagnosis {
  enum class Level : std::uint8_t { Ok = 0, Warn = 1, Error = 2, Stale = 3 };
  Level level = Level::Ok;
  std::string message;
  std::vector<std::pair<std::string, std::string>> values{};
};

/// What is known of the source now. Error: it is not there; Warn: the device lost frames since `lost_before`.
struct SourceNow {
  bool is_present = false;
  std::string problem{};  ///< why it is not
  bool is_streaming = false;
  std::uint64_t frames = 0, lost = 0, reconnects = 0;
};
Diagnosis diagnosisOf(const SourceNow& now, std::uint64_t lost_before);

/// The topic /diagnostics, where ROS 2's robots look for what ails their parts.
class Diagnostics {
 public:
  static Result<Diagnostics> open(Participant& participant);
  /// `name`: of the part, as "cam: source dock". Nothing is written where nobody reads.
  Result<> tell(const std::string& name, const std::string& hardware, const Diagnosis& diagnosis,
                HostTime now) const;

 private:
  Writer writer_;
};

}  // namespace toftwin::daemon::ros2
