// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/clock.h>
#include <toftwin/result.h>

namespace toftwin::daemon {

/// `record` of a [[source]]
struct RecordKeys {
  std::string file;
  std::string split;
  std::string keep;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("file", file,
           "records the source from its start to its end, on and on, into files of that name, as strftime(3) makes it from "
           "the time in UTC; relative to recording_folder. Empty: it is not");
    v.text("split", split,
           "when the next file is begun: after a time (\"10min\", \"1h\", \"30s\") or before it becomes larger than a size "
           "(\"2GB\", \"500MB\"); empty: never");
    v.text("keep", keep,
           "how much of them stays, in a size or a time (\"200GB\", \"7d\"); beyond it, and where less than "
           "recording.keep_free_mb would stay free, the oldest are removed. Empty: all");
  }
};

/// A recording that goes on for as long as its source is configured.
struct RecordPlan {
  std::filesystem::path pattern;  ///< absolute
  std::chrono::seconds split{0};  ///< 0: not by time, likewise below
  std::uint64_t split_bytes = 0;
  std::uint64_t keep_bytes = 0;
  std::chrono::seconds keep_time{0};
};

/// Error InvalidArgument: a word that is no size or time, or a name that is the same whatever the time though there are several.
Result<RecordPlan> readRecordPlan(const RecordKeys& keys, const std::filesystem::path& folder);

/// The file of that time which is not there yet.
std::filesystem::path nextFile(const RecordPlan& plan, HostTime now);
/// The plan's files, the oldest first; whatever else lies there is none of them.
std::vector<std::filesystem::path> filesOf(const RecordPlan& plan);
/// Removes the oldest but the newest until the plan's bounds hold and `free_bytes` are free on the disk. Gives how many went.
std::size_t makeRoom(const RecordPlan& plan, HostTime now, std::uint64_t free_bytes);
/// For people: how long the disk lasts at so many bytes a second.
std::string howLong(const RecordPlan& plan, std::uint64_t keep_free_bytes, double bytes_per_second);

}  // namespace toftwin::daemon
