// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/result.h>

#include "calib/plan/captures.h"
#include "calib/plan/take.h"

namespace toftwin::plan {

/// Names in the folder of a run.
inline constexpr const char* kRunFile = "run.toml";        ///< what it was made from
inline constexpr const char* kPlanFile = "plan.toml";      ///< a copy of the plan
inline constexpr const char* kIndexFile = "index.jsonl";   ///< a line for each finished capture
inline constexpr const char* kOpenedFile =
    "opened.json";  ///< when the locked captures of both cameras were opened (opened.h)
inline constexpr const char* kOpenFolder = "captures";
inline constexpr const char* kLockedFolder = "locked";

/// One camera's file of a capture.
struct RecordedFile {
  std::string file{};    ///< relative to the run's folder
  std::string sha256{};  ///< 64 hex digits
  std::string source{};
  std::uint64_t frames = 0;
  double since_power_on_s = 0.0;  ///< of its first frame; NaN where unknown
};

/// What the index says of a finished capture.
struct CaptureRecord {
  std::size_t number = 0;
  std::string block{}, kind{}, name{};
  std::size_t condition = 0;
  int repeat = 0;
  bool is_locked = false;
  std::optional<std::size_t> again{};
  double start_s = 0.0;  ///< as planned
  std::int64_t began_ns = 0;
  double distance_m = 0.0, angle_deg = 0.0;  ///< NaN without a pose
  double exposure_us = 0.0;                  ///< of A's first frame, else as planned; 0: not known
  double ambient_klx = 0.0;
  std::optional<Transform<World, Camera>> pose{};
  std::string pose_by{};
  /// 95 % half widths of a pose that was seen: turns (rad), then place (m).
  std::optional<std::array<double, 6>> pose_half_widths{}, pose_of_b_half_widths{};
  /// Where B saw itself; none where it was put to `pose` or took it on trust.
  std::optional<Transform<World, Camera>> pose_of_b{};
  RecordedFile a{}, b{};
  std::vector<std::string> notes{};

  /// Captures of one condition are repeats; conditions are numbered within their block.
  using Condition = std::pair<std::string, std::size_t>;
  [[nodiscard]] Condition conditionInRun() const { return {block, condition}; }
};

/// What is written of a capture: one line of JSON without its end.
std::string lineOf(const Plan& plan, const PlannedCapture& planned, const Taken& taken, const RecordedFile& a,
                   const RecordedFile& b);

/// The finished captures of a run, in their order; a torn last line, as a kill leaves one, is left out.
/// Errors: no such file, a line that is no capture.
Result<std::map<std::size_t, CaptureRecord>> readIndex(const std::filesystem::path& file);

/// SHA-256 of a file, 64 hex digits.
Result<std::string> sha256Of(const std::filesystem::path& file);

}  // namespace toftwin::plan
