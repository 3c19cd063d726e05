// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/plan/run_settings.h"
#include "calib/plan/compared_run.h"

struct sqlite3;

namespace toftwin::plan {

/// A run that was judged, as the log keeps it.
struct LoggedRun {
  std::int64_t id = 0;
  std::string judged{};  ///< when, UTC
  std::string began{};   ///< the first capture, UTC
  std::string folder{}, plan{}, camera_a{}, camera_b{}, software{}, note{};
  std::string
      index_sha256{};  ///< of its index.jsonl: the same captures judged again take the old entry's place
  bool is_locked = false;
  /// Frames of B in which anything is seen, and how many of them are, bit for bit, A's; -1: not known, of a log of
  /// version 2 or before.
  std::int64_t frames_of_b = -1, same_frames = -1;
  std::vector<RunSetting> settings{};  ///< written with it; settings() reads them
  std::int64_t captures = 0, planned = 0;  ///< of its settings, where it is read; 0: not known
  /// It was judged before all of its plan was measured.
  [[nodiscard]] bool isUnfinished() const { return captures < planned; }
  /// One camera was given twice: none of its numbers says what two cameras do, and which of the two it was is not known.
  [[nodiscard]] bool isOfOneCamera() const { return same_frames > 0; }
};

/// One number of one run.
struct LoggedTrait {
  LoggedRun run{};
  RunTrait trait{};
  /// The camera that it is of, or one of both, is called so: its name begins with this.
  [[nodiscard]] bool isOf(const std::string& camera) const {
    return (trait.of != "B" && run.camera_a.starts_with(camera)) ||
           (trait.of != "A" && run.camera_b.starts_with(camera));
  }
};

/// The log of runs: an SQLite database, whose schema docs/log.md documents.
class RunLog {
 public:
  /// Made if it is not there, brought to this version's schema if it is older. Errors: a file that is no such
  /// log, or one of a newer version.
  static Result<RunLog> open(const std::filesystem::path& file);
  /// Error where nothing can be added now: no right to write, or somebody else writes for more than 5 s.
  Result<> checkWritable();
  Result<> add(const LoggedRun& run, const RunTraits& traits);
  /// By when they began.
  Result<std::vector<LoggedRun>> runs();
  /// The cameras of all runs, each once.
  Result<std::vector<CameraName>> cameras();
  /// What a run was made with; nothing of runs that a log of version 1 had.
  Result<std::vector<RunSetting>> settings(std::int64_t run);
  /// All numbers whose characteristic and name begin so (empty: all) and whose camera, A's or B's, is called
  /// so.
  Result<std::vector<LoggedTrait>> traits(const std::string& camera, const std::string& what,
                                          const std::string& name);

 private:
  explicit RunLog(std::shared_ptr<sqlite3> database) : database_(std::move(database)) {}
  std::shared_ptr<sqlite3> database_;
};

}  // namespace toftwin::plan
